-- Lifts a block and puts it down again (config/scenarios/weak_grip.yaml).
--
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

local LIFT = parameter("lift_m", 0.10)

local GRIP = pose{x = -0.22, y = -0.05, z = 0.7 + 0.045, roll = math.pi}
local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local LINE = {speed_m_per_s = 0.15, acceleration_m_per_s2 = 0.5}

routine("Robot", function(r)
  r.gripper:width(0.110)
  r:move_to(GRIP:offset(0, 0, 0.10), SWING)
  r:move_line(GRIP, LINE)
  r:wait_until(3)
  r.gripper:close()
  r:wait(0.6)
  r:move_line(GRIP:offset(0, 0, LIFT), LINE)
  r:wait(0.5)
  r:move_line(GRIP, LINE)
  r.gripper:width(0.110)
  r:wait(0.5)
  r:move_line(GRIP:offset(0, 0, 0.10), LINE)
end)
