"""takt-ur against clients of Universal Robots' interfaces: RTDE, external control, primary, dashboard, Robotiq's URCap."""

import os
import pathlib
import socket
import struct
import subprocess
import sys

import pytest

from takt.server import program_path
from ur_clients import (  # noqa: F401  (fixtures)
    Driver,
    Gateway,
    KEY_MESSAGE,
    MAPPING,
    nearest_on_the_way,
    opened,
    PATIENCE_S,
    primary_messages,
    read,
    robot,
    ROBOT_STATE,
    RobotiqClient,
    Rtde,
    SCALE,
    second,
    VERSION,
)


def test_outputs_and_inputs_are_gripper_and_state(robot, opened):
    cell, ports, _ = robot
    client = Rtde(opened, ports[0])
    state = client.wait(lambda s: True)
    assert state["timestamp"] >= 40.0
    assert list(state["actual_q"]) == pytest.approx(list(cell.state.robot("Robot1").position), abs=1e-6)
    client.send("U", bytes([1, 1, 1]))
    client.wait(lambda s: s["actual_digital_input_bits"] & 1)
    assert cell.wait_for_state(lambda s: s.gripper("Gripper1").closed, timeout=PATIENCE_S)
    client.send("U", bytes([1, 1, 0]))
    client.wait(lambda s: not s["actual_digital_input_bits"] & 1)


def test_the_weight_of_a_part_is_the_force_at_the_tcp(robot, opened):
    cell, ports, _ = robot
    client = Rtde(opened, ports[0])
    assert max(abs(f) for f in client.wait(lambda s: True)["actual_TCP_force"]) < 1e-9
    cell.attach("P", "Gripper1")
    weight = 0.3 * 9.80665  # mass_kg of the scenario
    state = client.wait(lambda s: abs(s["actual_TCP_force"][2] + weight) < 1e-6)
    cell.detach("P")
    force, torque = state["actual_TCP_force"][:3], state["actual_TCP_force"][3:]
    assert force[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
    # The Part's centre of mass and the TCP, in the robot's base, whose axes are those of the world.
    part, described = cell.state.component("P"), cell.info.components["P"]
    lever = [p + c - b - t for p, c, b, t in zip(part.position, described.center_of_mass, (-0.75, 0.0, 0.7),
                                                 state["actual_TCP_pose"])]
    assert list(torque) == pytest.approx([-lever[1] * weight, lever[0] * weight, 0.0], abs=1e-3)


def test_servo_set_points_move_the_robot_and_silence_ends_the_program(robot, opened):
    cell, ports, _ = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    begin = state = client.wait(lambda s: s["runtime_state"] == 2)
    q = list(begin["actual_q"])
    end = q[5] + 0.2
    while q[5] < end:
        q[5] = min(end, q[5] + 0.001)
        driver.command(1, q, timeout_ms=1000)
        client.wait(lambda s: True)
    repeats = 0
    # The same set-point again, until the robot stands (a missing one is extrapolated), and longer than the time limit.
    while repeats < 20 or state["timestamp"] < begin["timestamp"] + 1.5:
        driver.command(1, q, timeout_ms=1000)
        state = client.wait(lambda s: True)
        repeats = repeats + 1 if abs(state["target_q"][5] - end) < 1e-6 else 0
    driver.command(1, q, timeout_ms=200)
    client.wait(lambda s: s["runtime_state"] == 1)  # no command for 200 ms
    state = client.wait(lambda s: abs(s["actual_q"][5] - s["target_q"][5]) < 1e-6)
    assert state["actual_q"][5] == pytest.approx(end, abs=1e-3)
    assert driver.sockets["reverse_socket"].recv(1) == b"", "the program closes its sockets"
    end = state["actual_q"][5]
    assert cell.wait_for_state(lambda s: abs(s.robot("Robot1").position[5] - end) < 1e-3, timeout=PATIENCE_S)


def test_servo_control_goes_on_after_a_pause_of_the_cell(robot, opened):
    cell, ports, _ = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = list(client.wait(lambda s: s["runtime_state"] == 2)["actual_q"])
    driver.command(1, q)
    client.wait(lambda s: True)
    cell.pause()
    for _ in range(1500):  # takt-ur looks once a second whether the cell plays
        client.wait(lambda s: True)
    cell.play()
    end = q[5] + 0.02

    def follows(state):
        driver.command(1, [*q[:5], end])
        return abs(state["actual_q"][5] - end) < 1e-4

    client.wait(follows)


def test_trajectories_end_with_success_and_cancelled_ones_say_so(robot, opened):
    _, ports, _ = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = list(client.wait(lambda s: s["runtime_state"] == 2)["actual_q"])
    away = q[:5] + [q[5] - 0.3]
    assert driver.trajectory([(away, 0.5), (q, 0.5)]) == 0
    client.wait(lambda s: abs(s["actual_q"][5] - q[5]) < 1e-4)
    driver.command(3, (1, 1, 0, 0, 0, 0), scale=1)
    numbers = [round(SCALE * value) for value in away] + [0] * 12 + [round(SCALE * 20.0), 0, 0]
    driver.sockets["trajectory_socket"].sendall(struct.pack(">21i", *numbers))
    client.wait(lambda s: abs(s["target_q"][5] - q[5]) > 1e-4)
    driver.command(3, (-1, 0, 0, 0, 0, 0), scale=1)
    assert driver.result() == 1
    driver.command(-2)
    client.wait(lambda s: s["runtime_state"] == 1)


def test_torque_mode_needs_its_version_and_drives(robot, opened):
    _, ports, gateway = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = client.wait(lambda s: s["runtime_state"] == 2)["actual_q"]
    driver.command(8, (1.0,) * 6)
    gateway.wait_for_line("only supported from software 5.23.0")
    driver.command(-2)
    assert client.wait(lambda s: s["runtime_state"] == 1)["actual_q"] == pytest.approx(q, abs=1e-3)
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(b"def t():\n  direct_torque([1, 0, 0, 0, 0, 0])\nend\n")
    gateway.wait_for_line("direct_torque", "no drives at level of detail 1")


def test_a_blend_goes_past_its_point(robot, opened):
    _, ports, gateway = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = list(client.wait(lambda s: s["runtime_state"] == 2)["target_q"])
    via = q[:4] + [q[4] + 0.3, q[5]]
    end = via[:3] + [via[3] + 0.4, *via[4:]]
    for target, radius, passes in ((end, 0.0, False), (q, 0.02, True), (end, 5.0, False)):
        driver.send_trajectory([(via, 1.0), (target, 1.0)], radius)
        nearest = nearest_on_the_way(client, via, target)
        assert driver.result() == 0
        assert (nearest > 1e-3) == passes, (radius, nearest)
    gateway.wait_for_line("Overlapping Blends")
    driver.close()
    client.wait(lambda s: s["runtime_state"] == 1)
    with socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S) as primary:
        primary.sendall(f"def blend():\n  movej({via}, t=1, r=0.02)\n  set_standard_digital_out(1, True)\n"
                        f"  movej({q}, t=1)\nend\n".encode())
        assert nearest_on_the_way(client, via, q) > 1e-3
    client.wait(lambda s: s["runtime_state"] == 1)


def test_another_robot_follows_the_controller(robot, opened, tmp_path):
    cell, ports, gateway = robot
    mapping = tmp_path / "follow.yaml"
    mapping.write_text(f"takt_ur: 1\nrobot: Robot2\nlisten: {{rtde: {ports[0]}}}\n"
                       "follow: {first_command: {ramp_speed_rad_per_s: 2}}\n")
    follower = opened(Gateway(gateway.server, mapping, "follow", "--address", "127.0.0.1", ready="follows the controller"))
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = list(client.wait(lambda s: s["runtime_state"] == 2)["actual_q"])
    assert driver.trajectory([(q[:4] + [q[4] + 0.2] + q[5:], 0.5)]) == 0
    end = client.wait(lambda s: abs(s["actual_q"][4] - q[4] - 0.2) < 1e-4)["actual_q"]
    end = pytest.approx(list(end), abs=1e-3)
    assert cell.wait_for_state(lambda s: list(s.robot("Robot2").position) == end, timeout=PATIENCE_S)


def test_a_hostile_client_is_closed_and_the_robot_stays(robot, opened):
    cell, ports, _ = robot
    before = list(cell.state.robot("Robot1").position)
    for port in ports:
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as hostile:
            hostile.sendall(b"\xff\xff\x00\x00GET / HTTP/1.1\r\n\r\n" * 50)
    attacked = cell.state.step
    Rtde(opened, ports[0]).wait(lambda s: True)
    after = cell.wait_for_state(lambda s: s.step > attacked, timeout=PATIENCE_S)
    assert list(after.robot("Robot1").position) == before


def test_an_error_of_the_mapping_names_file_line_key_and_what_is_allowed(robot, tmp_path):
    _, ports, gateway = robot
    wrong = tmp_path / "wrong.yaml"
    for text, expected in (("takt_ur: 1\nrobot: Robot9\n", ("wrong.yaml:2", "robot", "Robot9", "Robot1")),
                           (MAPPING.format(*ports).replace("standard_digital_output_0", "digital_output_0"),
                            ("wrong.yaml:6", "digital_output_0", "standard_digital_output_0..7")),
                           (MAPPING.format(*ports) + "speed: 1\n", ("speed",))):
        wrong.write_text(text)
        run = subprocess.run([program_path("takt-ur"), str(wrong)], env=gateway.environment, capture_output=True,
                             text=True, timeout=PATIENCE_S)
        assert run.returncode == 1, run.stdout
        for word in expected:
            assert word in run.stderr, run.stderr


def test_the_secondary_interface_has_states_and_the_version_alone(robot, opened):
    # Primary/Secondary Interface guide: "30002 (Only robot state and the Version messages)".
    _, ports, _ = robot
    primary, secondary = (opened(socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)) for port in ports[1:3])
    primary_messages(primary, lambda m: m == ROBOT_STATE)
    assert primary_messages(secondary, lambda m: m == ROBOT_STATE)[0] == VERSION
    secondary.sendall(b"def a():\n  sleep(0.5)\n  stopj(2)\nend\n")
    assert primary_messages(primary, lambda m: m == KEY_MESSAGE)
    states = [m for _ in range(10) for m in primary_messages(secondary, lambda m: True)]
    assert states == [ROBOT_STATE] * 10


def test_a_flight_report_has_the_log_and_the_values(robot, second, tmp_path):
    connect, _ = second
    dashboard, primary = connect(29999).makefile("rw"), connect(30001)
    assert dashboard.readline() == "Connected: Universal Robots Dashboard Server\n"

    def ask(command):
        dashboard.write(command + "\n")
        dashboard.flush()
        return dashboard.readline().rstrip("\n")

    def report():
        start, _, name = ask("generate flight report controller").partition(": ")
        assert (start, pathlib.Path(name).parent) == ("Flight Report generated with id", tmp_path)
        return pathlib.Path(name).read_text()

    def report_in_mode(command, mode):
        ask(command)
        while ask("robotmode") != "Robotmode: " + mode:
            pass
        return report()

    primary.sendall(b"def a():\n  write_output_float_register(3, 2.5)\n  textmsg(\"of the report\")\nend\n")
    for _ in ("started", "stopped"):
        primary_messages(primary, lambda m: m == KEY_MESSAGE)
    first = report()
    assert " s of the report\n" in first and "output_double_register_3 = 2.5\n" in first
    # RTDE guide, joint_mode: 253 running, 239 power off, 255 idle.
    assert "joint_mode = 253 253 253 253 253 253\n" in first
    assert "joint_mode = 239 239 239 239 239 239\n" in report_in_mode("power off", "POWER_OFF")
    assert "joint_mode = 255 255 255 255 255 255\n" in report_in_mode("power on", "IDLE")
    assert ask("generate support file /").startswith(f"Completed successfully: {tmp_path}/Robot2_")


def test_a_client_of_robotiqs_urcap_closes_and_opens_the_gripper(robot, second):
    cell, _, _ = robot
    connect, _ = second
    client = RobotiqClient(connect(63352))
    assert (client.get("STA"), client.get("FLT")) == (3, 0)
    for position in (255, 0, 100, 0):
        assert client.move(position) == (pytest.approx(position, abs=2), 3)
        width = cell.info.grippers["Gripper2"].max_width * (1 - position / 255)
        assert cell.wait_for_state(lambda s: abs(s.gripper("Gripper2").width - width) < 1e-3, timeout=PATIENCE_S)


def test_read_only_interfaces_have_the_states_and_take_no_programs(robot, second, opened):
    connect, address = second
    rtde = Rtde(opened, 30004, address)
    primary, secondary, realtime = connect(30011), connect(30012), connect(30013)
    for one in (primary, secondary, realtime):
        one.sendall(b"def a():\n  while True:\n    sleep(1)\n  end\nend\nset_standard_digital_out(0, True)\nmovej([0,0,0,0,0,0])\n")
    assert primary_messages(primary, lambda m: m == ROBOT_STATE)[0] == VERSION
    assert primary_messages(secondary, lambda m: m == ROBOT_STATE)[0] == VERSION
    assert struct.unpack(">i", read(realtime, 4))[0] == 1220
    assert {rtde.wait(lambda s: True)["runtime_state"] for _ in range(100)} == {1}


@pytest.mark.skipif("TAKT_RTDE_PYTHON" not in os.environ, reason="TAKT_RTDE_PYTHON: folder of the vendor's Python client")
def test_the_vendors_python_client_reads_and_writes(robot):
    _, ports, _ = robot
    sys.path.insert(0, os.environ["TAKT_RTDE_PYTHON"])
    import rtde.rtde as vendor

    client = vendor.RTDE("127.0.0.1", ports[0])
    client.connect()
    try:
        assert client.get_controller_version()[:2] == (5, 21)
        assert client.send_output_setup(["timestamp", "actual_digital_input_bits"], frequency=125)
        written = client.send_input_setup(["standard_digital_output_mask", "standard_digital_output"])
        assert client.send_start()
        written.standard_digital_output_mask = written.standard_digital_output = 1
        client.send(written)
        while not client.receive().actual_digital_input_bits & 1:
            pass
    finally:
        client.disconnect()
