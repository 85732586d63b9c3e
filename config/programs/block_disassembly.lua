-- Block disassembly by two robots (config/scenarios/block_disassembly.yaml): the assembly of
-- config/programs/block_assembly.lua taken apart in reverse order, its parts gripped at the same places.
--
--   Robot2 carries the whole assembly from Table2 to Table1. Robot1 takes O, with P in it, out of B. Then Robot2 takes C
--   out of B while Robot1 takes P out of O. Every part ends where it starts in the assembly.
--
-- Lengths in m, angles in rad, times in s of simulated time. Part frames lie at the centre of the bottom face, z up.
-- The calls of programs are described in docs/controller_programs.md.

period_s = 0.008

-- Times at which the grippers act, and at which a part held above its seat continues.
local CLOSE_ON_B_S, OPEN_B_S = 4.0, 11.0
local CLOSE_ON_O_S, CARRY_O_S, OPEN_O_S = 17.5, 20.5, 24.5
local CLOSE_ON_C_S, CARRY_C_S, OPEN_C_S = 26.0, 31.0, 34.5
local CLOSE_ON_P_S, CARRY_P_S, OPEN_P_S = 28.5, 30.6, 34.0

-- Where the assembly stands at the start, how its parts sit in one another, and where they belong.
local B_START = pose{x = 1.15, y = 0.0, z = 0.7, yaw = math.pi / 2}
local C_IN_B = pose{x = -0.060, z = 0.020}
local O_IN_B = pose{x = 0.040, z = 0.020}
local P_IN_O = pose{x = 0.015, z = 0.030}
local B_FINAL = pose{x = 0.10, y = -0.05, z = 0.7}
local C_FINAL = pose{x = 0.30, y = -0.20, z = 0.7}
local O_FINAL = pose{x = -0.22, y = -0.05, z = 0.7}
local P_FINAL = pose{x = -0.22, y = 0.20, z = 0.7}

-- The tool centre point in the part's frame when gripping: pad tips at this height, tool pointing down, jaws along y.
-- O is gripped high enough to leave B alone, P high enough to leave O alone.
local function grip(height) return pose{z = height, roll = math.pi} end
local GRIP_B, GRIP_C, GRIP_O, GRIP_P = grip(0.015), grip(0.045), grip(0.045), grip(0.054)

-- Jaws stand open 30 mm wider than the part.
local JAWS_B, JAWS_C, JAWS_O, JAWS_P = 0.150, 0.110, 0.110, 0.060
local JAW_TIME_S = 0.4

-- Where the robots wait, tool pointing down.
local HOME_1 = pose{x = -0.30, y = 0.10, z = 1.05, roll = math.pi}
local HOME_2 = pose{x = 0.55, y = -0.15, z = 1.10, roll = math.pi}

-- Ways of moving.
local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local LONG_SWING = {duration_s = 3.2}
local LIFT = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}
local CARRY = {speed_m_per_s = 0.3, acceleration_m_per_s2 = 0.8}
local SLIDE = {speed_m_per_s = 0.12, acceleration_m_per_s2 = 0.5}

local function above(target, height) return target:offset(0, 0, height) end

-- Opens the jaws, comes down on the part from above, and closes at the given time.
local function pick(r, target, approach, jaws, close_s)
  r.gripper:width(jaws)
  r:move_to(above(target, approach), SWING)
  r:move_line(target, LIFT)
  r:wait_until(close_s)
  r.gripper:close()
  r:wait(JAW_TIME_S)
end

-- Puts the part down, and opens at the given time.
local function place(r, target, jaws, open_s)
  r:move_line(target, SLIDE)
  r:wait_until(open_s)
  r.gripper:width(jaws)
  r:wait(JAW_TIME_S)
end

routine("Robot1", function(r)
  -- O, with P in it, out of B
  local o_seat = B_FINAL * O_IN_B * GRIP_O
  r:wait_signal("the assembly is on Table1, Robot2 is away")
  pick(r, o_seat, 0.16, JAWS_O, CLOSE_ON_O_S)
  r:move_line(above(o_seat, 0.14), SLIDE)
  r:wait_until(CARRY_O_S)
  r:move_line(above(O_FINAL * GRIP_O, 0.14), CARRY)
  signal("O is out of B, Robot1 is away")
  place(r, O_FINAL * GRIP_O, JAWS_O, OPEN_O_S)
  r:move_line(above(O_FINAL * GRIP_O, 0.16), LIFT)

  -- P out of O
  local p_seat = O_FINAL * P_IN_O * GRIP_P
  pick(r, p_seat, 0.12, JAWS_P, CLOSE_ON_P_S)
  r:move_line(above(p_seat, 0.12), SLIDE)
  r:wait_until(CARRY_P_S)
  r:move_line(above(P_FINAL * GRIP_P, 0.15), CARRY)
  place(r, P_FINAL * GRIP_P, JAWS_P, OPEN_P_S)
  r:move_line(above(P_FINAL * GRIP_P, 0.15), LIFT)
  r:move_to(HOME_1, SWING)
end)

routine("Robot2", function(r)
  -- the assembly to Table1
  pick(r, B_START * GRIP_B, 0.20, JAWS_B, CLOSE_ON_B_S)
  r:move_line(above(B_START * GRIP_B, 0.10), LIFT)
  r:move_to(above(B_FINAL * GRIP_B, 0.10), LONG_SWING)
  place(r, B_FINAL * GRIP_B, JAWS_B, OPEN_B_S)
  r:move_line(above(B_FINAL * GRIP_B, 0.20), LIFT)
  r:move_to(HOME_2, SWING)
  signal("the assembly is on Table1, Robot2 is away")

  -- C out of B; held still above it until P is out of O
  local c_seat = B_FINAL * C_IN_B * GRIP_C
  r:wait_signal("O is out of B, Robot1 is away")
  pick(r, c_seat, 0.15, JAWS_C, CLOSE_ON_C_S)
  r:move_line(above(c_seat, 0.13), SLIDE)
  r:wait_until(CARRY_C_S)
  r:move_line(above(C_FINAL * GRIP_C, 0.15), CARRY)
  place(r, C_FINAL * GRIP_C, JAWS_C, OPEN_C_S)
  r:move_line(above(C_FINAL * GRIP_C, 0.15), LIFT)
  r:move_to(HOME_2, SWING)
end)
