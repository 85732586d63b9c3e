"""takt-ur against clients of the real-time interface, and of programs that a client commands by RTDE registers.

The program is one of URScript with the registers, threads and command numbers of ur_rtde's control program. TAKT_UR_RTDE names
that one's file (scripts/rtde_control.script of ur_rtde): then it runs in its place, as its client sends it.
"""

import math
import os
import re
import socket
import struct
from pathlib import Path

import pytest

from ur_clients import PATIENCE_S, Rtde, opened, robot  # noqa: F401  (fixtures)

PROGRAM = """def rtde_control():
  global offset = # first float register
0
  global servo_q = [0, 0, 0, 0, 0, 0]
  global speed_qd = [0, 0, 0, 0, 0, 0]
  global speed_a = 0.5
  global move_q = [0, 0, 0, 0, 0, 0]
  global move_v = 1
  global move_a = 1
  global writes = 0
  global move_thrd = 0
  global servo_thrd = 0
  global speed_thrd = 0
  def six(first):
    q = [0, 0, 0, 0, 0, 0]
    i = 0
    while i < 6:
      q[i] = read_input_float_register(first + i + offset)
      i = i + 1
    end
    return q
  end
  def pose(first):
    q = six(first)
    return p[q[0], q[1], q[2], q[3], q[4], q[5]]
  end
  def answer(values):
    i = 0
    while i < 6:
      write_output_float_register(i, values[i])
      i = i + 1
    end
  end
  def signal_async(running):
    writes = (writes + 1) % 128
    write_output_integer_register(2, writes * 65536 + running * 32768)
  end
  def path():
    textmsg("path")
    # inject move path
  end
  thread move_thread():
    signal_async(1)
    movej(move_q, a=move_a, v=move_v)
    enter_critical
    move_thrd = 0
    exit_critical
    signal_async(0)
  end
  thread servo_thread():
    while (True):
      servoj(servo_q, t=0.002, lookahead_time=0.05, gain=300)
    end
  end
  thread speed_thread():
    while (True):
      enter_critical
      target = speed_qd
      exit_critical
      speedj(target, a=speed_a)
    end
  end
  def stop_move():
    if move_thrd != 0:
      kill move_thrd
      move_thrd = 0
      signal_async(0)
    end
  end
  def process(cmd):
    async = read_input_integer_register(1)
    v = read_input_float_register(6)
    a = read_input_float_register(7)
    if cmd == 1:
      stop_move()
      if async == 1:
        move_q = six(0)
        move_v = v
        move_a = a
        move_thrd = run move_thread()
      else:
        movej(six(0), a=a, v=v)
      end
    elif cmd == 2:
      movej(get_inverse_kin(pose(0)), a=a, v=v)
    elif cmd == 3:
      movel(pose(0), a=a, v=v)
    elif cmd == 9:
      speed_qd = six(0)
      speed_a = v
      if speed_thrd == 0:
        global speed_thrd = run speed_thread()
      end
    elif cmd == 11:
      servo_q = six(0)
      if servo_thrd == 0:
        global servo_thrd = run servo_thread()
      end
    elif cmd == 15 or cmd == 16:
      kill speed_thrd
      kill servo_thrd
      speed_thrd = 0
      servo_thrd = 0
      stopj(read_input_float_register(0))
    elif cmd == 29:
      set_tcp(pose(0))
    elif cmd == 30:
      answer(get_inverse_kin(pose(0), six(6)))
    elif cmd == 34:
      stop_move()
      stopj(read_input_float_register(0))
    elif cmd == 35:
      rtde_set_watchdog("input_int_register_0", read_input_float_register(0), "stop")
    elif cmd == 37:
      if is_within_safety_limits(six(0)) == True:
        write_output_integer_register(1, 1)
      else:
        write_output_integer_register(1, 0)
      end
    elif cmd == 39:
      answer(pose_trans(pose(0), pose(6)))
    elif cmd == 44:
      answer(get_forward_kin(six(0), pose(6)))
    elif cmd == 45:
      stop_move()
      path()
    elif cmd == 58:
      answer(get_actual_tool_flange_pose())
    end
    if cmd != 255:
      write_output_integer_register(0, 2)
    end
    return cmd != 255
  end
  keep_running = True
  executing = False
  signal_async(0)
  write_output_integer_register(0, 1)
  while keep_running:
    cmd = read_input_integer_register(0)
    if cmd == 11 or cmd == 9 or cmd == 58:
      keep_running = process(cmd)
      write_output_integer_register(0, 1)
    elif cmd == 0:
      executing = False
      write_output_integer_register(0, 1)
    elif not executing:
      keep_running = process(cmd)
      executing = True
    end
    sync()
  end
end
"""


def program_with(path):
    """What a client sends: with registers from 0 on, and a path."""
    text = PROGRAM
    if file := os.environ.get("TAKT_UR_RTDE"):
        text = f"def rtde_control():\n{Path(file).read_text(encoding='utf-8')}end\n"
        text = re.sub(r"(?m)^\$[0-9.|]+", "", text)  # lines for a controller of this version
        for kind in ("float", "int"):
            text = text.replace(f"# {kind} register offset\n", f"# {kind} register offset\n0\n", 1)
    return text.replace("# inject move path\n", "# inject move path\n" + path, 1)


READY, DONE = 1, 2
SET_TCP = 29
MOVEJ, MOVEJ_IK, MOVEL, SPEEDJ, SERVOJ = 1, 2, 3, 9, 11
SPEED_STOP, SERVO_STOP, INVERSE_KINEMATICS, STOPJ, WATCHDOG, IN_LIMITS, POSE_TRANS, FORWARD_KINEMATICS, PATH, FLANGE, STOP_PROGRAM = (
    15, 16, 30, 34, 35, 37, 39, 44, 45, 58, 255)
ASYNC_RUNS = 1 << 15


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
        self.primary.sendall(program_with(path).encode())
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
    assert not control.wait(lambda s: True)["output_int_register_2"] & ASYNC_RUNS
    control.do(MOVEJ, [*q, 0.05, 0.5], flag=1)
    assert control.wait(lambda s: abs(s["target_qd"][5]) > 0.01)["output_int_register_2"] & ASYNC_RUNS
    control.do(STOPJ, [4.0])
    assert abs(control.wait(lambda s: True)["target_q"][5] - q[5]) > 0.01
    control.do(MOVEJ, [*q, 1.0, 2.0], flag=1)
    assert control.wait(lambda s: not s["output_int_register_2"] & ASYNC_RUNS)["target_q"] == pytest.approx(q, abs=1e-9)
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
    control.write(FLANGE)  # in each cycle, and never done
    control.wait(lambda s: [s[f"output_double_register_{i}"] for i in range(3)] == pytest.approx(flange[:3], abs=1e-4))
    control.write(0)
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
    q = cell.state.robot("Robot1").position.tolist()
    via = [*q[:4], q[4] + 0.2, q[5]]
    path = "".join(f"\tmovej({to},a=1.4,v=1.0,r={radius})\n" for to, radius in ((via, 0.01), (q, 0.0)))
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
    gateway.wait_for_line("set_tcp: allowed: (pose,")
    assert control.wait(lambda s: True)["target_q"] == pytest.approx(before, abs=1e-4)
    control.write(0)


def test_the_watchdog_ends_the_program_of_a_client_that_is_silent(robot, opened):
    _, ports, gateway = robot
    control = Control(opened, ports)
    control.do(WATCHDOG, [0.5])
    began = control.wait(lambda s: True)["timestamp"]
    while control.wait(lambda s: True)["timestamp"] < began + 3.0:  # it does not bark while the register is written
        control.write(0)
    silent = control.wait(lambda s: True)
    assert silent["runtime_state"] == 2
    ended = control.wait(lambda s: s["runtime_state"] == 1)["timestamp"]
    assert ended - silent["timestamp"] > 1.9
    gateway.wait_for_line("RTDE watchdog: input_int_register_0 is not written often enough. The program ends.")
