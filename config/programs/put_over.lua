-- Puts a part with a bore over what stands beside it (config/scenarios/gear_on_shaft.yaml, ring_on_pin.yaml): gripped from
-- 4 s, over the seat at 8 s, let go of at 10 s.
--
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

local LIFT = parameter("lift_m", 0.10)
local SEAT_HEIGHT = parameter("seat_height_m", 0.0)     -- of the part's lower face, above the table

-- Pad tips 5 mm above the part's lower face; tool pointing down, jaws along y.
local GRIP = pose{z = 0.005, roll = math.pi}
local START = pose{x = -0.22, y = 0.20, z = 0.7} * GRIP
local SEAT = pose{x = -0.22, y = -0.05, z = 0.7 + SEAT_HEIGHT} * GRIP
local OPEN = 0.070

local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local LINE = {speed_m_per_s = 0.15, acceleration_m_per_s2 = 0.5}
local SLOW = {speed_m_per_s = 0.06, acceleration_m_per_s2 = 0.3}

routine("Robot", function(r)
  r:step("grip")
  r.gripper:width(OPEN)
  r:move_to(START:offset(0, 0, 0.12), SWING)
  r:move_line(START, LINE)
  r:wait_until(4)
  r.gripper:close()
  r:wait(0.5)
  r:step("put over")
  r:move_line(START:offset(0, 0, LIFT), LINE)
  r:move_line(SEAT:offset(0, 0, LIFT), LINE)
  r:wait_until(8)
  r:move_line(SEAT, SLOW)
  r:wait_until(10.5)
  r.gripper:width(OPEN)
  r:wait(0.5)
  r:step("away")
  r:move_line(SEAT:offset(0, 0, LIFT), LINE)
end)
