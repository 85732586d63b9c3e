"""Functions of URScript in takt-ur against what UR's script manual (e-Series, PolyScope 5) says of them."""

import contextlib
import json
import math
import socket
import struct

import pytest

from ur_clients import ModbusDevice, opened, PATIENCE_S, read, robot, Rtde  # noqa: F401  (fixtures)

DIGITAL_OUTPUTS = 1044  # place in a package of the real-time interface (5.10 and later)


def lines_of(connection):
    """What a program sends, line by line, until it ends."""
    received = b""
    while part := connection.recv(4096):
        received += part
    return received.decode().splitlines()


class Peer:
    """A program's peer: runs programs whose socket "pc" is connected to it."""

    def __init__(self, opened, ports):
        self.opened = opened
        self.listener = opened(socket.create_server(("127.0.0.1", 0)))
        self.listener.settimeout(PATIENCE_S)
        self.primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))

    def run(self, body):
        """The connection of a program with these statements."""
        lines = "".join(f"  {line}\n" for line in body.splitlines())
        port = self.listener.getsockname()[1]
        self.primary.sendall(f'def a():\n  socket_open("127.0.0.1", {port}, "pc")\n{lines}  socket_close("pc")\nend\n'.encode())
        connection = self.opened(self.listener.accept()[0])
        connection.settimeout(PATIENCE_S)
        return connection

    def lines(self, body):
        """What such a program sends."""
        return lines_of(self.run(body))

    def values(self, *expressions):
        """Values of expressions of numbers, lists and poses."""
        return [[float(number) for number in line.strip("p[]").split(",")]
                for line in self.lines("\n".join(f'socket_send_line({one}, "pc")' for one in expressions))]


@pytest.fixture
def peer(robot, opened):
    return Peer(opened, robot[1])


def digital_outputs(opened, ports, wanted):
    """Reads the real-time interface until the digital outputs are these."""
    client = opened(socket.create_connection(("127.0.0.1", ports[3]), timeout=PATIENCE_S))
    while True:
        package = read(client, struct.unpack(">i", read(client, 4))[0] - 4)
        if struct.unpack(">d", package[DIGITAL_OUTPUTS - 4:][:8])[0] == wanted:
            return


def test_variables_of_sockets_and_strings_with_escapes(peer):
    connection = peer.run('x = socket_get_var("POS_X", "pc")\n'
                          'first = socket_read_string("pc", suffix="\\r\\n", interpret_escape=True)\n'
                          'second = socket_read_string("pc", prefix="\\t", suffix="\\n", interpret_escape=True)\n'
                          'if socket_send_line([x, str_len(first), str_len(second)], "pc"):\n'
                          '  sent = socket_send_string("", "nowhere")\n'
                          '  socket_send_line(sent, "pc")\n'
                          'end')
    assert read(connection, 10) == b"GET POS_X\n"
    connection.sendall(b"POS_X 7\none\r\n\tthree\n")
    expected = b"[7, 3, 5]\nFalse\n"
    assert read(connection, len(expected)) == expected


def test_digital_outputs_8_and_9_are_of_the_tool(robot, opened, peer):
    _, ports, _ = robot
    assert peer.lines('set_digital_out(8, True)\ndigital_out[9] = True\nset_digital_out(1, True)\n'
                      'socket_send_line([get_tool_digital_out(0), get_digital_out(9), get_digital_out(2)], "pc")') == [
                          "[True, True, False]"]
    digital_outputs(opened, ports, 1 << 16 | 1 << 17 | 1 << 1)
    peer.lines("set_tool_digital_out(0, False)\nset_digital_out(9, False)\nset_digital_out(1, False)")
    digital_outputs(opened, ports, 0)


def test_modbus_signals_of_several_registers_and_coils_are_written_again_and_again(peer, opened):
    device = ModbusDevice(opened)
    device.registers[4].update({20: 1, 21: 2, 22: 65535})
    place = f'"127.0.0.1:{device.port}", 9'
    connection = peer.run(f"""modbus_add_signal({place}, 20, 2, "three", False, 3)
modbus_add_signal({place}, 30, 16, "out", False, 3)
modbus_add_signal({place}, 40, 15, "coils", register_count=3)
modbus_add_signal({place}, 50, 3, "single")
modbus_set_output_register("out", [7, 8, 9])
modbus_set_output_register("out", [5])
modbus_set_output_signal("coils", [True, False, True])
modbus_set_output_register("single", 4)
modbus_request_update_signal_value("three")
while modbus_get_error("three") != 0:
  sync()
end
socket_read_string("pc", timeout=0)
socket_send_line(modbus_get_signal_status("three"), "pc")
socket_send_line(modbus_get_time_since_signal_invalid("three"), "pc")
""" + "\n".join(f'modbus_delete_signal("{name}")' for name in ("three", "out", "coils", "single")))

    def functions():
        return [(pdu[0], struct.unpack(">H", pdu[1:3])[0]) for _, pdu in device.requests]

    device.wait(lambda: min(functions().count(one) for one in ((6, 50), (16, 30), (15, 40))) >= 3)
    connection.sendall(b"enough")
    read_values, time_s = lines_of(connection)
    assert (read_values, float(time_s)) == ("[1, 2, 65535]", 0.0)
    assert [device.registers[3][i] for i in (30, 31, 32, 50)] == [5, 8, 9, 4]
    assert [device.bits[1][i] for i in (40, 41, 42)] == [1, 0, 1]
    assert {function for function, address in functions() if address == 50} <= {3, 6}


def test_flags_outlast_their_program(peer):
    assert peer.lines('set_flag(31, True)\nset_flag(3, True)\nset_flag(3, False)') == []
    assert peer.lines('socket_send_line([get_flag(31), get_flag(3), get_flag(0)], "pc")') == ["[True, False, False]"]
    peer.lines("set_flag(31, False)")


def test_outputs_of_rtde_are_read_by_name(peer):
    names = ("actual_q", "robot_mode", "joint_mode", "payload_cog", "output_bit_register_64")
    read_values = peer.lines("write_output_boolean_register(64, True)\n" +
                             "\n".join(f'socket_send_line(get_rtde_value("{name}"), "pc")' for name in names) +
                             '\nsocket_send_line(norm(get_actual_joint_positions()[0] - get_rtde_value(key="actual_q")[0]) < 1e-9, "pc")')
    assert len(json.loads(read_values[0])) == 6
    assert (read_values[1], json.loads(read_values[2]), len(json.loads(read_values[3]))) == ("7", [253] * 6, 3)
    assert read_values[4:] == ["True", "True"]


def test_commands_that_change_nothing_are_no_programs(peer):
    for command in ("set sim", "set real", "confirm user safety parameters"):
        peer.primary.sendall(command.encode() + b"\n")
    assert peer.lines('socket_send_line("runs", "pc")') == ["runs"]


def test_programs_of_grippers_and_panels_set_what_takt_has_not(peer):
    # The head of python-urx's program for a gripper, and functions of panels.
    assert peer.lines("set_analog_inputrange(0, 0)\nset_analog_outputdomain(0, 0)\nset_tool_voltage(0)\n"
                      "set_runstate_outputs([])\nposition_deviation_warning(True)\nhigh_holding_torque_disable()\n"
                      'reset_revolution_counter()\nsocket_send_line("runs", "pc")') == ["runs"]


def test_optimised_moves_end_at_their_goals(peer):
    q, pose = peer.values("get_target_joint_positions()", "get_target_tcp_pose()")
    away, raised = [*q[:5], q[5] + 0.4], [*pose[:2], pose[2] + 0.02, *pose[3:]]
    assert peer.lines(f"optimovej({away}, a=0.2, v=0.4)") == []
    assert peer.values("get_target_joint_positions()")[0] == pytest.approx(away, abs=2e-6)
    assert peer.lines(f"optimovej(p{pose}, 1, 1)\noptimovel(p{raised})") == []
    assert peer.values("get_target_tcp_pose()")[0] == pytest.approx(raised, abs=1e-5)
    assert peer.lines(f"optimovel(p{pose}, 1, 1)\noptimovej({q}, 1, 1)") == []
    assert peer.values("get_target_joint_positions()")[0] == pytest.approx(q, abs=2e-6)


def test_the_robot_is_steady_half_a_second_after_a_move(peer):
    q = peer.values("get_target_joint_positions()")[0]
    assert peer.lines(f'q = {q}\nq[5] = q[5] + 0.05\nmovej(q, t=0.3)\nsocket_send_line(is_steady(), "pc")\n'
                      'before = time()\nwhile not is_steady():\n  sync()\nend\nafter = time()\n'
                      'passed = after.sec - before.sec + (after.nanosec - before.nanosec) / 1000000000\n'
                      'socket_send_line(passed > 0.48 and passed < 0.55, "pc")\n'
                      f'movej({q}, t=0.3)') == ["False", "True"]


def test_forces_are_measured_about_the_flange_and_zero_with_a_payload(robot, opened, peer):
    cell, ports, _ = robot
    client = Rtde(opened, ports[0])
    with contextlib.ExitStack() as cleaning:
        cell.attach("P", "Gripper1")
        cleaning.callback(peer.lines, "zero_ftsensor()")
        cleaning.callback(cell.detach, "P")
        peer.lines("sleep(2)")  # the joints come to rest
        weight = 0.3 * 9.80665  # mass_kg of the scenario
        about_tcp = client.wait(lambda s: math.dist(s["actual_TCP_force"][:3], (0, 0, -weight)) < 1e-4)["actual_TCP_force"]
        wrench, tcp, flange = peer.values("get_tcp_force()", "get_actual_tcp_pose()", "get_actual_tool_flange_pose()")
        x, y, z = (a - b for a, b in zip(tcp[:3], flange[:3]))
        assert math.hypot(x, y, z) > 0.05
        fx, fy, fz = about_tcp[:3]
        expected = [t + lever for t, lever in zip(about_tcp[3:], (y * fz - z * fy, z * fx - x * fz, x * fy - y * fx))]
        assert wrench == pytest.approx([fx, fy, fz, *expected], abs=5e-3)
        peer.lines("set_payload(0.3)")
        wrench, center, offset = peer.values("get_tcp_force()", "get_target_payload_cog()", "get_tcp_offset()")
        assert max(abs(one) for one in wrench) < 0.01, "the force settles"
        assert center == pytest.approx(offset[:3], abs=1e-5)


def test_a_program_whose_sensor_is_not_written_is_paused(robot, opened, peer):
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    assert client.ask("I", b"external_force_torque") == b"\2VECTOR6D"
    package = bytes([2]) + struct.pack(">6d", *[0.0] * 6)
    client.send("U", package)
    written = {"runtime_state": 4}
    while written["runtime_state"] == 4:  # a machine on which this client is late for 100 ms pauses the program, too
        peer.run("ft_rtde_input_enable(True)\nwhile True:\n  sync()\nend")
        begin = client.wait(lambda s: client.send("U", package) or s["runtime_state"] == 2)["timestamp"]
        written = client.wait(
            lambda s: client.send("U", package) or s["timestamp"] > begin + 0.5 or s["runtime_state"] == 4)
    silent = client.wait(lambda s: s["runtime_state"] == 2)["timestamp"]
    assert client.wait(lambda s: s["runtime_state"] == 4)["timestamp"] - silent < 0.2
    gateway.wait_for_line("RTDE watchdog: external_force_torque is not written often enough. The program is paused.")
    peer.primary.sendall(b"stop program\nsec off():\n  ft_rtde_input_enable(False)\nend\n")
    client.wait(lambda s: s["runtime_state"] == 1)
    peer.lines("sync()")


def test_a_screw_is_followed_along_the_tool(peer):
    # Nothing resists: the tool goes along its z axis with the speed limit.
    q, begin, ahead = peer.values("get_target_joint_positions()", "get_actual_tcp_pose()",
                                  "pose_trans(get_actual_tcp_pose(), p[0, 0, 1, 0, 0, 0])")
    axis = [b - a for a, b in zip(begin[:3], ahead)]
    assert peer.lines("zero_ftsensor()\nscrew_driving(5, 0.02)\nsleep(1)\nend_screw_driving()\nsleep(0.2)") == []
    moved = [b - a for a, b in zip(begin[:3], peer.values("get_actual_tcp_pose()")[0])]
    along = sum(m * a for m, a in zip(moved, axis))
    assert 0.005 < along < 0.021
    assert math.dist(moved, [along * a for a in axis]) < 1e-4
    assert peer.lines('freedrive_mode(freeAxes=[1,0,0,0,0,0], feature="tool")\nend_freedrive_mode()\n'
                      'freedrive_mode_no_incorrect_payload_check()\nend_freedrive_mode()\n'
                      f'movej({q}, t=0.5)\nsocket_send_line("back", "pc")') == ["back"]


def test_a_blocking_popup_waits_until_the_dashboard_closes_it(robot, opened, peer):
    _, ports, gateway = robot
    connection = peer.run('popup("goes on")\npopup("Load a part", "Feeder", blocking=True)\nsocket_send_line("loaded", "pc")')
    gateway.wait_for_line("The program waits until a client of the dashboard sends close popup.")
    connection.settimeout(0.5)
    with pytest.raises(TimeoutError):
        connection.recv(1)
    connection.settimeout(PATIENCE_S)
    dashboard = opened(socket.create_connection(("127.0.0.1", ports[4]), timeout=PATIENCE_S))
    dashboard.sendall(b"close popup\n")
    assert read(connection, 7) == b"loaded\n"


def test_coriolis_torques_have_the_power_by_which_the_mass_matrix_changes(peer):
    # qd^T C = d/dt (qd^T M qd) / 2 at constant speeds, by a difference quotient.
    q, qd, h = [0.3, -1.1, 1.4, -0.7, -1.2, 0.4], [0.9, -0.7, 0.8, 1.1, -0.6, 0.5], 1e-2
    places = [[x + sign * h * v for x, v in zip(q, qd)] for sign in (-1, 1)]
    rows = peer.values("get_coriolis_and_centrifugal_torques(q={}, qd={})".format(q, qd),
                       *(f"[m[{i},0], m[{i},1], m[{i},2], m[{i},3], m[{i},4], m[{i},5]]".replace("m[", f"get_mass_matrix({at})[")
                         for at in places for i in range(6)))
    torques, before, after = rows[0], rows[1:7], rows[7:]
    for i in range(6):
        assert [row[i] for row in before] == pytest.approx(before[i], abs=1e-5), "symmetric"
    energy = [sum(qd[i] * m[i][j] * qd[j] for i in range(6) for j in range(6)) / 2 for m in (before, after)]
    assert sum(t * v for t, v in zip(torques, qd)) == pytest.approx((energy[1] - energy[0]) / (2 * h), rel=2e-3)
    # A payload of 2 kg at the flange adds its mass times squared distances.
    peer.lines("set_target_payload(0, [0,0,0])")
    added = peer.values(f"get_mass_matrix({q})[0,0]", f"get_jacobian({q}, tcp=p[0,0,0,0,0,0])[0,0]",
                        f"get_jacobian({q}, tcp=p[0,0,0,0,0,0])[1,0]")
    peer.lines("set_target_payload(2, [0,0,0])")
    with_payload = peer.values(f"get_mass_matrix({q})[0,0]")
    peer.lines("set_target_payload(0, [0,0,0])")
    assert with_payload[0][0] - added[0][0] == pytest.approx(2 * (added[1][0]**2 + added[2][0]**2), abs=1e-4)


def turned(rotation, v):
    """A vector turned by a rotation vector (Rodrigues)."""
    angle = math.hypot(*rotation)
    x, y, z = (one / angle for one in rotation)
    along, across = x * v[0] + y * v[1] + z * v[2], (y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0])
    return [math.cos(angle) * one + math.sin(angle) * beside + (1 - math.cos(angle)) * along * axis
            for one, beside, axis in zip(v, across, (x, y, z))]


def test_the_payload_that_is_estimated_has_the_wrench_of_a_further_orientation(robot, peer):
    cell, _, _ = robot
    q = peer.values("get_target_joint_positions()")[0]
    turns = ([0, 0, 0], [0, 0.7, 0], [0.6, 0, 0.8], [-0.6, -0.6, 0], [0.3, 0.5, -0.5])
    places = [[*q[:3], *(a + b for a, b in zip(q[3:], turn))] for turn in turns]
    moves = "".join(f"movej({place}, t=1)\nsleep(1)\nw{i} = get_tcp_force()\n" for i, place in enumerate(places))
    with contextlib.ExitStack() as cleaning:
        cleaning.callback(peer.lines, f"movej({q}, t=1)\nzero_ftsensor()")
        cell.attach("P", "Gripper1")
        cleaning.callback(cell.detach, "P")
        (mass,), center, wrench, flange = [[float(one) for one in line.strip("[]p").split(",")] for line in peer.lines(
            f"{moves}found = estimate_payload({places[:4]}, [w0, w1, w2, w3])\n" + "\n".join(
                f'socket_send_line({one}, "pc")' for one in ("found.mass", "found.cog", "w4", "get_actual_tool_flange_pose()")))]
    assert mass == pytest.approx(0.3 * 9.80665 / 9.82, rel=2e-3)  # of the cell's gravity
    lever, weight = turned(flange[3:], center), 9.82 * mass
    assert wrench[:3] == pytest.approx([0, 0, -weight], abs=2e-3 * weight)
    assert wrench[3:] == pytest.approx([-lever[1] * weight, lever[0] * weight, 0], abs=2e-3 * weight)
