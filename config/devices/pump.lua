-- A pump fills a tank that drains through an orifice (Torricelli): area dh/dt = inflow - outlet sqrt(2 g h).
local area = parameter("area_m2", 0.5, {lower = 1e-6})
local flow = parameter("flow_m3_per_s", 0.01, {lower = 0})
local outlet = parameter("outlet_area_m2", 0.001, {lower = 0})
local height = parameter("height_m", 2.0, {lower = 0})
local gravity = 9.80665

input("run", {type = "boolean"})
input("speed", {lower = 0, upper = 1, initial = 1})
output("level", {unit = "m", state = "level"})
output("full", {type = "boolean"})
output("starts", {type = "integer"})

state {running = false}
differential("level", {initial = 0, scale = 0.1})

function derivatives(t, x, inputs, state)
  local inflow = state.running and flow * inputs.speed or 0
  local level = math.max(x.level, 0)
  return {level = (inflow - outlet * math.sqrt(2 * gravity * level)) / area}
end

function step(self, dt)
  local full = self.x.level >= height
  local run = self.signals.run and not full
  if run and not self.state.running then self.signals.starts = self.signals.starts + 1 end
  self.state.running = run
  self.signals.full = full
end
