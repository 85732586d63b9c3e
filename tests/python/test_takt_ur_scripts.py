"""Programs in URScript that takt-ur executes: on its interfaces, in interpreter mode, with sockets and devices."""

import re
import socket
import struct
import threading

import pytest

from ur_clients import (  # noqa: F401  (fixtures)
    ModbusDevice,
    opened,
    PATIENCE_S,
    read,
    remote_procedures,
    robot,
    RobotiqClient,
    Rtde,
    second,
)


def test_a_program_reports_on_a_socket(robot, opened):
    # URScript manual: socket_set_var sends "SET <name> <value>\n"; socket_send_int sends an int32 in network byte order.
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
    expected = b"at12.5\nSET POS_Y 2200\n\xff\xff\xff\xfeA"
    assert read(peer, len(expected)) == expected
    assert peer.recv(1) == b""
    client.wait(lambda s: s["runtime_state"] == 2)
    assert client.wait(lambda s: s["runtime_state"] == 1)["target_q"][5] == pytest.approx(target[5], abs=1e-6)


def test_a_program_calls_remote_procedures_while_the_robot_moves(robot, opened):
    _, ports, gateway = robot
    client = Rtde(opened, ports[0])
    server, calls = remote_procedures(opened)
    called, answers = threading.Event(), threading.Event()

    def slow_width(tool, pose):
        calls.append((tool, pose))
        called.set()
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
    assert called.wait(PATIENCE_S)
    assert calls == [(3, {"x": 0.5, "y": 0, "z": 0, "rx": 0, "ry": 0, "rz": 0})]
    answers.set()
    gateway.wait_for_line("width 42.5")
    gateway.wait_for_line("pose p[1, 2, 3, 0, 0, 0]")
    gateway.wait_for_line("closed True")
    gateway.wait_for_line("line 13, column 3", "XML-RPC: missing at", "fault 1", "missing")


def test_a_remote_procedure_without_a_server_ends_its_program(robot, opened):
    _, ports, gateway = robot
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    silent = opened(socket.socket())
    silent.bind(("127.0.0.1", 0))  # and does not listen
    port = silent.getsockname()[1]
    primary.sendall(f'def b():\n  g = rpc_factory("xmlrpc", "http://127.0.0.1:{port}")\n  g.open()\nend\n'.encode())
    gateway.wait_for_line("line 3, column 3", f"XML-RPC: open at http://127.0.0.1:{port}: the server cannot be reached")


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
    device.wait(lambda: {8, 9} <= device.registers[3].keys() and 7 in device.bits[1])
    assert (device.bits[1][7], device.registers[3][8], device.registers[3][9]) == (1, 1234, 258)
    assert {unit for unit, _ in device.requests} == {9}


def test_modbus_signals_beyond_the_limits_end_their_program_alone(robot, opened):
    _, ports, gateway = robot
    device = ModbusDevice(opened)
    silent = opened(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))

    def run(name, *lines):
        primary.sendall(("\n".join([f"def {name}():", *(f"  {line}" for line in lines), "end"]) + "\n").encode())

    run("nameless", 'modbus_add_signal("127.0.0.1", 1, 5, 0, "")')
    gateway.wait_for_line("nameless", "a name")
    run("full", f'modbus_add_signal("127.0.0.1:{silent}", 1, 5, 1, "one")', f'modbus_add_signal("127.0.0.1:{silent}", 1, 6, 1, "other")',
        "modbus_set_signal_update_frequency(\"other\", 0.01)", "i = 0", "while i < 1001:",
        '  modbus_set_output_signal("one", True)', "  i = i + 1", "end")
    gateway.wait_for_line("full", "more than 1000 requests wait for")
    run("servers", *(f'modbus_add_signal("127.0.0.1:{device.port}", 1, 5, 0, "s{i}")' if i == 0 else
                     f'modbus_add_signal("127.0.{i}.1:{silent}", 1, 5, 0, "s{i}")' for i in range(33)))
    gateway.wait_for_line("servers", "at most 32 servers")
    run("still_there", 'while modbus_get_error("s0") == -1:', "  sync()", "end", 'modbus_delete_signal("s1")',
        f'modbus_add_signal("127.0.99.1:{device.port}", 1, 5, 0, "again")', 'textmsg("the controller ", "goes on")')
    gateway.wait_for_line("the controller goes on")


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
  sleep(1)
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
