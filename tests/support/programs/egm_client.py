"""An EGM program written from the fact sheet alone: answers each message of a controller with references.

egm_client.py PORT [--messages N] [--amplitude DEG] [--period S] [--feed-forward] [--fault FAULT] [--gripper AT,AT]
    [--path Y,Z]
A sine on joint 1 by the controller's time, or with --path a path correction of so many mm. Prints a line of JSON. Faults: radians, cut, silent:N (no answer
from message N on).
"""
import argparse
import json
import math
import socket

import egm_wire as egm

arguments = argparse.ArgumentParser()
arguments.add_argument("port", type=int)
arguments.add_argument("--messages", type=int, default=500)
arguments.add_argument("--amplitude", type=float, default=10.0)
arguments.add_argument("--period", type=float, default=2.0)
arguments.add_argument("--feed-forward", action="store_true")
arguments.add_argument("--fault", default="")
arguments.add_argument("--gripper", default="")
arguments.add_argument("--path", default="")
a = arguments.parse_args()

link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", a.port))
link.settimeout(60)
print("ready", flush=True)

changes = [int(at) for at in a.gripper.split(",") if at]
start = first = last = converged = None
worst = 0.0
seqnos = []
states = set()
held = 0
force = None
k = 0
reference = 0.0
while k < a.messages:
    data, peer = link.recvfrom(2048)
    robot = egm.fields(data)
    header = egm.fields(robot[1][0])
    seqno, tm = header[1][0], header[2][0]
    joints = egm.joints_of(robot)
    assert len(joints) == 6 and len(egm.joints_of(robot, 3)) == 6 and header[3] == [2], robot
    if start is None:
        start, first = joints, tm
    if last != seqno:
        k += 1
        seqnos.append(seqno)
        worst = max(worst, abs(joints[0] - start[0] - reference))
    last = seqno
    converged = robot[6] == [1]
    states.add((egm.fields(robot[4][0])[1][0], egm.fields(robot[5][0])[1][0], egm.fields(robot[8][0])[1][0]))
    if 9 in robot:
        measured = egm.fields(robot[9][0])
        force = measured.get(2, measured.get(1))  # RobotWare 7, or 6
    if 13 in robot:
        held += egm.fields(robot[13][0]).get(1, [0])[0]
    t = (tm - first) / 1000.0
    w = 2 * math.pi / a.period
    reference = a.amplitude * math.sin(w * t)
    speed = a.amplitude * w * math.cos(w * t)
    target = [start[0] + reference] + start[1:]
    if a.fault == "radians":
        target = [math.radians(v) for v in target]
    if a.fault.startswith("silent") and k > int(a.fault.split(":")[1]):
        continue
    answer = egm.sensor(k, target, tm, speeds=[speed, 0, 0, 0, 0, 0] if a.feed_forward else None,
                        digital=sum(k >= at for at in changes) % 2 if changes else None)
    if a.path:
        answer = egm.path_correction(k, *map(float, a.path.split(",")))
    link.sendto(answer[:40] if a.fault == "cut" else answer, peer)
print(json.dumps({"messages": k, "worst_deg": worst, "first_seqno": seqnos[0], "last_seqno": seqnos[-1],
                  "states": sorted(states), "held": held, "force": force, "start": start, "end": joints, "converged": converged}), flush=True)
