-- Goes where the PLC says: to A or to B, over a point above. The gripper belongs to the PLC. Lengths in m, angles in rad.
period_s = 0.008

-- The tool centre point at A and B; those of carry.yaml unless given.
local HEIGHT = parameter("height_m", 0.754)
local function place(name, x, y)
  return pose{x = parameter(name .. "_x_m", x), y = parameter(name .. "_y_m", y), z = HEIGHT, roll = math.pi}
end
local WHERE = {a = place("a", -0.22, -0.05), b = place("b", -0.22, 0.15)}
local LIFT = parameter("lift_m", 0.05)
local FAST = {speed_m_per_s = 0.8, acceleration_m_per_s2 = 4.0}
local flags = device("FromRobot")
leave_gripper("Gripper")

local function wanted(cell)
  local signals = cell.devices.FromPlc.signals
  if signals.to_a > 0.5 then return "a" end
  if signals.to_b > 0.5 then return "b" end
end

routine("Robot", function(r)
  local at
  while true do
    r:wait_for(function(cell)
      local place = wanted(cell)
      return place and place ~= at
    end)
    local place = wanted(cell)
    flags:set{at_a = 0, at_b = 0}
    if at then r:move_line(WHERE[at]:offset(0, 0, LIFT), FAST) end
    r:move_line(WHERE[place]:offset(0, 0, LIFT), FAST)
    r:move_line(WHERE[place], FAST)
    r:wait(0.1)
    at = place
    flags:set{at_a = place == "a" and 1 or 0, at_b = place == "b" and 1 or 0}
  end
end)
