#!/usr/bin/env python3
"""A client of Universal Robots' interfaces with Python's standard library alone: ur_client.py [HOST [RTDE_PORT PRIMARY_PORT]].

It reads the robot's state by RTDE, moves it by a program of URScript, and closes and opens the gripper by a digital
output. It knows nothing of takt: the same program moves a real robot. Exit code 0 when the robot is where it was sent.
"""

import socket
import struct
import sys
import time

HOST = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1"
RTDE_PORT, PRIMARY_PORT = (int(port) for port in sys.argv[2:4]) if len(sys.argv) > 3 else (30004, 30001)
OUTPUTS = {"timestamp": "d", "actual_q": "6d", "actual_TCP_pose": "6d", "actual_digital_output_bits": "Q",
           "actual_digital_input_bits": "Q", "runtime_state": "I", "robot_mode": "i"}
RUNNING, PLAYING = 7, 2


def connect(port, seconds=10.0):
    """A connection to the controller, which may still be starting."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            return socket.create_connection((HOST, port), timeout=10)
        except ConnectionRefusedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)


class Rtde:
    """RTDE protocol 2: packages of uint16 size, uint8 type, payload; most significant byte first."""

    def __init__(self):
        self.socket = connect(RTDE_PORT)
        self.buffer = b""
        assert self.ask("V", struct.pack(">H", 2)) == b"\1", "protocol 2 is refused"
        types = self.ask("O", struct.pack(">d", 125.0) + ",".join(OUTPUTS).encode())
        assert types[0] != 0, types
        recipe = self.ask("I", b"standard_digital_output_mask,standard_digital_output")
        assert recipe[0] != 0, recipe
        self.recipe = recipe[:1]
        assert self.ask("S") == b"\1", "start is refused"

    def send(self, kind, payload=b""):
        self.socket.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)

    def next(self):
        while len(self.buffer) < 3 or len(self.buffer) < struct.unpack(">H", self.buffer[:2])[0]:
            received = self.socket.recv(4096)
            if not received:
                raise ConnectionError("the controller has closed the connection")
            self.buffer += received
        size = struct.unpack(">H", self.buffer[:2])[0]
        kind, payload = chr(self.buffer[2]), self.buffer[3:size]
        self.buffer = self.buffer[size:]
        return kind, payload

    def ask(self, kind, payload=b""):
        self.send(kind, payload)
        while True:
            answer, content = self.next()
            if answer == kind:
                return content

    def state(self):
        """The next data package."""
        while True:
            kind, payload = self.next()
            if kind == "U":
                break
        values, at = {}, 1
        for name, form in OUTPUTS.items():
            size = struct.calcsize(">" + form)
            numbers = struct.unpack(">" + form, payload[at:at + size])
            values[name] = numbers if len(numbers) > 1 else numbers[0]
            at += size
        return values

    def wait(self, condition, what, seconds=60.0):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            state = self.state()
            if condition(state):
                return state
        raise TimeoutError(what)

    def set_digital_output(self, number, value):
        self.send("U", self.recipe + bytes([1 << number, int(value) << number]))


def main():
    robot = Rtde()
    start = robot.wait(lambda s: s["robot_mode"] == RUNNING, "the robot is not running")
    print("joints (rad):", " ".join(f"{q:.4f}" for q in start["actual_q"]))
    target = list(start["actual_q"])
    target[0] += 0.3
    target[5] -= 0.5
    program = connect(PRIMARY_PORT)
    program.sendall((f"def move_away():\n  movej({target}, a=1.4, v=1.05)\n  set_standard_digital_out(0, True)\n"
                     f"  sleep(1.0)\n  set_standard_digital_out(0, False)\n"
                     f"  movej({list(start['actual_q'])}, a=1.4, v=1.05)\nend\n").encode())
    robot.wait(lambda s: s["runtime_state"] == PLAYING, "the program does not start")
    furthest = 0.0
    closed = False

    def moves(state):
        nonlocal furthest, closed
        furthest = max(furthest, abs(state["actual_q"][0] - start["actual_q"][0]))
        closed = closed or state["actual_digital_output_bits"] & 1 == 1
        return state["runtime_state"] != PLAYING

    end = robot.wait(moves, "the program does not end")
    error = max(abs(a - b) for a, b in zip(end["actual_q"], start["actual_q"]))
    print(f"joint 1 moved by {furthest:.4f} rad and back, error {error:.6f} rad; gripper closed by output 0: {closed}")
    return 0 if abs(furthest - 0.3) < 0.005 and error < 0.005 and closed else 1


if __name__ == "__main__":
    sys.exit(main())
