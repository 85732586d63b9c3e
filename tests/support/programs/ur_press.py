"""A UR client written from the fact sheet alone: sends a program to the primary interface and reads forces over RTDE.

ur_press.py RTDE_PORT PRIMARY_PORT FORCE_N
The program closes the gripper, takes the present force as zero and pushes downwards in force mode, with a gain for a hard contact. Prints a line of JSON: the raw wrench before,
and mean and spread of the vertical force in the last second of force mode, all by the controller's time.
"""
import json
import socket
import struct
import sys

rtde_port, primary_port, force = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
link = socket.create_connection(("127.0.0.1", rtde_port), timeout=60)


def exactly(size):
    received = b""
    while len(received) < size:
        more = link.recv(size - len(received))
        assert more, "the controller has closed the connection"
        received += more
    return received


def package():
    size, kind = struct.unpack(">HB", exactly(3))
    return chr(kind), exactly(size - 3)


def ask(kind, payload=b""):
    link.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)
    while True:
        answered, content = package()
        if answered == kind:
            return content


assert ask("V", struct.pack(">H", 2)) == b"\1"
recipe = ask("O", struct.pack(">d", 125.0) + b"timestamp,actual_TCP_force,ft_raw_wrench,runtime_state,actual_TCP_pose")
assert recipe[1:] == b"DOUBLE,VECTOR6D,VECTOR6D,UINT32,VECTOR6D", recipe
assert ask("S") == b"\1"


def sample():
    while True:
        kind, content = package()
        if kind == "U":
            values = struct.unpack(">13dI6d", content[1:])
            return {"t": values[0], "force": values[1:7], "raw": values[7:13], "state": values[13], "pose": values[14:]}


before = sample()
primary = socket.create_connection(("127.0.0.1", primary_port), timeout=60)
primary.sendall(f"""def press():
  set_tool_digital_out(0, True)
  sleep(2.0)
  zero_ftsensor()
  force_mode_set_gain_scaling(0.02)
  force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, {-force}, 0, 0, 0], 2, [0.05, 0.05, 0.05, 0.2, 0.2, 0.2])
  sleep(3.0)
  end_force_mode()
end
""".encode())
# The primary interface sends ten times a second; what is not read fills its buffer only.
primary.setblocking(False)
samples = []
started = False
while True:
    s = sample()
    try:
        primary.recv(65536)
    except BlockingIOError:
        pass
    running = s["state"] == 2
    if running:
        samples.append(s)
    if started and not running:
        break
    started = started or running
end = samples[-1]["t"]
last = [s["force"][2] for s in samples if s["t"] > end - 1.0]
print(json.dumps({"raw": before["raw"], "mean_N": sum(last) / len(last), "lowest_N": min(last), "highest_N": max(last),
                  "samples": len(last), "way_m": samples[-1]["pose"][2] - samples[0]["pose"][2]}), flush=True)
