-- Block assembly by two robots (config/scenarios/block_assembly.yaml).
--
--   Robot1 puts P into O while Robot2 brings C above B and then into it. Robot1 puts O, with P in it, into B. Robot2
--   carries the whole assembly to Table2.
--
-- Lengths in m, angles in rad, times in s of simulated time. Part frames lie at the centre of the bottom face, z up.
-- The calls of programs are described in docs/controller_programs.md.

period_s = 0.008

-- When the grippers act.
local CLOSE_ON_P_S, OPEN_P_S = 3.8, 9.9
local CLOSE_ON_C_S, LOWER_C_S, OPEN_C_S = 4.9, 9.9, 11.0
local CLOSE_ON_O_S, LOWER_O_S, OPEN_O_S = 16.0, 20.6, 22.8
local CLOSE_ON_B_S, OPEN_B_S = 31.2, 38.2

-- Where the parts lie at the start, and where they belong.
local B_START = pose{x = 0.10, y = -0.05, z = 0.7}
local C_START = pose{x = 0.30, y = -0.20, z = 0.7}
local O_START = pose{x = -0.22, y = -0.05, z = 0.7}
local P_START = pose{x = -0.22, y = 0.20, z = 0.7}
local C_IN_B = pose{x = -0.060, z = 0.020}
local O_IN_B = pose{x = 0.040, z = 0.020}
local P_IN_O = pose{x = 0.015, z = 0.030}
local B_FINAL = pose{x = 1.15, y = 0.0, z = 0.7, yaw = math.pi / 2}

-- The tool centre point in the part's frame when gripping: pad tips at this height, tool pointing down, jaws along y.
local function grip(height) return pose{z = height, roll = math.pi} end
local GRIP_B, GRIP_C, GRIP_O, GRIP_P = grip(0.015), grip(0.045), grip(0.045), grip(0.054)

-- Jaws stand open 30 mm wider than the part.
local JAWS_B, JAWS_C, JAWS_O, JAWS_P = 0.150, 0.110, 0.110, 0.060
local JAW_TIME_S = 0.4

-- Where the robots wait, tool pointing down.
local HOME_1 = pose{x = -0.30, y = 0.10, z = 1.05, roll = math.pi}
local HOME_2 = pose{x = 0.55, y = -0.15, z = 1.10, roll = math.pi}
local END_2 = pose{x = 0.85, y = -0.15, z = 1.10, roll = math.pi, yaw = math.pi / 2}

-- Ways of moving.
local SWING = {speed = 0.35, acceleration_rad_per_s2 = 1.5}
local LONG_SWING = {duration_s = 3.2}
local LIFT = {speed_m_per_s = 0.25, acceleration_m_per_s2 = 1.0}
local CARRY = {speed_m_per_s = 0.3, acceleration_m_per_s2 = 0.8}
local INSERT = {speed_m_per_s = 0.12, acceleration_m_per_s2 = 0.5}

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

-- Puts the part down onto its seat, and opens at the given time.
local function place(r, target, jaws, open_s)
  r:move_line(target, INSERT)
  r:wait_until(open_s)
  r.gripper:width(jaws)
  r:wait(JAW_TIME_S)
end

routine("Robot1", function(r)
  r:step("P into O")
  local p_seat = O_START * P_IN_O * GRIP_P
  pick(r, P_START * GRIP_P, 0.12, JAWS_P, CLOSE_ON_P_S)
  r:move_line(above(P_START * GRIP_P, 0.15), LIFT)
  r:move_line(above(p_seat, 0.12), CARRY)
  place(r, p_seat, JAWS_P, OPEN_P_S)
  r:move_line(above(p_seat, 0.12), LIFT)

  r:step("O, with P in it, into B")
  local o_seat = B_START * O_IN_B * GRIP_O
  pick(r, O_START * GRIP_O, 0.16, JAWS_O, CLOSE_ON_O_S)
  r:move_line(above(O_START * GRIP_O, 0.16), LIFT)
  r:wait_signal("C is in B, Robot2 is away")
  r:move_line(above(o_seat, 0.14), CARRY)
  r:wait_until(LOWER_O_S)
  place(r, o_seat, JAWS_O, OPEN_O_S)
  r:move_line(above(o_seat, 0.16), LIFT)
  r:move_to(HOME_1, SWING)
  signal("O is in B, Robot1 is away")
end)

routine("Robot2", function(r)
  r:step("C into B")                       -- while P already stands in O
  local c_seat = B_START * C_IN_B * GRIP_C
  pick(r, C_START * GRIP_C, 0.12, JAWS_C, CLOSE_ON_C_S)
  r:move_line(above(C_START * GRIP_C, 0.15), LIFT)
  r:move_line(above(c_seat, 0.13), CARRY)
  r:move_line(above(c_seat, 0.06), LIFT)
  r:wait_until(LOWER_C_S)
  place(r, c_seat, JAWS_C, OPEN_C_S)
  r:move_line(above(c_seat, 0.15), LIFT)
  r:move_to(HOME_2, SWING)
  signal("C is in B, Robot2 is away")

  r:step("wait for O")
  r:wait_signal("O is in B, Robot1 is away")
  r:step("assembly to Table2")
  pick(r, B_START * GRIP_B, 0.20, JAWS_B, CLOSE_ON_B_S)
  r:move_line(above(B_START * GRIP_B, 0.10), LIFT)
  r:move_to(above(B_FINAL * GRIP_B, 0.10), LONG_SWING)
  place(r, B_FINAL * GRIP_B, JAWS_B, OPEN_B_S)
  r:move_line(above(B_FINAL * GRIP_B, 0.20), LIFT)
  r:move_to(END_2, SWING)
end)
