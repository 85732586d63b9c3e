#!/usr/bin/env python3
"""How late gateways answer, beside a bare echo on loopback.

    tests/performance/gateways.py BIN CONFIG [SECONDS [STREAM_SECONDS]]

A cell at the pace realtime with takt-rsi and takt-egm as followers of one robot each and takt-ur for the first one. This
program is the other side: it sends in the cycle of each protocol and measures the time to the answer. An echo in a process of
its own answers as many messages of the same size over the same kind of socket. Then takt-ur streams data at 500 Hz, and
a bare sender beside it. Prints a table in microseconds, and the overruns of the cell during the stream.
"""

import json
import selectors
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support" / "programs"))
import egm_wire  # noqa: E402
from ports import free_ports  # noqa: E402

PATIENCE_S = 60
UDP_ECHO = "import socket\ns=socket.socket(socket.AF_INET,socket.SOCK_DGRAM)\ns.bind(('127.0.0.1',{0}))\nprint('RTDE at Listens',flush=True)\n" \
           "while True:\n d,p=s.recvfrom(4096)\n s.sendto(d,p)\n"
TCP_ECHO = "import socket\nl=socket.create_server(('127.0.0.1',{0}))\nprint('RTDE at Listens',flush=True)\nc=l.accept()[0]\n" \
           "c.setsockopt(socket.IPPROTO_TCP,socket.TCP_NODELAY,1)\nwhile d:=c.recv(4096): c.sendall(d)\n"
# As many bytes as a data package of the stream.
TCP_SENDER = "import socket,time\nl=socket.create_server(('127.0.0.1',{0}))\nprint('RTDE at Listens',flush=True)\nc=l.accept()[0]\n" \
             "c.setsockopt(socket.IPPROTO_TCP,socket.TCP_NODELAY,1)\ndue=time.monotonic()\nwhile True:\n due+=0.002\n" \
             " time.sleep(max(0,due-time.monotonic()))\n c.sendall(bytes(108))\n"
XML = """<ROOT><CONFIG><IP_NUMBER>127.0.0.1</IP_NUMBER><PORT>{port}</PORT><SENTYPE>takt</SENTYPE><ONLYSEND>FALSE</ONLYSEND></CONFIG>
<SEND><ELEMENTS><ELEMENT TAG="DEF_AIPos" TYPE="DOUBLE" INDX="INTERNAL"/></ELEMENTS></SEND>
<RECEIVE><ELEMENTS><ELEMENT TAG="OPEN" TYPE="BOOL" INDX="1" HOLDON="1"/></ELEMENTS></RECEIVE></ROOT>"""


class Programs:
    def __init__(self, folder):
        self.folder, self.children = folder, []

    def start(self, name, command, words):
        log = self.folder / f"{name}.log"
        with open(log, "w") as out:
            child = subprocess.Popen([str(word) for word in command], stdout=out, stderr=subprocess.STDOUT)
        self.children.append(child)
        deadline = time.monotonic() + PATIENCE_S
        while not any(word in log.read_text() for word in words):
            if child.poll() is not None or time.monotonic() > deadline:
                sys.exit(f"{name}: {log.read_text()}")
            time.sleep(0.05)

    def end(self):
        for child in reversed(self.children):
            child.terminate()
        for child in self.children:
            child.wait(timeout=PATIENCE_S)


def paced(count, period_s, exchange):
    """Times of `count` exchanges, one in each period."""
    times = []
    begin = time.monotonic()
    for k in range(count):
        due = begin + k * period_s
        if (left := due - time.monotonic()) > 0:
            time.sleep(left)
        sent = time.monotonic()
        exchange(k)
        times.append(time.monotonic() - sent)
    return times


def row(name, times, missing=0):
    ordered = sorted(times)
    at = [1e6 * ordered[min(len(ordered) - 1, int(share * len(ordered)))] for share in (0.5, 0.99, 1.0)]
    print(f"{name:44} {at[0]:9.0f} {at[1]:9.0f} {at[2]:9.0f}   {missing}", flush=True)


def udp_row(name, port, messages, period_s):
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", 0))
    link.settimeout(0.5)
    missing = 0

    def exchange(k):
        nonlocal missing
        link.sendto(messages[k], ("127.0.0.1", port))
        try:
            link.recv(4096)
        except TimeoutError:
            missing += 1

    row(name, paced(len(messages), period_s, exchange), missing)


def tcp_row(name, port, message, count, period_s):
    link = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
    link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def exchange(_):
        link.sendall(message)
        link.recv(4096)

    row(name, paced(count, period_s, exchange))


def subscribed_to_rtde(port):
    link = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
    stream = link.makefile("rb")

    def ask(kind, payload):
        link.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)
        size, _ = struct.unpack(">HB", stream.read(3))
        return stream.read(size - 3)

    ask("V", struct.pack(">H", 2))
    ask("O", struct.pack(">d", 500.0) + b"timestamp,actual_q,target_q")
    ask("S", b"")
    return link


def streams(rtde, sender, seconds, status):
    """Intervals between packages of 108 bytes at 500 Hz, of takt-ur and of a bare sender, over the same time."""
    rows = {"a bare sender: from message to message": socket.create_connection(("127.0.0.1", sender), timeout=PATIENCE_S),
            "RTDE at 500 Hz: from package to package": subscribed_to_rtde(rtde)}
    before = status()
    arrivals, left = {name: [] for name in rows}, dict.fromkeys(rows, 0)
    with selectors.DefaultSelector() as selector:
        for name, link in rows.items():
            selector.register(link, selectors.EVENT_READ, name)
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            for key, _ in selector.select(timeout=end - now):
                size = left[key.data] + len(key.fileobj.recv(65536))
                arrivals[key.data] += [time.monotonic()] * (size // 108)
                left[key.data] = size % 108
    after = status()
    late = next(g["late"] for g in after["gateways"].values()) - next(g["late"] for g in before["gateways"].values())
    for name, stamps in arrivals.items():
        row(name, [b - a for a, b in zip(stamps, stamps[1:])],
            late if "RTDE" in name else max(0, round((stamps[-1] - stamps[0]) / 0.002) + 1 - len(stamps)))
    for link in rows.values():
        link.close()
    steps, overruns = (after[key] - before[key] for key in ("step", "overruns"))
    print(f"the cell beside the streams: {steps} steps in {seconds:.0f} s, {overruns} overruns "
          f"({1000 * overruns / steps:.2f} of 1000; at most {after['max_consecutive_overruns']} in a row)")


def main():
    bin_folder, config = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 10.0
    stream_seconds = float(sys.argv[4]) if len(sys.argv) > 4 else seconds
    name, domain = f"gateways_{free_ports(1)[0]}", str(100 + int(time.time()) % 90)
    here = ["--cell", name, "--domain", domain]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        programs = Programs(folder)
        try:
            rtde, primary, secondary, realtime, dashboard = free_ports(5)
            rsi, egm = free_ports(2, socket.SOCK_DGRAM)
            folder.joinpath("rsi.xml").write_text(XML.format(port=rsi))
            folder.joinpath("rsi.yaml").write_text(
                "takt_rsi: 1\nrole: sensor_pc\nrobot: Robot2\nconfiguration: rsi.xml\n"
                "inputs: {OPEN: {gripper: Gripper2, is: closed, inverted: true}}\n")
            folder.joinpath("egm.yaml").write_text(
                f"takt_egm: 1\nrole: sensor\nrobot: Robot2\nport: {egm}\ninputs: {{digital: {{gripper: Gripper2, is: closed}}}}\n")
            folder.joinpath("ur.yaml").write_text(
                f"takt_ur: 1\nrobot: Robot1\ntool: Gripper1\nlisten: {{rtde: {rtde}, primary: {primary}, "
                f"secondary: {secondary}, realtime: {realtime}, dashboard: {dashboard}}}\n")
            programs.start("server", [bin_folder / "takt-server", config / "scenarios/block_assembly.yaml", *here, "--paused"], ["ready"])
            programs.start("ur", [bin_folder / "takt-ur", folder / "ur.yaml", *here, "--start"], ["RTDE at"])
            count = int(seconds / 0.004)
            robot = "34.7269 -64.8474 -122.0629 -83.0903 90.0002 -55.2732".split()
            axes = " ".join(f'A{i + 1}="{value}"' for i, value in enumerate(robot))
            packets = [f'<Rob Type="KUKA"><AIPos {axes}/><IPOC>{4208163634 + 4 * k}</IPOC></Rob>'.encode() for k in range(count)]
            states = [egm_wire.robot(k, [float(value) for value in robot], 1000 + 4 * k) for k in range(count)]
            version = struct.pack(">HBH", 5, ord("V"), 2)
            echo = free_ports(1, socket.SOCK_DGRAM)[0]
            programs.start("udp", [sys.executable, "-c", UDP_ECHO.format(echo)], ["Listens"])
            print(f"{'answers, µs':44} {'median':>9} {'99 %':>9} {'largest':>9}   missing")
            udp_row("echo over UDP", echo, packets, 0.004)
            programs.start("rsi", [bin_folder / "takt-rsi", folder / "rsi.yaml", *here], ["Listens"])
            udp_row("RSI: packet to answer, each 4 ms", rsi, packets, 0.004)
            programs.children.pop().terminate()
            programs.start("egm", [bin_folder / "takt-egm", folder / "egm.yaml", *here], ["Listens"])
            udp_row("EGM: message to answer, each 4 ms", egm, states, 0.004)
            programs.children.pop().terminate()
            echo = free_ports(1)[0]
            programs.start("tcp", [sys.executable, "-c", TCP_ECHO.format(echo)], ["Listens"])
            tcp_row("echo over TCP", echo, version, 2 * count, 0.002)
            tcp_row("RTDE: request to answer, each 2 ms", rtde, version, 2 * count, 0.002)
            sender = free_ports(1)[0]
            programs.start("sender", [sys.executable, "-c", TCP_SENDER.format(sender)], ["Listens"])

            def status():
                return json.loads(subprocess.run([bin_folder / "takt", *here, "--json", "status"], check=True,
                                                 capture_output=True, text=True).stdout)

            streams(rtde, sender, stream_seconds, status)
        finally:
            subprocess.run([bin_folder / "takt", *here, "quit"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            programs.end()


if __name__ == "__main__":
    main()
