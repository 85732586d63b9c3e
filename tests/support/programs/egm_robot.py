"""An ABB controller that streams (EGMStreamStart), written from the fact sheet alone.

egm_robot.py PORT --start J1,J2,... [--seconds S] [--amplitude DEG] [--period S] [--fault FAULT] [--gripper AT]
Messages each 4 ms of wall time: a sine on joint 1 around the start. Prints a line of JSON with the answers.
Faults: radians, no_joints, cut, restart (seqno and tm from 0 after half of the time), motors_off (after half of it).
"""
import argparse
import json
import math
import socket
import time

import egm_wire as egm

arguments = argparse.ArgumentParser()
arguments.add_argument("port", type=int)
arguments.add_argument("--start", required=True)
arguments.add_argument("--seconds", type=float, default=2.0)
arguments.add_argument("--amplitude", type=float, default=10.0)
arguments.add_argument("--period", type=float, default=2.0)
arguments.add_argument("--fault", default="")
arguments.add_argument("--gripper", type=float, default=None)
a = arguments.parse_args()

start = [float(v) for v in a.start.split(",")]
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", 0))
link.setblocking(False)
peer = ("127.0.0.1", a.port)
count = int(a.seconds / 0.004)
begin = time.monotonic()
answers, last_digital = 0, None
for k in range(count):
    t = 0.004 * k
    value = a.amplitude * math.sin(2 * math.pi * t / a.period)
    joints = [start[0] + value] + start[1:]
    half = k >= count // 2
    seqno = k - count // 2 if a.fault == "restart" and half else k
    if a.fault == "radians":
        joints = [math.radians(v) for v in joints]
    data = egm.robot(seqno, [] if a.fault == "no_joints" else joints, 1000 + 4 * seqno,
                     motors=2 if a.fault == "motors_off" and half else 1,
                     digital=None if a.gripper is None else int(t >= a.gripper))
    link.sendto(data[:100] if a.fault == "cut" else data, peer)
    time.sleep(max(0.0, begin + t + 0.004 - time.monotonic()))
    try:
        while True:
            answer = egm.fields(link.recvfrom(2048)[0])
            answers += 1
            last_digital = egm.fields(answer[4][0]).get(1, [0])[0]
    except BlockingIOError:
        pass
print(json.dumps({"messages": count, "answers": answers, "digital": last_digital, "end": joints}), flush=True)
