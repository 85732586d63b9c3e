"""takt-ur against clients of the real-time interface, and of ur_rtde's control program, which commands it by RTDE registers."""

import math
import socket
import struct

import pytest

from test_takt_ur import PATIENCE_S, Rtde, opened, robot  # noqa: F401  (fixtures)

# What takt-ur recognises of the program; its real text is as public as it is long.
PROGRAM = """def rtde_control():
  global reg_offset_float = # float register offset
0
  global reg_offset_int = # int register offset
0
  def exec_move_path():
    textmsg("exec_move_path")
{path}  end
  def rtde_cmd():
    return read_input_integer_register(reg_offset_int)
  end
  def process_cmd():
    cmd = rtde_cmd()
  end
  while keep_running:
    if cmd == 24 or cmd == 11 or cmd == 9 or cmd == 10 or cmd == 6:
      keep_running = process_cmd()
    end
  end
end
"""
READY, DONE = 1, 2
SET_TCP = 29
MOVEJ, MOVEJ_IK, MOVEL, SPEEDJ, SERVOJ = 1, 2, 3, 9, 11
SPEED_STOP, SERVO_STOP, INVERSE_KINEMATICS, STOPJ, IN_LIMITS, POSE_TRANS, FORWARD_KINEMATICS, PATH, STOP_PROGRAM = (
    15, 16, 30, 34, 37, 39, 44, 45, 255)


class Control(Rtde):
    """Commands as ur_rtde sends them: a number and its values, and 0 when it is done."""

    OUTPUTS = {"timestamp": "d", "actual_q": "6d", "target_q": "6d", "target_qd": "6d", "runtime_state": "I",
               "actual_TCP_pose": "6d", "output_int_register_0": "i", "output_int_register_1": "i",
               "output_int_register_2": "i", **{f"output_double_register_{i}": "d" for i in range(6)}}
    TYPES = b"DOUBLE,VECTOR6D,VECTOR6D,VECTOR6D,UINT32,VECTOR6D,INT32,INT32,INT32" + b",DOUBLE" * 6
    DOUBLES = 15

    def __init__(self, opened, ports, path=""):
        super().__init__(opened, ports[0])
        names = ["input_int_register_0", "input_int_register_1", *(f"input_double_register_{i}" for i in range(self.DOUBLES))]
        assert self.ask("I", ",".join(names).encode()) == b"\2INT32,INT32" + b",DOUBLE" * self.DOUBLES
        self.write(0)
        self.primary = opened(socket.create_connection(("127.0.0.1", ports[2]), timeout=PATIENCE_S))
        self.primary.sendall(PROGRAM.format(path=path).encode())
        self.wait(lambda s: s["runtime_state"] == 2 and s["output_int_register_0"] == READY)

    def write(self, command, values=(), flag=0):
        numbers = [*values, *[0.0] * (self.DOUBLES - len(values))]
        self.send("U", struct.pack(f">B2i{self.DOUBLES}d", 2, command, flag, *numbers))

    def do(self, command, values=(), flag=0):
        """The state when the command is done."""
        self.wait(lambda s: s["output_int_register_0"] == READY)
        self.write(command, values, flag)
        state = self.wait(lambda s: s["output_int_register_0"] == DONE)
        self.write(0)
        self.wait(lambda s: s["output_int_register_0"] == READY)
        return state

    def answers(self, command, values):
        state = self.do(command, values)
        return [state[f"output_double_register_{i}"] for i in range(6)]

    def end(self):
        self.write(STOP_PROGRAM)
        self.wait(lambda s: s["runtime_state"] == 1)
        self.write(0)


def test_the_realtime_interface_sends_the_state_and_no_primary_messages(robot, opened):
    cell, ports, _ = robot
    client = opened(socket.create_connection(("127.0.0.1", ports[3]), timeout=PATIENCE_S))
    received = b""
    while len(received) < 2 * 1220:
        received += client.recv(4096)
    assert struct.unpack(">i", received[:4]) == struct.unpack(">i", received[1220:1224]) == (1220,)
    times = [struct.unpack(">d", received[at:at + 8])[0] for at in (4, 1224)]
    assert times[0] < times[1]
    assert struct.unpack(">6d", received[252:300]) == pytest.approx(list(cell.state.robot("Robot1").position), abs=1e-6)
    pose = Rtde(opened, ports[0]).wait(lambda s: True)["actual_TCP_pose"]
    assert struct.unpack(">6d", received[444:492]) == pytest.approx(pose, abs=1e-6)


def test_moves_end_where_they_are_sent_and_say_when(robot, opened):
    cell, ports, _ = robot
    control = Control(opened, ports)
    q = list(control.wait(lambda s: True)["target_q"])
    away = [*q[:5], q[5] + 0.4]
    assert control.do(MOVEJ, [*away, 1.05, 1.4])["target_q"] == pytest.approx(away, abs=1e-9)
    pose = control.wait(lambda s: abs(s["actual_q"][5] - away[5]) < 1e-6)["actual_TCP_pose"]
    assert control.do(MOVEJ, [*q, 1.05, 1.4])["target_q"] == pytest.approx(q, abs=1e-9)
    assert control.do(MOVEJ_IK, [*pose, 1.05, 1.4])["target_q"] == pytest.approx(away, abs=1e-5)
    raised = [*pose[:2], pose[2] + 0.03, *pose[3:]]
    control.do(MOVEL, [*raised, 0.25, 1.2])
    arrived = control.wait(lambda s: abs(s["actual_TCP_pose"][2] - raised[2]) < 1e-5)["actual_TCP_pose"]
    assert arrived[:3] == pytest.approx(raised[:3], abs=1e-4)
    # An asynchronous move is done at once, and stops on its way.
    ended = control.wait(lambda s: True)["output_int_register_2"]
    control.do(MOVEJ, [*q, 0.2, 0.5], flag=1)
    assert control.wait(lambda s: abs(s["target_qd"][5]) > 0.01)["output_int_register_2"] == 0
    control.do(STOPJ, [4.0])
    assert abs(control.wait(lambda s: True)["target_q"][5] - q[5]) > 0.01
    control.do(MOVEJ, [*q, 1.0, 2.0], flag=1)
    control.wait(lambda s: s["output_int_register_2"] < 0 and s["output_int_register_2"] != ended)
    control.end()


def test_kinematics_answer_in_output_registers(robot, opened):
    _, ports, _ = robot
    control = Control(opened, ports)
    state = control.wait(lambda s: True)
    # A turn of a quarter about z, then 2 along x: y = 2.
    turn, step = [1.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2], [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert control.answers(POSE_TRANS, turn + step) == pytest.approx([1.0, 2.0, 0.0, 0.0, 0.0, math.pi / 2], abs=1e-12)
    near = [value + 0.05 for value in state["target_q"]]
    found = control.answers(INVERSE_KINEMATICS, [*state["actual_TCP_pose"], *near, 1e-10, 1e-10])
    assert found == pytest.approx(list(state["actual_q"]), abs=1e-5)
    flange = control.answers(FORWARD_KINEMATICS, [*state["actual_q"], *[0.0] * 6])
    further = control.answers(FORWARD_KINEMATICS, [*state["actual_q"], 0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    assert math.dist(flange[:3], further[:3]) == pytest.approx(0.1, abs=1e-9)
    assert control.do(IN_LIMITS, list(state["actual_q"]))["output_int_register_1"] == 1
    assert control.do(IN_LIMITS, [100.0] * 6)["output_int_register_1"] == 0
    control.end()


def test_servo_and_speed_go_on_until_they_are_stopped(robot, opened):
    _, ports, _ = robot
    control = Control(opened, ports)
    q = list(control.wait(lambda s: True)["target_q"])
    control.write(SERVOJ, [*q[:5], q[5] + 0.1, 0.0, 0.0, 0.002, 0.05, 300.0])
    control.wait(lambda s: abs(s["target_q"][5] - q[5] - 0.1) < 1e-6)
    control.do(SERVO_STOP, [10.0])
    control.write(SPEEDJ, [0.0, 0.0, 0.0, 0.0, 0.0, -0.2, 0.5, 0.0])
    control.wait(lambda s: abs(s["target_qd"][5] + 0.2) < 1e-9)
    control.wait(lambda s: s["target_q"][5] < q[5])
    control.do(SPEED_STOP, [10.0])
    assert control.wait(lambda s: True)["target_qd"] == pytest.approx([0.0] * 6, abs=1e-6)
    control.end()


def test_a_move_beside_speed_control_ends_the_program_as_on_the_robot(robot, opened):
    _, ports, gateway = robot
    control = Control(opened, ports)
    q = list(control.wait(lambda s: True)["target_q"])
    control.write(SPEEDJ, [0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.5, 0.0])
    control.wait(lambda s: s["target_qd"][5] > 0.01)
    control.write(MOVEJ, [*q, 1.0, 1.0])
    control.wait(lambda s: s["runtime_state"] == 1)
    gateway.wait_for_line("Another thread is already controlling the robot")
    control.write(0)


def test_a_path_is_followed_with_its_blends(robot, opened):
    cell, ports, _ = robot
    q = list(cell.state.robot("Robot1").position)
    via = [*q[:4], q[4] + 0.2, q[5]]
    path = "".join(f"\tsignal_async_progress({i})\n\tmovej({to},a=1.4,v=1.0,r={radius})\n"
                   for i, (to, radius) in enumerate(((via, 0.01), (q, 0.0))))
    control = Control(opened, ports, path)
    control.wait(lambda s: s["output_int_register_0"] == READY)
    control.write(PATH)
    least = []

    def done(state):
        least.append(max(abs(a - b) for a, b in zip(state["target_q"], via)))
        return state["output_int_register_0"] == DONE

    assert control.wait(done)["target_q"] == pytest.approx(q, abs=1e-9)
    assert 1e-3 < min(least) < 0.1, "past the point, not through it"
    control.write(0)
    control.end()


def test_values_that_no_robot_has_end_the_program(robot, opened):
    _, ports, gateway = robot
    control = Control(opened, ports)
    before = control.wait(lambda s: True)["target_q"]
    control.write(SET_TCP, [0.0, 0.0, 0.0, 1e200, 0.0, 0.0])
    control.wait(lambda s: s["runtime_state"] == 1)
    gateway.wait_for_line("input_double_register_3", "allowed")
    assert control.wait(lambda s: True)["target_q"] == pytest.approx(before, abs=1e-4)
    control.write(0)
