-- The robot of a packing line (config/scenarios/line.yaml): takes each box from the clamp at the stop and lays it onto the
-- outfeed belt, for as long as the cell runs. Belts, pusher and feeder follow their own signals.
--
-- Lengths in m, angles in rad; see docs/controller_programs.md.

period_s = 0.008

-- Pad tips 5 mm above the lower face of a box; tool pointing down, jaws along y.
local GRIP = pose{z = 0.005, roll = math.pi}
local BELT = pose{z = 0.25}
local PICK = BELT * pose{x = 0.1} * GRIP
local PLACE = BELT * pose{x = 0.55} * GRIP
local ABOVE = 0.12
local FAST = {speed_m_per_s = 0.9, acceleration_m_per_s2 = 4.0}
local CAREFUL = {speed_m_per_s = 0.3, acceleration_m_per_s2 = 1.5}

local clamp = device("Clamp")

local function reads(signal, name)
  return function(cell) return cell.devices[signal].signals[name] > 0.5 end
end

routine("Robot", function(r)
  r.gripper:open()
  r:move_to(PICK:offset(0, 0, ABOVE))
  while true do
    r:step("clamp the box at the stop")
    r:wait_for(reads("AtStop", "blocked"))
    clamp:set{close = 1}
    r:wait_for(reads("Clamp", "holding"), 2)

    r:step("take it")
    r:move_line(PICK, CAREFUL)
    r:wait(0.1)
    clamp:set{close = 0}
    r:wait_for(reads("Clamp", "opened"), 2)
    r.gripper:close()
    r:wait_for(reads("Gripped", "part_present"), 2)
    r:move_line(PICK:offset(0, 0, ABOVE), CAREFUL)

    r:step("lay it onto the outfeed belt")
    r:move_line(PLACE:offset(0, 0, ABOVE), FAST)
    r:move_line(PLACE, CAREFUL)
    r:wait(0.1)
    r.gripper:open()
    r:wait_for(function(cell) return not cell.grippers.Gripper.moving end, 2)
    r:move_line(PLACE:offset(0, 0, ABOVE), CAREFUL)
    r:move_line(PICK:offset(0, 0, ABOVE), FAST)
  end
end)
