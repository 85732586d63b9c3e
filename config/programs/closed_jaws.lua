-- Closes the jaws on nothing, lowers them onto a pin and lifts them again (config/scenarios/closed_jaws.yaml).
--
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

-- How far the pads' tips go below the upper end of the pin.
local DEPTH = parameter("depth_m", 0.0001)

local END = pose{x = -0.22, y = -0.05, z = 0.75 - DEPTH, roll = math.pi}
local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local SLOW = {speed_m_per_s = 0.03, acceleration_m_per_s2 = 0.1}

routine("Robot", function(r)
  r:move_to(END:offset(0, 0, 0.03), SWING)
  r.gripper:close()
  r:wait_until(3)
  assert(cell.grippers.Gripper.in_position, "the jaws are not closed yet")
  r:move_line(END, SLOW)
  r:wait(0.3)
  assert(cell.grippers.Gripper.part == nil, "there is nothing to grip")
  r:move_line(END:offset(0, 0, 0.03), SLOW)
end)
