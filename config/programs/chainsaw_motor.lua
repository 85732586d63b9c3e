-- Motor into the housing of a chainsaw (config/scenarios/chainsaw_motor.yaml).
--
--   The motor is taken out of its box straight up and slowly, carried to the housing, lowered into the chamber, turned by
--   45 degrees and pressed into its seat: the boss is in the bore from 22.5 s on, at its end at 23.8 s.
--
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

-- To be varied (controller.parameters in the scenario): how far beside the seat's middle the robot presses, and how fast
-- the motor leaves the box.
local LATERAL_OFFSET = parameter("lateral_offset_m", 0.0)
local LIFT_SPEED = parameter("lift_speed_m_per_s", 0.02)

local MOTOR = pose{x = -0.20, y = 0.25, z = 0.703}
local SEAT = pose{x = 0.05 + LATERAL_OFFSET, y = -0.10, z = 0.713}

-- The tool centre point in the motor's frame: pad tips 46 mm above the boss' end, at the flats; tool pointing down.
local GRIP = pose{z = 0.046, roll = math.pi}
local TURN = pose{yaw = math.pi / 4}

local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local DOWN = {speed_m_per_s = 0.1, acceleration_m_per_s2 = 0.5}

routine("Robot", function(r)
  r:step("grip the motor")
  local pick = MOTOR * GRIP
  r.gripper:width(0.046)
  r:move_to(pick:offset(0, 0, 0.15), SWING)
  r:move_line(pick, DOWN)
  r:wait_until(5.5)
  r.gripper:close()
  r:wait(0.5)
  r:wait_until(6.5)
  r:step("out of the box")
  r:move_line(pick:offset(0, 0, 0.08), {speed_m_per_s = LIFT_SPEED, acceleration_m_per_s2 = 40 * LIFT_SPEED})
  r:move_line(pick:offset(0, 0, 0.18), DOWN)

  local seat = SEAT * GRIP                  -- not yet turned
  r:step("to the housing")
  r:move_to(seat:offset(0, 0, 0.15), SWING)
  r:wait_until(15.5)
  r:step("into the chamber")
  r:move_line(seat:offset(0, 0, 0.020), {speed_m_per_s = 0.05})    -- the boss 8 mm above its seat
  r:wait_until(19.5)
  r:step("turn")
  local turned = SEAT * TURN * GRIP
  r:move_line(turned:offset(0, 0, 0.020), {rotation_speed_rad_per_s = 0.6})
  r:wait_until(21.6)
  r:step("press in")
  r:move_line(turned, {duration_s = 2.2})
  r:wait_until(24.6)
  r:step("let go")
  r.gripper:width(0.060)
  r:wait(0.5)
  r:move_line(turned:offset(0, 0, 0.15), DOWN)
end)
