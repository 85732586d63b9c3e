-- Threads a nut onto a bolt and tightens it (config/scenarios/nut_on_bolt.yaml): gripped at 3 s, on the bolt's end at 7 s, in the
-- thread at 8.5 s, run down in five strokes until 51 s, tight at 56.5 s.
--
-- Lengths in m, angles in rad, times in s of simulated time, forces in N, torques in N m; see docs/controller_programs.md.

period_s = 0.008

local TIGHT = parameter("torque_N_m", 2.0)      -- of the wrist, when the nut is tight

local LEAD = 0.002
local BOLT = pose{x = -0.22, y = -0.05, z = 0.71}   -- the centre of the bearing face of its head
local END, SEAT = 0.026, 0.010                  -- of the thread and of the spacer, above it
local OPEN = 0.036                              -- lets the corners of the nut pass
local FLAT = math.pi / 3                        -- after turns by this the jaws fit the flats again
local WRIST = 2 * math.pi - 0.1                 -- its range, either way

-- Pad tips 5 mm above the nut's lower face; tool pointing down, jaws along y.
local GRIP = pose{z = 0.005, roll = math.pi, yaw = math.pi}
local START = pose{x = -0.22, y = 0.20, z = 0.7} * GRIP

local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local LINE = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}
local FEEL = {duration_s = 0.04, rotation_acceleration_rad_per_s2 = 300, rotation_speed_rad_per_s = 3}
local TURN = {rotation_speed_rad_per_s = 3, rotation_acceleration_rad_per_s2 = 30}

-- Arm and wrist as sensors: torques of shoulder and wrist less those in free air.
local free
local function tare() free = {cell.robots.Robot.effort[2], cell.robots.Robot.effort[6]} end
local function push(r) return (free[1] - cell.robots.Robot.effort[2]) / (r.tcp.x + 0.75) end
local function torque() return cell.robots.Robot.effort[6] - free[2] end

-- The gripped nut: its lower face above the head, and its angle less that of the wrist.
local height, angle = END + 0.0005, 0
local function at(z, yaw) return BOLT * pose{z = z, yaw = math.fmod(yaw, 2 * math.pi)} * GRIP end
local function move(r, down, turn, options)
  height, angle = height - down, angle + turn
  r:move_line(at(height, angle), options)
end
local function screw(r, turn, options) move(r, -turn / (2 * math.pi) * LEAD, turn, options) end

-- Lets go of the nut, turns back as far as the wrist can, and grips it again.
local function regrasp(r)
  r.gripper:width(OPEN)
  r:wait(0.2)
  local back = math.floor((WRIST + r.joints[6]) / FLAT)
  r:move_joints({r.joints[1], r.joints[2], r.joints[3], r.joints[4], r.joints[5], r.joints[6] - back * FLAT},
                {speed = 0.95, acceleration_rad_per_s2 = 20})
  angle = angle + back * FLAT
  r.gripper:close()
  r:wait(0.3)
end

routine("Robot", function(r)
  r:step("grip")
  r:move_to(START:offset(0, 0, 0.08), SWING)
  r:move_line(START, LINE)
  r.gripper:close()
  r:wait(0.5)
  r:step("carry")
  r:move_line(START:offset(0, 0, 0.08), LINE)
  r:move_line(at(END + 0.05, 0), LINE)
  r:move_line(at(height, 0), LINE)
  r:wait(0.3)
  tare()
  r:step("set down")
  repeat move(r, 0.00005, 0, FEEL) until push(r) > 3

  -- Pressed with 3 to 6 N it turns backwards: before the start of the thread it sinks, behind it it rises.
  r:step("find the thread")
  local lowest, top = height, height
  repeat
    local f = push(r)
    move(r, f < 3 and 0.00002 or f > 6 and -0.00002 or 0, FLAT / 15, FEEL)
    lowest = math.min(lowest, height)
  until lowest < top - 0.0001 and height > lowest + 0.0001

  r:step("run down")
  move(r, -0.00005, 0, FEEL)                     -- to the middle of the play
  repeat
    local flats = math.floor((WRIST - r.joints[6]) / FLAT)
    flats = math.min(flats, math.floor((height - SEAT) / LEAD * 6) - 1)
    while flats > 0 do
      screw(r, -math.min(flats, 2) * FLAT, TURN)
      flats = flats - 2
    end
    regrasp(r)
  until height - SEAT < LEAD / 2

  r:step("tighten")
  r:wait(0.3)
  tare()
  repeat
    screw(r, -math.pi / 30, TURN)
    r:wait(0.04)
  until push(r) > 15 or torque() > 0.01
  -- The nut stands on the spacer now: the arm follows it, but does not press it.
  repeat
    move(r, push(r) < 15 and LEAD / 180 or 0, -math.pi / 90, TURN)
    r:wait(0.16)
  until torque() > TIGHT
  r:step("away")
  r.gripper:width(OPEN)
  r:wait(0.3)
  r:move_line(at(height, angle):offset(0, 0, 0.10), LINE)
end)
