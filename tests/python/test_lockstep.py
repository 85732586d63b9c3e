"""Python drives a cell over DDS in lockstep: the same bits as the same motion in one process (takt-run)."""

import json
import subprocess

import takt

PERIOD_S = 0.008
PERIODS = 250

# The motion as a robot program, for takt-run; below the same from Python.
PROGRAM = """
period_s = 0.008
routine("Robot1", function(r)
  local start = r.joints
  for k = 1, 250 do
    local u = k / 250
    local q = {}
    for j = 1, #start do q[j] = start[j] end
    q[6] = start[6] + 3.2 * u * u * (1 - u) * (1 - u)
    q[4] = start[4] - 0.8 * u * u * (1 - u) * (1 - u)
    if k == 26 then r.gripper:close() end
    if k == 151 then r.gripper:width(0.1) end
    r:move_joints(q, {duration_s = period_s, speed = 1, acceleration_rad_per_s2 = 1e9})
  end
end)
"""


def in_process(scenario, program, folder, duration_s):
    report = folder / "report.json"
    subprocess.run(
        [takt.program_path("takt-run"), "run", scenario, "--program", program, "--duration", str(duration_s), "--quiet",
         "--report", report],
        check=True,
    )
    return json.loads(report.read_text())


def drive(cell):
    """The motion of PROGRAM; returns the instant at its end."""
    with cell.lockstep(["Robot1", "Gripper1"], PERIOD_S) as controller:
        start = controller.state.robot("Robot1").position
        force = cell.info.grippers["Gripper1"].max_force
        for k in range(1, PERIODS + 1):
            u = k / PERIODS
            target = list(start)
            target[5] = start[5] + 3.2 * u * u * (1 - u) * (1 - u)
            target[3] = start[3] - 0.8 * u * u * (1 - u) * (1 - u)
            if k == 26:
                controller.grip("Gripper1", takt.GripperAction.close, max_force_N=force)
            if k == 151:
                controller.grip("Gripper1", takt.GripperAction.width, width_m=0.1, max_force_N=force)
            controller.move("Robot1", target)
            controller.advance()
        return controller.state


def test_same_hash_as_in_process(config, tmp_path):
    scenario = config / "scenarios" / "block_assembly.yaml"
    program = tmp_path / "motion.lua"
    program.write_text(PROGRAM)
    expected = in_process(scenario, program, tmp_path, PERIODS * PERIOD_S)
    with takt.Server(scenario) as server, server.client() as cell:
        end = drive(cell)
        assert end.step == 2000
        assert end.state_hash == int(expected["state_hash"], 16)
        # Once more from the beginning, through the same connection.
        cell.reset()
        assert cell.state.step == 0
        assert drive(cell).state_hash == end.state_hash


def test_another_motion_has_another_hash(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as server, server.client() as cell:
        first = drive(cell)
        cell.reset()
        with cell.lockstep(["Robot1"], PERIOD_S) as controller:
            while controller.state.step < 2000:
                state = controller.advance()
        assert state.state_hash != first.state_hash


def test_whole_assembly_by_its_controller_program(config, tmp_path):
    """The programs a user starts, checked from Python: the holders of the Parts on the way, and the bits at the end."""
    scenario = config / "scenarios" / "block_assembly.yaml"
    program = config / "programs" / "block_assembly.lua"
    expected = in_process(scenario, program, tmp_path, 12)
    # The cell pauses at the end: a client that looks late gets the newest instant, not each of them.
    with takt.Server(scenario, overrides=["duration_s=12"], options=["--pause-at-end"]) as server, \
            server.client() as cell:
        command = [takt.program_path("takt-controller"), program, "--pace", "lockstep", "--start", "--timeout", "60"]
        with subprocess.Popen(command, env=server.environment) as controller:
            held = cell.wait_for_state(lambda s: s.partner_of("P") == "Gripper1", timeout=240)
            assert held is not None and held.time >= 3.8
            end = cell.wait_for_state(lambda s: s.step >= 12000, timeout=240)
            controller.terminate()
        assert end is not None and end.step == 12000
        assert end.state_hash == int(expected["state_hash"], 16)


def test_torques_move_a_robot_until_its_next_motion(config):
    """Without them it floats: its weight is carried."""
    with takt.Server(config / "scenarios" / "block_assembly.yaml", level_of_detail=2) as server, server.client() as cell:
        with cell.lockstep(["Robot1"], PERIOD_S) as controller:
            start = list(controller.state.robot("Robot1").position)

            def way(periods):
                for _ in range(periods):
                    controller.advance()
                return [now - before for now, before in zip(controller.state.robot("Robot1").position, start)]

            controller.apply_torques("Robot1", [0.0] * 6)
            assert max(map(abs, way(25))) < 1e-6
            controller.apply_torques("Robot1", [50.0, 0.0, 0.0, 0.0, 0.0, 0.0])
            moved = way(25)
            assert moved[0] > 0.01
            controller.move("Robot1", list(controller.state.robot("Robot1").position))
            way(125)
            assert max(map(abs, controller.state.robot("Robot1").velocity)) < 1e-3
            assert way(25)[0] - moved[0] < 0.1


def test_efforts_stand_until_the_next_motion(config):
    """At level of detail 2 they are added to what the drives do: 100 N m push the shoulder forward."""
    with takt.Server(config / "scenarios" / "block_assembly.yaml", level_of_detail=2) as server, server.client() as cell:
        def hold(efforts, every_period):
            with cell.lockstep(["Robot1"], PERIOD_S) as controller:
                robot = controller.state.robot("Robot1")
                place = list(robot.position)
                for k in range(12):
                    if k == 0 or every_period:
                        controller.move("Robot1", place, efforts=efforts)
                    controller.advance()
                end = controller.state
            cell.reset()
            return end.robot("Robot1").position[0] - place[0], end.state_hash

        pushed = [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        without, with_them = hold([], False), hold(pushed, False)
        assert with_them[0] - without[0] > 1e-5
        assert hold(pushed, True) == with_them
        assert hold([], True) == without
