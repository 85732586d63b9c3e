"""A KRC with a program of its own, written from the fact sheet alone: sends its axes and expects answers.

rsi_krc.py PORT --start A1,...,A6 [--seconds S] [--amplitude DEG] [--period S] [--fault FAULT] [--gripper AT] [--ipoc N]
Packets each 4 ms of wall time: a sine on A1 around the start. Prints a line of JSON: answers with the right IPOC, late
ones, and the times of answers. Faults: radians, cut, twice, restart (IPOC from 0 after half of the time), missing (no
AIPos), jump (A1 jumps by 20 degrees after half of the time).
"""
import argparse
import json
import math
import re
import socket
import time

arguments = argparse.ArgumentParser()
arguments.add_argument("port", type=int)
arguments.add_argument("--start", required=True)
arguments.add_argument("--seconds", type=float, default=2.0)
arguments.add_argument("--amplitude", type=float, default=10.0)
arguments.add_argument("--period", type=float, default=2.0)
arguments.add_argument("--fault", default="")
arguments.add_argument("--gripper", type=float, default=None)
arguments.add_argument("--ipoc", type=int, default=4208163634)
a = arguments.parse_args()

start = [float(v) for v in a.start.split(",")]
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", 0))
peer = ("127.0.0.1", a.port)
count = int(a.seconds / 0.004)
begin = time.monotonic()
answered = late = doubled = holding = 0
times = []
ipoc = a.ipoc
for k in range(count):
    t = 0.004 * k
    half = k >= count // 2
    value = a.amplitude * math.sin(2 * math.pi * t / a.period) + (20.0 if a.fault == "jump" and half else 0.0)
    axes = [start[0] + value] + start[1:]
    if a.fault == "radians":
        axes = [math.radians(v) for v in axes]
    if a.fault == "restart" and k == count // 2:
        ipoc = 0
    position = "" if a.fault == "missing" else "<AIPos " + " ".join(f'A{i + 1}="{v:.6f}"' for i, v in enumerate(axes)) + "/>"
    gpio = "" if a.gripper is None else f'<GPIO 01="{int(t >= a.gripper)}"/>'
    text = (f'<Rob Type="KUKA"><RIst X="445.0" Y="0.0" Z="790.0" A="180.0" B="0.0" C="180.0"/>{position}'
            f'<EIPos E1="0.0" E2="0.0" E3="0.0" E4="0.0" E5="0.0" E6="0.0"/><Delay D="{late}"/>{gpio}<IPOC>{ipoc}</IPOC></Rob>').encode()
    sent = time.monotonic()
    for _ in range(2 if a.fault == "twice" else 1):
        link.sendto(text[:150] if a.fault == "cut" else text, peer)
    right = 0
    end = begin + t + 0.004
    while (rest := end - time.monotonic()) > 0:
        link.settimeout(rest)
        try:
            answer = link.recvfrom(2048)[0].decode()
        except (TimeoutError, socket.timeout, BlockingIOError):
            break
        if f"<IPOC>{ipoc}</IPOC></Sen>" in answer:
            right += 1
            if right == 1:
                times.append(time.monotonic() - sent)
            found = re.search('<GPIO 01="([01])"/>', answer)
            holding += found is not None and found.group(1) == "1"
    answered += right > 0
    late += right == 0
    doubled += right > 1
    ipoc += 4
times.sort()
at = lambda part: round(1e3 * times[min(len(times) - 1, int(part * len(times)))], 3) if times else None
print(json.dumps({"packets": count, "answered": answered, "late": late, "doubled": doubled, "holding": holding,
                  "answer_ms": {"50%": at(0.5), "99%": at(0.99), "max": at(1.0)}, "end": axes}), flush=True)
