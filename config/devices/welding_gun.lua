-- A spot welding gun: it squeezes, welds and holds, each for its time; the electrode force builds up with a time constant.
-- The nugget's heat is the integral of R I^2.
local squeeze = parameter("squeeze_s", 0.3, {lower = 0})
local weld = parameter("weld_s", 0.2, {lower = 0})
local hold = parameter("hold_s", 0.1, {lower = 0})
local force = parameter("force_N", 2500, {lower = 0})
local rise = parameter("rise_s", 0.05, {lower = 1e-6})
local current = parameter("current_A", 8000, {lower = 0})
local resistance = parameter("resistance_Ohm", 1e-4, {lower = 0})

input("start", {type = "boolean"})
output("force", {unit = "N", state = "force"})
output("heat", {unit = "J", state = "heat"})
output("busy", {type = "boolean"})
output("done", {type = "boolean"})
output("welds", {type = "integer"})

state {phase = "open", steps = 0}
differential("force", {initial = 0, scale = 100})
differential("heat", {initial = 0, scale = 100})

function derivatives(t, x, inputs, state)
  local wanted = state.phase == "open" and 0 or force
  return {
    force = (wanted - x.force) / rise,
    heat = state.phase == "weld" and resistance * current * current or 0,
  }
end

local follows = {squeeze = "weld", weld = "hold", hold = "open"}
local lasts = {squeeze = squeeze, weld = weld, hold = hold}

function step(self, dt)
  local phase = self.state.phase
  if phase == "open" then
    if not self.signals.start then
      self.signals.done = false
    elseif not self.signals.done then
      phase = "squeeze"
      self.state.steps = 0
      self.x.heat = 0
    end
  else
    self.state.steps = self.state.steps + 1
    if self.state.steps >= math.floor(lasts[phase] / dt + 0.5) then
      if phase == "hold" then
        self.signals.done = true
        self.signals.welds = self.signals.welds + 1
      end
      phase = follows[phase]
      self.state.steps = 0
    end
  end
  self.state.phase = phase
  self.signals.busy = phase ~= "open"
end
