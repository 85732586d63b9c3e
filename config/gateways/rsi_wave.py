"""An RSI program without any library: moves the robot by RSI and closes its gripper now and then. To copy.

    python3 config/gateways/rsi_wave.py [PORT] [SECONDS]

It listens for the robot controller, answers each packet with corrections of the axes, and ends RSI with Stop. With a real
KRC it needs the same Ethernet configuration, rsi_gpio_ethernet.xml.
"""
import math
import re
import socket
import sys

port = int(sys.argv[1]) if len(sys.argv) > 1 else 59152
seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0

link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.bind(("0.0.0.0", port))
first = None
while True:
    packet, controller = link.recvfrom(1024)
    ipoc = int(re.search(rb"<IPOC>(\d+)</IPOC>", packet).group(1))  # time stamp of the controller, ms
    if first is None:
        first = ipoc
    t = (ipoc - first) / 1000.0
    rise = min(1.0, t / 2.0, max(0.0, (seconds - t) / 2.0))  # begins and ends at the start position
    wave = math.sin(math.pi * t / 2.0)
    axes = [25.0 * wave, 6.0 * wave, 0.0, 0.0, 15.0 * math.sin(math.pi * t), 40.0 * wave]  # degrees
    corrections = " ".join(f'A{i + 1}="{rise * value:.6f}"' for i, value in enumerate(axes))
    gripper = int(t % 4.0 >= 2.0)
    stop = int(t >= seconds)
    answer = f'<Sen Type="takt"><Stop>{stop}</Stop><AK {corrections}/><GPIO 01="{gripper}"/><IPOC>{ipoc}</IPOC></Sen>'
    link.sendto(answer.encode(), controller)
    if stop:
        print(f"{t:.1f} s of corrections; late packets: {re.search(rb'<Delay D=.(.*?).[/ ]', packet).group(1).decode()}")
        break
