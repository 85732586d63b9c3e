-- Takes the rotor of an electric motor apart (config/scenarios/bev_rotor.yaml): screws removed at 15 s, a cold core in
-- furnace 1 at 35 s, a hot one from furnace 3 in the press at 56 s, the magnet pressed out from 66 to 71 s, the cover
-- removed at 82 s.
--
-- Lengths in m, angles in rad, times in s of simulated time; see docs/controller_programs.md.

period_s = 0.008

local function down(x, y, z) return pose{x = x, y = y, z = z, roll = math.pi} end

-- Cores are gripped 150 mm above their lower face, screws at their heads.
local function core(x, y, z) return down(x, y, z + 0.15) end
local CORE_2, STAND_1 = core(-1.10, 0, 0.7), core(-0.217, 1.231, 0.4)
local STAND_3, MOUNT = core(1.25, 0, 0.4), core(0.85, -0.85, 0.6)
local COVER, COVER_AWAY = down(-0.05, -1.15, 0.902), down(0.30, -1.15, 0.702)
local SCREWS = {{down(-0.102, -1.15, 0.910), down(-0.30, -1.35, 0.726)},
                {down(0.002, -1.15, 0.910), down(-0.25, -1.35, 0.726)}}
-- 12.5 turns of 1 mm each, at 10 turns per second; the tool goes up with the screw.
local DRIVER, DRIVER_SPEED, UNSCREW = device("Screwdriver"), 20 * math.pi, 0.0125

local SWING = {speed = 0.6, acceleration_rad_per_s2 = 2.0}
local LINE = {speed_m_per_s = 0.4, acceleration_m_per_s2 = 1.0}
local FAST = {speed = 0.8, acceleration_rad_per_s2 = 6.0}
local SHORT = {speed_m_per_s = 0.4, acceleration_m_per_s2 = 2.0}

-- Carries a part from one place to another, with a clearance above each; releases it at the given time, jaws this wide.
local function carry(r, from, above_from, to, above_to, lower_s, wide)
  r.gripper:width(wide)
  r:move_to(from:offset(0, 0, above_from), SWING)
  r:move_line(from, LINE)
  r.gripper:close()
  r:wait(0.4)
  r:move_line(from:offset(0, 0, above_from), LINE)
  r:move_to(to:offset(0, 0, above_to), SWING)
  if lower_s then r:wait_until(lower_s) end
  r:move_line(to, LINE)
  r.gripper:width(wide)
  r:wait(0.4)
  r:move_line(to:offset(0, 0, above_to), LINE)
end

routine("Robot2", function(r)
  for i, places in ipairs(SCREWS) do
    r:step("screw " .. i)
    local from, to = places[1], places[2]
    r.gripper:width(0.030)
    r:move_to(from:offset(0, 0, 0.08), FAST)
    r:move_line(from, SHORT)
    DRIVER:set{speed = DRIVER_SPEED}
    r:move_line(from:offset(0, 0, UNSCREW), {duration_s = 1.3})
    DRIVER:set{speed = 0}
    r.gripper:close()
    r:wait(0.25)
    r:move_line(from:offset(0, 0, 0.10), SHORT)
    r:move_to(to:offset(0, 0, 0.25), FAST)
    r:move_line(to, SHORT)
    r.gripper:width(0.030)
    r:wait(0.25)
    r:move_line(to:offset(0, 0, 0.25), SHORT)
  end
  print("screws removed")
end)

routine("Robot1", function(r)
  r:step("wait for the screws")
  r:wait_until(16)
  r:step("core 2 into furnace 1")
  carry(r, CORE_2, 0.25, STAND_1, 0.55, 32.6, 0.24)
  print("core 2 in furnace 1")
  r:step("core 4 into the press")
  carry(r, STAND_3, 0.55, MOUNT, 0.22, 53.6, 0.24)
  print("core 4 in the press")
  signal("core in the press")
  r:step("cover away")
  r:move_to(COVER:offset(0, 0, 0.2), SWING)
  r:wait_until(76)
  carry(r, COVER, 0.2, COVER_AWAY, 0.3, nil, 0.17)
  print("cover removed")
end)

-- The ram: the tool's tip is 280 mm below its frame, which begins at 1.38 m; the magnet's upper face is at 0.685 m.
routine("Press", function(r)
  r:step("wait for the core")
  r:wait_signal("core in the press")
  r:wait_until(60)
  r:step("down to the magnet")
  r:move_joints({0.38}, {speed = 0.5, acceleration_rad_per_s2 = 0.5})
  r:wait_until(65)
  r:move_joints({0.413}, {duration_s = 1})
  r:wait_until(66)
  r:step("press the magnet out")
  r:move_joints({0.517}, {duration_s = 5})
  print("magnet pressed out")
  r:wait(0.5)
  r:step("up")
  r:move_joints({0}, {speed = 0.5, acceleration_rad_per_s2 = 0.5})
end)
