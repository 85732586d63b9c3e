-- Grips a block, lifts it by 150 mm and holds it for 5 s (config/scenarios/contact/grasp_and_lift.yaml).
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

-- The tool centre point when gripping: pad tips 54 mm above the part's bottom face, tool pointing down, jaws along y.
local P_START = pose{x = -0.22, y = 0.20, z = 0.7}
local GRIP_FORCE_N = parameter("grip_force_N", 150)
local GRIP = P_START * pose{z = 0.054, roll = math.pi}

routine("Robot1", function(r)
  r.gripper:width(0.060)
  r:move_to(GRIP:offset(0, 0, 0.12), {speed = 0.35, acceleration_rad_per_s2 = 1.5})
  r:move_line(GRIP, {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0})
  r:wait_until(3.8)
  r.gripper:close(GRIP_FORCE_N)
  r:wait(0.4)
  r:move_line(GRIP:offset(0, 0, 0.15), {duration_s = 1.6})
  r:wait(5.0)
end)
