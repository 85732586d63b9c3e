"""An RSI program written from the fact sheet alone: answers each packet of a KRC with corrections.

rsi_client.py PORT [--packets N] [--amplitude DEG] [--period S] [--relative] [--fault FAULT] [--sentype NAME] [--gripper AT,AT]
A sine on axis 1 over the packets, then Stop. Prints a line of JSON: packets, largest difference between AIPos and the
correction that was commanded a cycle before, D, and the number of cycles by IPOC.
Faults: radians, ipoc (IPOC + 1), malformed, silent:N:M (no answer from packet N on, M times), twice, late.
"""
import argparse
import json
import math
import re
import socket
import sys

arguments = argparse.ArgumentParser()
arguments.add_argument("port", type=int)
arguments.add_argument("--packets", type=int, default=500)
arguments.add_argument("--amplitude", type=float, default=10.0)
arguments.add_argument("--period", type=float, default=2.0)
arguments.add_argument("--relative", action="store_true")
arguments.add_argument("--fault", default="")
arguments.add_argument("--gripper", default="", help="packets at which GPIO.01 becomes 1, 0, 1, ...")
arguments.add_argument("--sentype", default="KROSHU")
arguments.add_argument("--no-stop", action="store_true")
a = arguments.parse_args()

link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("127.0.0.1", a.port))
link.settimeout(60)
print("ready", flush=True)

NUMBER = r"(-?[0-9.]+)"
AXES = re.compile("<AIPos " + " ".join(f'A{i}="{NUMBER}"' for i in range(1, 7)) + "/>")
IPOC = re.compile("<IPOC>([0-9]+)</IPOC></Rob>$")
DELAY = re.compile('<Delay D="([0-9]+)"/>')
FORCE = re.compile("<FT " + " ".join(f'{tag}="{NUMBER}"' for tag in ("FX", "FY", "FZ", "TX", "TY", "TZ")) + "/>")
HOLDING = re.compile('<GPIO 01="([01])"/>')


def receive():
    text, peer = link.recvfrom(1024)
    text = text.decode()
    assert text.startswith('<Rob Type="KUKA"><RIst X="'), text
    return [float(v) for v in AXES.search(text).groups()], int(IPOC.search(text).group(1)), int(DELAY.search(text).group(1)), peer, text


def answer(peer, ipoc, correction, stop=0, gripper=None):
    gpio = "" if gripper is None else f'<GPIO 01="{gripper}"/>'
    text = (f'<Sen Type="{a.sentype}"><Stop>{stop}</Stop><AK A1="{correction:.6f}" A2="0.000000" A3="0.000000" A4="0.000000" '
            f'A5="0.000000" A6="0.000000"/>{gpio}<IPOC>{ipoc}</IPOC></Sen>')
    if a.fault == "malformed":
        text = text[:-7]
    link.sendto(text.encode(), peer)


changes = [int(at) for at in a.gripper.split(",") if at]
silent = [int(v) for v in a.fault.split(":")[1:]] if a.fault.startswith("silent") else [0, 0]
axes, ipoc, delay, peer, text = receive()
start, first = axes, ipoc
commanded = before = None
worst = 0.0
held = 0
for k in range(a.packets):
    # by IPOC, not by count: a packet that is sent again gets the same answer
    t = (ipoc - first) / 1000.0
    value = a.amplitude * math.sin(2 * math.pi * t / a.period)
    correction = math.radians(value) if a.fault == "radians" else value
    if a.relative:
        earlier = a.amplitude * math.sin(2 * math.pi * (t - 0.004) / a.period) if t > 0 else 0.0
        correction = value - earlier
    gripper = None if not changes else sum(k >= at for at in changes) % 2
    if not silent[0] <= k < silent[0] + silent[1]:
        answer(peer, ipoc + 1 if a.fault == "ipoc" else ipoc, correction, 0, gripper)
        if a.fault == "twice":
            answer(peer, ipoc, correction + 1.0, 0, gripper)
    last = ipoc
    axes, ipoc, delay, peer, text = receive()
    while ipoc == last:
        answer(peer, ipoc, correction, 0, gripper)
        axes, ipoc, delay, peer, text = receive()
    worst = max(worst, abs(axes[0] - start[0] - value), max(abs(x - y) for x, y in zip(axes[1:], start[1:])))
    found = HOLDING.search(text)
    held += found is not None and found.group(1) == "1"
if not a.no_stop:
    answer(peer, ipoc, 0.0, 1)
print(json.dumps({"packets": a.packets, "worst_deg": worst, "delay": delay, "ms": ipoc - first, "held": held,
                  "start": start, "end": axes,
                  "force": [float(v) for v in FORCE.search(text).groups()] if FORCE.search(text) else None}), flush=True)
