-- A robot on a track (config/devices/robot_track.yaml): it takes a block from one table, rides to the next, and lays it there.
-- Poses are given in the world; the robot reaches them from where its carriage stands.
--
-- Lengths in m, angles in rad; see docs/controller_programs.md.

period_s = 0.008

local track = device("Track")
local GRIP = pose{x = -0.22, y = 0.2, z = 0.754, roll = math.pi}   -- pad tips 54 mm above the lower face
local WAY = parameter("way_m", 1.5)                                -- from table to table
local ABOVE = 0.15
local CAREFUL = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}

local function stands(cell) return cell.devices.Track.signals.in_position > 0.5 end

routine("Robot", function(r)
  r:step("take")
  r:move_to(GRIP:offset(0, 0, ABOVE))
  r:move_line(GRIP, CAREFUL)
  r.gripper:close()
  r:wait(0.6)
  r:move_line(GRIP:offset(0, 0, ABOVE), CAREFUL)

  r:step("ride")
  track:set{set_position = WAY}
  r:wait(0.1)
  r:wait_for(stands, 10)

  r:step("lay down")
  r:move_line(GRIP:offset(0, WAY, 0), CAREFUL)
  r.gripper:open()
  r:wait(0.6)
  r:move_line(GRIP:offset(0, WAY, ABOVE), CAREFUL)
end)
