-- An oven with a two-point controller: C dT/dt = P - (T - T_surroundings) / R.
local capacity = parameter("capacity_J_per_K", 5000, {lower = 1e-6})
local resistance = parameter("resistance_K_per_W", 0.1, {lower = 1e-6})
local surroundings = parameter("surroundings_degC", 20)
local power = parameter("power_W", 3000, {lower = 0})
local band = parameter("band_K", 2, {lower = 0})

input("set_temperature", {unit = "degC", lower = 20, upper = 300, initial = 200})
input("enable", {type = "boolean"})
output("temperature", {unit = "degC", state = "temperature"})
output("heating", {type = "boolean"})
output("ready", {type = "boolean"})

state {mode = "off"}
differential("temperature", {initial = surroundings, scale = 10})

function derivatives(t, x, inputs, state)
  local heat = state.mode == "heating" and power or 0
  return {temperature = (heat - (x.temperature - surroundings) / resistance) / capacity}
end

function step(self, dt)
  local s = self.signals
  local mode = self.state.mode
  if not s.enable then
    mode = "off"
  elseif mode == "off" or self.x.temperature < s.set_temperature - band then
    mode = "heating"
  elseif self.x.temperature > s.set_temperature + band then
    mode = "waiting"
  end
  self.state.mode = mode
  s.heating = mode == "heating"
  s.ready = mode ~= "off" and math.abs(self.x.temperature - s.set_temperature) <= 2 * band
end
