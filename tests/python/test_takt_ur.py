"""takt-ur against clients of Universal Robots' protocols: an RTDE client, and a driver with external control."""

import contextlib
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest

import takt
from takt.server import program_path

MAPPING = """takt_ur: 1
robot: Robot1
tool: Gripper1
listen: {{address: 127.0.0.1, rtde: {0}, primary: {1}, secondary: {2}, realtime: {3}, dashboard: {4}}}
outputs:
  standard_digital_output_0: {{gripper: Gripper1}}
inputs:
  standard_digital_input_0: {{gripper: Gripper1, is: closed}}
"""
PATIENCE_S = 120.0
SCALE = 1e6


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Gateway:
    def __init__(self, server, mapping, *arguments, ready="RTDE at"):
        self.environment = dict(os.environ, TAKT_CELL=server.cell, TAKT_DOMAIN=str(server.domain))
        self.process = subprocess.Popen([program_path("takt-ur"), *arguments, str(mapping), "--start"], env=self.environment,
                                        text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.lines = []
        self.over = False
        self.news = threading.Condition()
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()
        try:
            self.wait_for_line(ready)
            assert self.process.poll() is None, self.lines
        except BaseException:
            self.close()
            raise

    def read(self):
        for line in self.process.stdout:
            with self.news:
                self.lines.append(line)
                self.news.notify_all()
        with self.news:
            self.over = True
            self.news.notify_all()

    def wait_for_line(self, *words):
        """Until the program has said a line with all of these words."""
        def said():
            return any(all(word in line for word in words) for line in self.lines)

        with self.news:
            self.news.wait_for(lambda: said() or self.over, PATIENCE_S)
            assert said(), self.lines

    def close(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE_S)
        self.thread.join()


class Rtde:
    """RTDE protocol 2, as the vendor's guide describes it."""

    OUTPUTS = {"timestamp": "d", "actual_q": "6d", "target_q": "6d", "runtime_state": "I", "actual_digital_input_bits": "Q",
               "actual_TCP_pose": "6d", "actual_TCP_force": "6d"}
    TYPES = b"DOUBLE,VECTOR6D,VECTOR6D,UINT32,UINT64,VECTOR6D,VECTOR6D"

    def __init__(self, opened, port, address="127.0.0.1"):
        self.socket = opened(socket.create_connection((address, port), timeout=PATIENCE_S))
        self.buffer = b""
        assert self.ask("V", struct.pack(">H", 2)) == b"\1"
        assert self.ask("O", struct.pack(">d", 500.0) + ",".join(self.OUTPUTS).encode()) == b"\1" + self.TYPES
        assert self.ask("I", b"standard_digital_output_mask,standard_digital_output") == b"\1UINT8,UINT8"
        assert self.ask("S") == b"\1"

    def ask(self, kind, payload=b""):
        self.send(kind, payload)
        while True:
            found, content = self.next()
            if found == kind:
                return content

    def send(self, kind, payload):
        self.socket.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)

    def next(self):
        while len(self.buffer) < 3 or len(self.buffer) < struct.unpack(">H", self.buffer[:2])[0]:
            received = self.socket.recv(4096)
            assert received, "the controller has closed the connection"
            self.buffer += received
        size = struct.unpack(">H", self.buffer[:2])[0]
        package, self.buffer = self.buffer[:size], self.buffer[size:]
        return chr(package[2]), package[3:]

    def wait(self, condition):
        """The first state that fulfils the condition; the time limit of the socket and of the test's run ends it."""
        while True:
            kind, payload = self.next()
            if kind != "U":
                continue
            state, at = {}, 1
            for name, form in self.OUTPUTS.items():
                size = struct.calcsize(">" + form)
                values = struct.unpack(">" + form, payload[at:at + size])
                state[name], at = (values if len(values) > 1 else values[0]), at + size
            if condition(state):
                return state


class Driver:
    """A driver with external control: uploads the program that takt recognises, and owns its three sockets."""

    def __init__(self, opened, primary_port):
        self.listeners = {}
        lines = ["def externalControl():", "MULT_jointstate = 1000000", "MULT_time = 1000000",
                 'socket_send_int(TRAJECTORY_RESULT_CANCELED, "trajectory_socket")']
        for name in ("trajectory_socket", "script_command_socket", "reverse_socket"):
            listener = self.listeners[name] = opened(socket.create_server(("127.0.0.1", 0)))
            listener.settimeout(PATIENCE_S)
            lines.append(f'connect_socket_with_retry("127.0.0.1", {listener.getsockname()[1]}, "{name}")')
        lines += ["# NODE_CONTROL_LOOP_ENDS", "end", ""]
        self.primary = opened(socket.create_connection(("127.0.0.1", primary_port), timeout=PATIENCE_S))
        self.primary.sendall("\n".join(lines).encode())
        self.sockets = {name: opened(listener.accept()[0]) for name, listener in self.listeners.items()}
        for one in self.sockets.values():
            one.settimeout(PATIENCE_S)

    def command(self, mode, values=(0,) * 6, timeout_ms=0, scale=SCALE):
        numbers = [round(scale * value) for value in values]
        self.sockets["reverse_socket"].sendall(struct.pack(">8i", timeout_ms, *numbers, mode))

    def trajectory(self, points, blend_radius_m=0.0):
        self.send_trajectory(points, blend_radius_m)
        return self.result()

    def send_trajectory(self, points, blend_radius_m=0.0):
        self.command(3, (1, len(points), 0, 0, 0, 0), scale=1)
        for target, time_s in points:
            numbers = [round(SCALE * value) for value in (*target, *[0] * 12, time_s, blend_radius_m)]
            self.sockets["trajectory_socket"].sendall(struct.pack(">21i", *numbers, 0))

    def result(self):
        return struct.unpack(">i", self.sockets["trajectory_socket"].recv(4))[0]

    def close(self):
        for one in (*self.sockets.values(), *self.listeners.values(), self.primary):
            one.close()


@pytest.fixture(scope="module")
def robot(config, tmp_path_factory):
    ports = free_ports(5)
    mapping = tmp_path_factory.mktemp("takt_ur") / "mapping.yaml"
    mapping.write_text(MAPPING.format(*ports))
    with takt.Server(str(config / "scenarios" / "block_assembly.yaml"), pace="realtime") as server, server.client() as cell:
        gateway = Gateway(server, mapping)
        gateway.server = server
        yield cell, ports, gateway
        gateway.close()


@pytest.fixture
def opened():
    """Takes what a test opens and closes it at the test's end, also where the test fails: the inputs of an RTDE client that
    stays open are IN_USE for the next one."""
    with contextlib.ExitStack() as stack:
        def take(one):
            stack.callback(one.close)
            return one

        yield take


def test_outputs_and_inputs_are_gripper_and_state(robot, opened):
    cell, ports, _ = robot
    client = Rtde(opened, ports[0])
    state = client.wait(lambda s: True)
    assert state["timestamp"] >= 40.0
    assert list(state["actual_q"]) == pytest.approx(list(cell.state.robot("Robot1").position), abs=1e-6)
    client.send("U", bytes([1, 1, 1]))
    client.wait(lambda s: s["actual_digital_input_bits"] & 1)
    assert cell.state.gripper("Gripper1").closed
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
    q = list(client.wait(lambda s: s["runtime_state"] == 2)["actual_q"])
    end = q[5] + 0.2
    while q[5] < end:
        q[5] = min(end, q[5] + 0.001)
        driver.command(1, q, timeout_ms=200)
        client.wait(lambda s: True)
    repeats = 0
    while repeats < 20:  # the same set-point again, until the robot stands: a missing one is extrapolated
        driver.command(1, q, timeout_ms=200)
        target = client.wait(lambda s: True)["target_q"][5]
        repeats = repeats + 1 if abs(target - end) < 1e-6 else 0
    client.wait(lambda s: s["runtime_state"] == 1)  # no command for 200 ms
    state = client.wait(lambda s: abs(s["actual_q"][5] - s["target_q"][5]) < 1e-6)
    assert state["actual_q"][5] == pytest.approx(end, abs=1e-3)
    assert driver.sockets["reverse_socket"].recv(1) == b"", "the program closes its sockets"
    assert cell.state.robot("Robot1").position[5] == pytest.approx(state["actual_q"][5], abs=1e-3)


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


def test_torque_mode_is_refused_and_the_robot_stays(robot, opened):
    _, ports, gateway = robot
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    q = client.wait(lambda s: s["runtime_state"] == 2)["actual_q"]
    driver.command(8, (1.0,) * 6)
    assert client.wait(lambda s: s["runtime_state"] == 1)["actual_q"] == pytest.approx(q, abs=1e-3)
    gateway.wait_for_line("direct_torque", "force_mode")


def nearest_on_the_way(client, via, end):
    """The least distance of the targets to `via` (rad, of the joint that is farthest) until `end` is reached."""
    distances = []

    def arrived(state):
        distances.append(max(abs(a - b) for a, b in zip(state["target_q"], via)))
        return max(abs(a - b) for a, b in zip(state["target_q"], end)) < 1e-6

    client.wait(arrived)
    return min(distances)


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
    while list(cell.state.robot("Robot2").position) != pytest.approx(list(end), abs=1e-3):
        client.wait(lambda s: True)


def test_a_hostile_client_is_closed_and_the_robot_stays(robot, opened):
    cell, ports, _ = robot
    before = list(cell.state.robot("Robot1").position)
    for port in ports:
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as hostile:
            hostile.sendall(b"\xff\xff\x00\x00GET / HTTP/1.1\r\n\r\n" * 50)
    client = Rtde(opened, ports[0])
    client.wait(lambda s: True)
    assert list(cell.state.robot("Robot1").position) == before


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


def primary_messages(client, until):
    """The messages up to the first one that fulfils the condition: their types, and for robot messages what they are."""
    found = []
    while not found or not until(found[-1]):
        size, kind = struct.unpack(">iB", read(client, 5))
        body = read(client, size - 5)
        found.append((kind, body[9]) if kind == 20 else (kind,))
    return found


def read(client, count):
    received = b""
    while len(received) < count:
        part = client.recv(count - len(received))
        assert part, "the controller has closed the connection"
        received += part
    return received


ROBOT_STATE, VERSION, KEY_MESSAGE = (16,), (20, 3), (20, 7)


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


def test_a_program_reports_on_a_socket(robot, opened):
    # URScript manual: socket_set_var sends "set <name> <value>\n"; socket_send_int sends an int32 in network byte order.
    _, ports, _ = robot
    client = Rtde(opened, ports[0])
    listener = opened(socket.create_server(("127.0.0.1", 0)))
    listener.settimeout(PATIENCE_S)
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    target = [*q[:5], q[5] + 0.1]
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def reports():
  socket_open("127.0.0.1", {listener.getsockname()[1]}, "pc")
  movej({target}, t=0.5)
  socket_send_string("at", "pc")
  socket_send_line(12.5, "pc")
  socket_set_var("POS_Y", 2200, "pc")
  socket_send_int(-2, "pc")
  socket_send_byte(65, "pc")
  socket_send_line("lost", "other")
  socket_close("pc")
end
""".encode())
    peer = opened(listener.accept()[0])
    peer.settimeout(PATIENCE_S)
    expected = b"at12.5\nset POS_Y 2200\n\xff\xff\xff\xfeA"
    assert read(peer, len(expected)) == expected
    assert peer.recv(1) == b""
    client.wait(lambda s: s["runtime_state"] == 2)
    assert client.wait(lambda s: s["runtime_state"] == 1)["target_q"][5] == pytest.approx(target[5], abs=1e-6)


def remote_procedures(opened):
    """A server of XML-RPC, as gripper URCaps have one; its port and the calls that it has got."""
    calls = []
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
    server.close = lambda: (server.shutdown(), server.server_close())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return opened(server), calls


def test_a_program_calls_remote_procedures_while_the_robot_moves(robot, opened):
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    server, calls = remote_procedures(opened)
    answers = threading.Event()

    def slow_width(tool, pose):
        calls.append((tool, pose))
        assert answers.wait(PATIENCE_S)
        return 42.5

    server.register_function(slow_width, "get_width")
    server.register_function(lambda: {"x": 1, "y": 2, "z": 3, "rx": 0, "ry": 0, "rz": 0}, "pose")
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    target = [*q[:5], q[5] + 0.1]
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def a():
  grip = rpc_factory("xmlrpc", "http://127.0.0.1:{server.server_address[1]}/RPC2")
  thread asks():
    global width = grip.get_width(3, p[0.5, 0, 0, 0, 0, 0])
  end
  asked = run asks()
  movej({target}, t=0.5)
  write_output_integer_register(0, 1)
  join asked
  textmsg("width ", width)
  textmsg("pose ", grip.pose())
  textmsg("closed ", grip.closeXMLRPCClientConnection())
  grip.missing()
end
""".encode())
    client.wait(lambda s: abs(s["target_q"][5] - target[5]) < 1e-6)  # while the procedure has not answered
    assert calls == [(3, {"x": 0.5, "y": 0, "z": 0, "rx": 0, "ry": 0, "rz": 0})]
    answers.set()
    gateway.wait_for_line("width 42.5")
    gateway.wait_for_line("pose p[1, 2, 3, 0, 0, 0]")
    gateway.wait_for_line("closed True")
    gateway.wait_for_line("line 13, column 3", "XML-RPC: missing at", "fault 1", "missing")


def test_a_remote_procedure_without_a_server_ends_its_program(robot, opened):
    _, ports, gateway = robot
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    port = free_ports(1)[0]
    primary.sendall(f'def b():\n  g = rpc_factory("xmlrpc", "http://127.0.0.1:{port}")\n  g.open()\nend\n'.encode())
    gateway.wait_for_line("line 3, column 3", f"XML-RPC: open at http://127.0.0.1:{port}: the server cannot be reached")


class ModbusDevice:
    """A Modbus server with one memory for each of the four areas; it answers one request at a time."""

    def __init__(self, opened):
        self.bits, self.registers, self.requests = {1: {}, 2: {}}, {3: {}, 4: {}}, []
        self.listener = opened(socket.create_server(("127.0.0.1", 0)))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        with contextlib.suppress(OSError):
            peer, _ = self.listener.accept()
            with peer:
                while head := peer.recv(7, socket.MSG_WAITALL):
                    transaction, _, size, unit = struct.unpack(">HHHB", head)
                    pdu = peer.recv(size - 1, socket.MSG_WAITALL)
                    answer = self.answer(pdu)
                    self.requests.append((unit, pdu))
                    peer.sendall(struct.pack(">HHHB", transaction, 0, 1 + len(answer), unit) + answer)

    def answer(self, pdu):
        function, address = struct.unpack(">BH", pdu[:3])
        if address >= 1000:
            return bytes([function | 0x80, 2])
        if function in self.bits:
            return bytes([function, 1, self.bits[function].get(address, 0)])
        if function in self.registers:
            return struct.pack(">BBH", function, 2, self.registers[function].get(address, 0))
        if function in (5, 15):
            self.bits[1][address] = pdu[-1] & 1 if function == 15 else pdu[3] & 1
        elif function in (6, 16):
            self.registers[3][address] = struct.unpack(">H", pdu[-2:])[0]
        return pdu[:5]


def test_a_program_reads_and_writes_modbus_signals(robot, opened):
    _, ports, gateway = robot
    device = ModbusDevice(opened)
    device.bits[2][5], device.registers[4][6] = 1, 40000
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    place = f'"127.0.0.1:{device.port}", 9'
    primary.sendall(f"""def modbus():
  modbus_add_signal({place}, 5, 0, "present")
  modbus_add_signal({place}, 7, 1, "clamp")
  modbus_add_signal({place}, 6, 2, "weight")
  modbus_add_signal({place}, 8, 3, "speed", False)
  modbus_add_signal({place}, 1000, 2, "nowhere")
  modbus_set_signal_update_frequency("weight", 50)
  while not modbus_get_signal_status("present"):
    sync()
  end
  modbus_set_output_signal("clamp", True)
  modbus_set_output_register("speed", 1234, False)
  while modbus_get_signal_status("weight") != 40000 or modbus_get_error("nowhere") == -1:
    sync()
  end
  textmsg("modbus ", [modbus_get_error("weight"), modbus_get_error("nowhere")])
  modbus_send_custom_command({place}, 6, [0, 9, 1, 2])
  while modbus_get_signal_status("speed") != 1234 or not modbus_get_signal_status("clamp"):
    sync()
  end
  modbus_delete_signal("weight")
  modbus_get_error("weight")
end
""".encode())
    gateway.wait_for_line("modbus [0, 2]")
    gateway.wait_for_line("line 22, column 3", "modbus_get_error: no signal has the name 'weight'")
    assert (device.bits[1][7], device.registers[3][8], device.registers[3][9]) == (1, 1234, 258)
    assert {unit for unit, _ in device.requests} == {9}


def test_servoj_of_a_program_goes_to_its_joints_and_the_end_brakes(robot, opened):
    _, ports, _ = robot
    client = Rtde(opened, ports[0])
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    target = [*q[:5], q[5] - 0.1]
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"def a():\n  while True:\n    servoj({target}, t=0.02, lookahead_time=0.1, gain=300)\n  end\nend\n".encode())
    client.wait(lambda s: abs(s["target_q"][5] - target[5]) < 1e-5)
    primary.sendall(f"servoj({q}, t=0.1)\n".encode())  # ends on the way
    end = client.wait(lambda s: s["runtime_state"] == 1)["target_q"]
    at_rest = [client.wait(lambda s: True)["target_q"] for _ in range(500)][-2:]
    assert at_rest[0] == at_rest[1]
    assert target[5] < end[5] <= at_rest[1][5] < q[5]


@pytest.fixture
def second(robot, tmp_path, opened):
    """A controller of Robot2 with the standard ports, at an address that no other test has."""
    _, _, gateway = robot
    number = os.getpid()
    address = f"127.{64 + (number >> 16 & 63)}.{number >> 8 & 255}.{1 + number % 250}"
    mapping = tmp_path / "standard_ports.yaml"
    mapping.write_text(f"takt_ur: 1\nrobot: Robot2\nrobotiq: Gripper2\nreports: {tmp_path}\n"
                       f"listen: {{address: {address}}}\n")
    opened(Gateway(gateway.server, mapping))
    return lambda port: opened(socket.create_connection((address, port), timeout=PATIENCE_S)), address


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


class RobotiqClient:
    """Talks to Robotiq's URCap as public clients do: an answer is what one read brings."""

    def __init__(self, connection):
        self.connection = connection

    def set(self, **variables):
        self.connection.sendall(("SET" + "".join(f" {n} {v}" for n, v in variables.items()) + "\n").encode())
        assert self.connection.recv(1024) == b"ack"

    def get(self, name):
        self.connection.sendall(f"GET {name}\n".encode())
        found, value = self.connection.recv(1024).decode().split()
        assert found == name
        return int(value)

    def move(self, position):
        """Position and object at its end."""
        self.set(POS=position, SPE=255, FOR=255, GTO=1)
        while self.get("PRE") != position:
            pass
        while self.get("OBJ") == 0:
            pass
        return self.get("POS"), self.get("OBJ")


def test_a_client_of_robotiqs_urcap_closes_and_opens_the_gripper(robot, second):
    cell, _, _ = robot
    connect, _ = second
    client = RobotiqClient(connect(63352))
    assert (client.get("STA"), client.get("FLT")) == (3, 0)
    for position in (255, 0, 100, 0):
        assert client.move(position) == (pytest.approx(position, abs=2), 3)
        width, most = cell.state.gripper("Gripper2").width, cell.info.grippers["Gripper2"].max_width
        assert width == pytest.approx(most * (1 - position / 255), abs=1e-3)


def test_a_program_talks_to_robotiqs_urcap_of_its_own_controller(robot, second):
    connect, _ = second
    client, primary = RobotiqClient(connect(63352)), connect(30001)
    # As the URCap's own functions: an answer has its length in front, and ack is 97, 99, 107.
    primary.sendall(b"""def gripper():
  socket_open("127.0.0.1", 63352, "1")
  socket_set_var("POS", 200, "1")
  ack = socket_read_byte_list(3, "1")
  if ack == [3, 97, 99, 107]:
    socket_set_var("SPE", socket_get_var("PRE", "1") - 1, "1")
  end
end
""")
    while client.get("SPE") != 199:
        pass
    assert client.get("POS") > 0 or client.get("PRE") == 200
    client.move(0)


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


def test_statements_of_interpreter_mode_are_answered_and_executed_in_order(robot, second, opened):
    # Replies as UR's interpreter helper and other public clients read them: (\w+):\W+(\d+)?
    connect, address = second
    rtde, interpreter, primary = Rtde(opened, 30004, address), connect(30020), connect(30001)

    def ask(line):
        interpreter.sendall(line.encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            answer += read(interpreter, 1)
        kind, number = re.match(r"(\w+):\W+(\d+)?", answer.decode()).groups()
        return kind, number and int(number)

    def wait_for_execution(number):
        while ask("statelastexecuted") != ("state", number):
            rtde.wait(lambda s: True)

    assert ask("sleep(0.1)")[0] == "discard"  # no program runs
    primary.sendall(b"def a():\n  interpreter_mode()\n  movej([0, -1.5, 1.5, 0, 0.5, 0], t=0.5)\nend\n")
    q = list(rtde.wait(lambda s: s["runtime_state"] == 2)["target_q"])
    there, back = [*q[:5], q[5] + 0.2], [*q[:5], q[5] + 0.1]
    assert ask(f"movej({there}, t=0.5)") == ("ack", 1)
    assert ask(f"movej({back}, t=0.5)") == ("ack", 2)
    assert ask("no_function()")[0] == "discard"
    assert ask("x = y")[0] == "discard"
    assert ask("interpreter_mode()")[0] == "discard"
    assert ask("statelastinterpreted") == ("state", 2)
    rtde.wait(lambda s: abs(s["target_q"][5] - there[5]) < 1e-6)
    wait_for_execution(2)
    rtde.wait(lambda s: abs(s["target_q"][5] - back[5]) < 1e-6)
    assert ask(f"movej({q}, t=1000)") == ("ack", 3)
    assert ask(f"movej({there}, t=1000)") == ("ack", 4)
    wait_for_execution(3)
    assert ask("stateunexecuted") == ("state", 1)
    assert ask("skipbuffer")[0] == "ack"
    assert ask("stateunexecuted") == ("state", 0)
    assert ask("abort")[0] == "ack"
    assert ask("clear_interpreter()") == ("ack", 5)
    while ask("statelastcleared") != ("state", 4):
        rtde.wait(lambda s: True)
    assert ask("end_interpreter()") == ("ack", 6)
    assert rtde.wait(lambda s: s["runtime_state"] == 1)["target_q"] == pytest.approx((0, -1.5, 1.5, 0, 0.5, 0), abs=1e-6)
    assert ask("sleep(0.1)")[0] == "discard"


def test_a_program_with_functions_and_a_thread_talks_on_a_socket_and_moves(robot, opened):
    # Euclid's algorithm on numbers that the peer sends as UR's manual says: "(1071, 462)", and an int32 in network byte order.
    _, ports, _ = robot
    client = Rtde(opened, ports[0])
    listener = opened(socket.create_server(("127.0.0.1", 0)))
    listener.settimeout(PATIENCE_S)
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def asks():
  global done = False
  global ticks = 0
  def gcd(a, b):
    while b != 0:
      local rest = a % b
      a = b
      b = rest
    end
    return a
  end
  thread clock():
    while not done:
      enter_critical
      ticks = ticks + 1
      exit_critical
      sync()
    end
  end
  opened = socket_open("127.0.0.1", {listener.getsockname()[1]}, "pc")
  counting = run clock()
  numbers = socket_read_ascii_float(2, "pc")
  socket_send_line(gcd(numbers[1], numbers[2]), "pc")
  answer = socket_read_binary_integer(1, "pc")
  target = get_target_joint_positions()
  target[5] = target[5] + answer[1] / 10
  movej(target, t = 0.2)
  pose = get_forward_kin(target)
  socket_send_line(point_dist(pose, get_target_tcp_pose()) < 0.000001, "pc")
  silent = socket_read_string("pc", timeout = 0.1)
  socket_send_line(str_cat(str_len(silent), str_cat(" ", read_input_integer_register(0))), "pc")
  done = True
  join counting
  socket_send_line(ticks > 100, "pc")
end
""".encode())
    peer = opened(listener.accept()[0])
    peer.settimeout(PATIENCE_S)
    peer.sendall(b"(1071, 462)")
    assert read(peer, 3) == b"21\n"
    peer.sendall(struct.pack(">i", -2))
    assert read(peer, 5) == b"True\n"
    assert read(peer, 4) == b"0 0\n"
    assert read(peer, 5) == b"True\n"
    assert peer.recv(1) == b""
    client.wait(lambda s: s["runtime_state"] == 2)
    assert client.wait(lambda s: s["runtime_state"] == 1)["target_q"][5] == pytest.approx(q[5] - 0.2, abs=1e-6)


def test_moves_of_a_loop_with_computed_targets_are_blended(robot, opened):
    # Without the blend the speed is 0 at each corner.
    _, ports, _ = robot
    client = Rtde(opened, ports[0])
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def corners():
  i = 1
  while i <= 4:
    q = {q}
    q[0] = q[0] + 0.05 * i
    q[1] = q[1] + 0.05 * (i % 2)
    r = 0.01
    if i == 4:
      r = 0
    end
    movej(q, a = 3, v = 0.3, r = r)
    i = i + 1
  end
end
""".encode())
    client.wait(lambda s: s["runtime_state"] == 2)
    positions = []
    client.wait(lambda s: positions.append(s["target_q"]) or s["runtime_state"] == 1)
    assert positions[-1][0] == pytest.approx(q[0] + 0.2, abs=1e-6)
    inside = [p[0] for p in positions if q[0] + 0.02 < p[0] < q[0] + 0.18]
    assert min(b - a for a, b in zip(inside, inside[1:], strict=False)) > 1e-5


def test_a_program_that_is_refused_says_where_and_why(robot, opened):
    _, ports, gateway = robot
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(b"def a():\n  x = 1\n  powerdown()\nend\n")
    gateway.wait_for_line("line 3, column 3: powerdown is not supported by takt")
    primary.sendall(b"def b():\n  x = [1, 2]\n  sync()\n  textmsg(x[2])\nend\n")
    gateway.wait_for_line("line 4, column 11: index 2 is out of range; allowed: 0 to 1")


def test_a_thread_that_moves_is_killed_and_another_one_may_not_move_beside_it(robot, opened):
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def kills():
  q = {q}
  q[5] = q[5] + 1
  thread far():
    movej(q, t = 100)
  end
  first = run far()
  sleep(0.5)
  kill first
  sleep(0.5)
  textmsg("the killed thread leaves the robot steady: ", is_steady())
  second = run far()
  sleep(0.1)
  movej({q})
end
""".encode())
    client.wait(lambda s: s["runtime_state"] == 2)
    gateway.wait_for_line("the killed thread leaves the robot steady: True")
    gateway.wait_for_line("line 14, column 3: Another thread is already controlling the robot")
    client.wait(lambda s: s["runtime_state"] == 2)
    end = client.wait(lambda s: s["runtime_state"] == 1)["target_q"][5]
    assert q[5] < end < q[5] + 0.02


def test_interpreter_mode_has_the_variables_and_functions_of_its_program(second, opened):
    connect, address = second
    rtde, interpreter, primary = Rtde(opened, 30004, address), connect(30020), connect(30001)

    def ask(line):
        interpreter.sendall(line.encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            answer += read(interpreter, 1)
        return answer.decode()

    primary.sendall(b"def a():\n  def twice(x):\n    return 2 * x\n  end\n  base = 20\n  interpreter_mode()\n"
                    b"  q = get_target_joint_positions()\n  q[5] = q[5] + base / 1000\n  movej(q, t = 0.2)\nend\n")
    q = rtde.wait(lambda s: s["runtime_state"] == 2)["target_q"]
    assert ask("n = base + 1").startswith("ack: 1:")
    assert ask("base = twice(n)").startswith("ack: 2:")
    assert ask("missing = nothing").startswith("discard: compile_error_name_not_found:nothing:")
    assert ask("end_interpreter()").startswith("ack")
    assert rtde.wait(lambda s: s["runtime_state"] == 1)["target_q"][5] == pytest.approx(q[5] + 0.042, abs=1e-6)


def test_a_program_waits_for_a_peer_that_reads_late(robot, opened):
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    listener = opened(socket.create_server(("127.0.0.1", 0)))
    listener.settimeout(PATIENCE_S)
    client.wait(lambda s: s["runtime_state"] == 1)
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    count, size = 2000, 16384  # more than the sockets and the gateway hold
    primary.sendall(f"""def sends():
  socket_open("127.0.0.1", {listener.getsockname()[1]}, "pc")
  text = "x"
  while str_len(text) < {size}:
    text = str_cat(text, text)
  end
  i = 0
  while i < {count}:
    socket_send_string(text, "pc")
    i = i + 1
  end
  textmsg("all is ", "sent")
  socket_close("pc")
end
""".encode())
    peer = opened(listener.accept()[0])
    peer.settimeout(PATIENCE_S)
    client.wait(lambda s: s["runtime_state"] == 2)
    for _ in range(500):
        assert client.wait(lambda s: True)["runtime_state"] == 2
    assert not any("all is sent" in line for line in gateway.lines)
    assert read(peer, count * size) == b"x" * (count * size)
    assert peer.recv(1) == b""
    gateway.wait_for_line("all is sent")


def test_secondary_programs_take_turns(robot, opened):
    _, ports, gateway = robot
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(b"".join(b"textmsg(\"statement %d \", \"of many\")\n" % i for i in range(100)))
    gateway.wait_for_line("statement 99 of many")
    assert [line for line in gateway.lines if "of many" in line and "refused" in line] == []
    primary.sendall(b"sec endless():\n  while True:\n    sync()\n  end\nend\n" * 1001)
    gateway.wait_for_line("The secondary program endless is refused: 1000 of them run or wait")
    primary.sendall(b"stop program\nsec after():\n  textmsg(\"after the \", \"stop\")\nend\n")
    gateway.wait_for_line("after the stop")


def test_functions_of_control_programs_agree_with_kinematics(robot, opened):
    # The Jacobian with differences of forward kinematics, servoc with its target, histories with the present.
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    q = list(client.wait(lambda s: s["runtime_state"] == 1)["target_q"])
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(f"""def agrees():
  q = {q}
  rates = [0.3, -0.2, 0.5, 0.1, -0.4, 0.7]
  def check(what, fits):
    textmsg(str_cat(what, " "), fits)
  end
  def twist(tcp):
    a = get_forward_kin(q - 0.00001 * rates, tcp)
    b = get_forward_kin(q + 0.00001 * rates, tcp)
    turn = pose_sub(b, a)
    return [b[0] - a[0], b[1] - a[1], b[2] - a[2], turn[3], turn[4], turn[5]] / 0.00002
  end
  tool = p[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
  check("jacobian", norm(get_jacobian(q) * rates - twist(get_tcp_offset())) < 0.000001)
  check("jacobian of a tool", norm(get_jacobian(q, tool) * rates - twist(tool)) < 0.000001)
  check("flange", pose_dist(get_actual_tool_flange_pose(), get_forward_kin(q, p[0, 0, 0, 0, 0, 0])) < 0.0001)
  check("history", norm(get_actual_joint_positions_history(3) - q) < 0.0001)
  check("contact", tool_contact() == 0)
  target = pose_trans(get_target_tcp_pose(), p[0, 0, -0.05, 0, 0, 0.1])
  servoc(target, 1.2, 0.25)
  check("servoc", pose_dist(get_target_tcp_pose(), target) < 0.0003)
  thread back():
    movej(q, t = 0.5)
  end
  going = run back()
  sleep(0.1)
  check("waypoint", pose_dist(get_target_waypoint(), get_forward_kin(q)) < 0.000001)
  check("moves", not is_steady())
  join going
end
""".encode())
    for what in ("jacobian", "jacobian of a tool", "flange", "history", "contact", "servoc", "waypoint", "moves"):
        gateway.wait_for_line(f"{what} True")
    client.wait(lambda s: s["runtime_state"] == 2)
    assert client.wait(lambda s: s["runtime_state"] == 1)["target_q"] == pytest.approx(q, abs=1e-6)


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
