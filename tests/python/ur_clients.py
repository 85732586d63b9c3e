"""Clients and devices beside takt-ur, and the fixtures of its tests: an RTDE client, a driver with external control, a cell."""

import contextlib
import os
import pathlib
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

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support" / "programs"))
from ports import free_ports  # noqa: E402

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
ROBOT_STATE, VERSION, KEY_MESSAGE = (16,), (20, 3), (20, 7)


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


def nearest_on_the_way(client, via, end):
    """The least distance of the targets to `via` (rad, of the joint that is farthest) until `end` is reached."""
    distances = []

    def arrived(state):
        distances.append(max(abs(a - b) for a, b in zip(state["target_q"], via)))
        return max(abs(a - b) for a, b in zip(state["target_q"], end)) < 1e-6

    client.wait(arrived)
    return min(distances)


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


def remote_procedures(opened):
    """A server of XML-RPC, as gripper URCaps have one; its port and the calls that it has got."""
    calls = []
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
    server.close = lambda: (server.shutdown(), server.server_close())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return opened(server), calls


class ModbusDevice:
    """A Modbus server with one memory for each of the four areas; it answers one request at a time."""

    def __init__(self, opened):
        self.bits, self.registers, self.requests = {1: {}, 2: {}}, {3: {}, 4: {}}, []
        self.news = threading.Condition()
        self.listener = opened(socket.create_server(("127.0.0.1", 0)))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                peer, _ = self.listener.accept()
            except OSError:
                return
            with contextlib.suppress(OSError), peer:  # takt-ur connects again where an answer was late
                self.talk(peer)

    def talk(self, peer):
        while head := peer.recv(7, socket.MSG_WAITALL):
            transaction, _, size, unit = struct.unpack(">HHHB", head)
            pdu = peer.recv(size - 1, socket.MSG_WAITALL)
            answer = self.answer(pdu)
            with self.news:
                self.requests.append((unit, pdu))
                self.news.notify_all()
            peer.sendall(struct.pack(">HHHB", transaction, 0, 1 + len(answer), unit) + answer)

    def wait(self, condition):
        with self.news:
            assert self.news.wait_for(condition, PATIENCE_S), self.requests

    def answer(self, pdu):
        function, address, count = struct.unpack(">BHH", pdu[:5])
        places, size = range(address, address + count), (count + 7) // 8
        if address >= 1000:
            return bytes([function | 0x80, 2])
        if function in self.bits:
            bits = sum(self.bits[function].get(place, 0) << i for i, place in enumerate(places))
            return bytes([function, size]) + bits.to_bytes(size, "little")
        if function in self.registers:
            values = [self.registers[function].get(place, 0) for place in places]
            return struct.pack(f">BB{count}H", function, 2 * count, *values)
        if function == 5:
            self.bits[1][address] = pdu[3] & 1
        elif function == 6:
            self.registers[3][address] = count
        elif function == 15:
            bits = int.from_bytes(pdu[6:], "little")
            self.bits[1].update({place: bits >> i & 1 for i, place in enumerate(places)})
        elif function == 16:
            self.registers[3].update(zip(places, struct.unpack(f">{count}H", pdu[6:])))
        return pdu[:5]


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
