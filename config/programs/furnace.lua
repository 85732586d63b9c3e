-- Puts a rotor core into the furnace at 1000 s and takes it out again at 8200 s (config/scenarios/furnace.yaml).
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.05

local GRIP_HEIGHT = 0.15              -- of the tool centre point above the rotor's lower face
local function grip(x, y, z) return pose{x = x, y = y, z = z + GRIP_HEIGHT, roll = math.pi} end
local TABLE = grip(0, 1.15, 0.7)
local STAND = grip(1.15, 0, 0.4)      -- in the furnace
local MOUTH = STAND:offset(0, 0, 0.26)   -- the rotor's centre 10 mm above the chamber
local ABOVE = STAND:offset(0, 0, 0.55)
local SLOW = {speed = 0.25, acceleration_rad_per_s2 = 0.8}

-- 2 s between MOUTH and STAND; the centre is at the chamber's upper face 0.25 s after the one and 1.78 s after the other.
local LINE = {duration_s = 2}

routine("Robot", function(r)
  r.gripper:width(0.24)
  r:move_to(TABLE:offset(0, 0, 0.3), SLOW)
  r:move_line(TABLE)
  r.gripper:close()
  r:wait(0.6)
  r:move_line(TABLE:offset(0, 0, 0.3))
  r:move_to(ABOVE, SLOW)
  r:wait_until(980)
  r:move_line(MOUTH)
  r:wait_until(999.75)
  r:move_line(STAND, LINE)
  r.gripper:width(0.24)
  r:wait(0.6)
  r:move_line(ABOVE)

  r:wait_until(8180)
  r:move_line(STAND)
  r.gripper:close()
  r:wait(0.6)
  r:wait_until(8198.2)
  r:move_line(MOUTH, LINE)
  r:move_line(ABOVE)
  r:move_to(TABLE:offset(0, 0, 0.3), SLOW)
  r:move_line(TABLE)
  r.gripper:width(0.24)
  r:wait(0.6)
  r:move_line(TABLE:offset(0, 0, 0.3))
end)
