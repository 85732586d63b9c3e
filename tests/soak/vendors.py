#!/usr/bin/env python3
"""The block assembly by two vendors' protocols: Robot1 by Universal Robots' external control (servoj), Robot2 by KUKA RSI.

    tests/soak/vendors.py BIN CONFIG [--runs N] [--factor F | --rsi] [LEVEL ...]

The set-points are those of the scenario's own program, taken from a run of takt-run, so that the end is known; `takt check`
compares the Parts with the scenario's expected poses. The cell waits for both protocols (--lockstep), and all runs of a level
end with the same state hash. With --rsi both robots are commanded by KUKA RSI.
With --factor the cell runs at the pace realtime, F times as fast as wall time. At level 3 that is a test of the machine: a robot
that misses set-points for 10 ms at 0.3 m/s catches up with more than 10 m/s^2, and Parts slide in their seats, which leave 0.5 mm
on each side, from 0.3 g on.
Exit code 0 when all levels (1 and 3) end as expected.
"""

import argparse
import csv
import math
import os
import random
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support" / "programs"))
from ports import free_ports  # noqa: E402

SCALE = 1000000
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
RSI_PERIOD_S = 0.004
RTDE_INPUT = "input_double_register_24"
PATIENCE_S = 60
ROUNDING_S = 1e-6
UR_ZERO_S = 100.0  # of the time stamps of takt-ur
BEGIN_S = 3.0  # of the course, after the gateways have seen that the cell plays


class Course:
    """Joint positions and commanded widths of one robot over the time of the cell."""

    def __init__(self, rows, robot, gripper, period_s):
        self.period_s = period_s
        self.joints = [[float(row[f"robots.{robot}.position.{joint}_joint"]) for joint in JOINTS] for row in rows]
        self.widths = [float(row[f"grippers.{gripper}.width"]) for row in rows]
        closed = [row[f"grippers.{gripper}.closed"] in ("1", "true") for row in rows]
        # While the jaws are open, the width that they come to; closed is width 0.
        target = self.widths[-1]
        for i in reversed(range(len(rows))):
            if closed[i]:
                self.widths[i] = 0.0
                target = None
            else:
                target = self.widths[i] if target is None else target
                self.widths[i] = target

    def at(self, t):
        """Joints (linear between rows) and width."""
        place = min(max(t / self.period_s, 0.0), len(self.joints) - 1.0)
        low = min(int(place), len(self.joints) - 2)
        share = place - low
        joints = [(1 - share) * a + share * b for a, b in zip(self.joints[low], self.joints[low + 1])]
        return joints, self.widths[round(place)]

    @property
    def duration_s(self):
        return self.period_s * (len(self.joints) - 1)


class PacketClock:
    """Time of the course by the packets of RSI: it begins `begin_s` after the first one."""

    def __init__(self, begin_s=0.0):
        self.first, self.begin_s = None, begin_s

    def packet(self, ipoc):
        self.first = ipoc if self.first is None else self.first
        return (ipoc - self.first) / 1000 - self.begin_s


def rsi_link():
    """A socket, and its port."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", 0))
    link.settimeout(PATIENCE_S)
    return link, link.getsockname()[1]


def rsi_program(link, course, clock, over):
    """Answers each packet of the KRC with absolute corrections, until over(time of the course)."""
    start = course.at(0)[0]
    while True:
        try:
            packet, controller = link.recvfrom(1024)
        except TimeoutError:
            return  # the run sees the end of this thread, unless it has ended itself
        ipoc = int(re.search(rb"<IPOC>(\d+)</IPOC>", packet).group(1))
        t = clock.packet(ipoc)
        joints, width = course.at(t + RSI_PERIOD_S)
        corrections = " ".join(f'A{i + 1}="{math.degrees(q - s):.6f}"' for i, (q, s) in enumerate(zip(joints, start)))
        stop = int(over(t))
        link.sendto((f'<Sen Type="takt"><Stop>{stop}</Stop><AK {corrections}/><WIDTH>{width:.6f}</WIDTH>'
                     f"<IPOC>{ipoc}</IPOC></Sen>").encode(), controller)
        if stop:
            return


class UrDriver:
    """External control as a driver does it, and one RTDE input register for the gripper."""

    def __init__(self, rtde_port, primary_port):
        self.rtde = socket.create_connection(("127.0.0.1", rtde_port), timeout=PATIENCE_S)
        assert self.ask("V", struct.pack(">H", 2)) == b"\1"
        recipe = self.ask("I", RTDE_INPUT.encode())
        assert recipe[0] != 0, recipe
        self.recipe = recipe[:1]
        assert self.ask("O", struct.pack(">d", 500.0) + b"timestamp")[0] != 0
        assert self.ask("S") == b"\1"
        self.buffer = b""
        listeners = {}
        lines = ["def externalControl():", f"MULT_jointstate = {SCALE}", f"MULT_time = {SCALE}",
                 'socket_send_int(TRAJECTORY_RESULT_CANCELED, "trajectory_socket")']
        for name in ("trajectory_socket", "script_command_socket", "reverse_socket"):
            listeners[name] = socket.create_server(("127.0.0.1", 0))
            listeners[name].settimeout(PATIENCE_S)
            lines.append(f'connect_socket_with_retry("127.0.0.1", {listeners[name].getsockname()[1]}, "{name}")')
        lines += ["# NODE_CONTROL_LOOP_ENDS", "end", ""]
        self.primary = socket.create_connection(("127.0.0.1", primary_port), timeout=PATIENCE_S)
        self.primary.sendall("\n".join(lines).encode())
        self.sockets = {name: listener.accept()[0] for name, listener in listeners.items()}
        for link in (self.rtde, *self.sockets.values()):
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        threading.Thread(target=self.drain, args=(self.primary,), daemon=True).start()

    @staticmethod
    def drain(link):
        link.settimeout(None)
        try:
            while link.recv(65536):
                pass
        except OSError:
            pass

    def ask(self, kind, payload=b""):
        self.rtde.sendall(struct.pack(">HB", 3 + len(payload), ord(kind)) + payload)
        while True:
            head = self.exactly(3)
            content = self.exactly(struct.unpack(">H", head[:2])[0] - 3)
            if chr(head[2]) == kind:
                return content

    def exactly(self, size):
        received = b""
        while len(received) < size:
            part = self.rtde.recv(size - len(received))
            assert part, "the controller has closed the connection"
            received += part
        return received

    def newest_time_s(self):
        """Waits for data packages; the time of the newest, which is the cell's."""
        found = None
        while found is None:
            received = self.rtde.recv(65536)
            assert received, "takt-ur has closed the connection"
            self.buffer += received
            while len(self.buffer) >= 3 and len(self.buffer) >= (size := struct.unpack(">H", self.buffer[:2])[0]):
                if self.buffer[2:3] == b"U":
                    found = struct.unpack(">d", self.buffer[4:12])[0]
                self.buffer = self.buffer[size:]
        return found

    def servo(self, joints):
        self.sockets["reverse_socket"].sendall(struct.pack(">8i", 5000, *(round(SCALE * q) for q in joints), 1))

    def width(self, width_m):
        payload = self.recipe + struct.pack(">d", width_m)
        self.rtde.sendall(struct.pack(">HB", 3 + len(payload), ord("U")) + payload)

    def stop(self):
        self.sockets["reverse_socket"].sendall(struct.pack(">8i", 0, *[0] * 6, -2))


def cell_of_its_own():
    """Options of a cell that no other process uses: its domain's first port is free."""
    while True:
        domain = random.randint(1, 100)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7400 + 250 * domain))
            except OSError:
                continue
        return ["--cell", f"vendors_{os.getpid()}", "--domain", str(domain)]


def scenario_of(config, level, folder):
    """At level 3 with steps of the protocols' cycle. Jaws hold by friction there: the run of takt-run itself ends 0.2 mm from the
    drawing."""
    scenario = config / "scenarios" / "block_assembly.yaml"
    if level < 3:
        return scenario
    text = scenario.read_text().replace("../", f"{config}/")
    for pattern, by in ((r"contact: \{step_s: [^}]*\}", "contact: {step_s: 0.002}"), (r"tolerance_m: 0\.\d+", "tolerance_m: 0.001")):
        text, count = re.subn(pattern, by, text)
        assert count == 1, pattern
    (folder / "level_3.yaml").write_text(text)
    return folder / "level_3.yaml"


def rsi_mapping(folder, number, port):
    """The files of takt-rsi for RobotN and GripperN."""
    elements = "".join(f'<ELEMENT TAG="AK.A{i}" TYPE="DOUBLE" INDX="{i + 1}" HOLDON="1"/>' for i in range(1, 7))
    folder.joinpath(f"rsi_{number}.xml").write_text(
        f"<ROOT><CONFIG><IP_NUMBER>127.0.0.1</IP_NUMBER><PORT>{port}</PORT><SENTYPE>takt</SENTYPE><ONLYSEND>FALSE</ONLYSEND>"
        '</CONFIG><SEND><ELEMENTS><ELEMENT TAG="DEF_AIPos" TYPE="DOUBLE" INDX="INTERNAL"/></ELEMENTS></SEND><RECEIVE><ELEMENTS>'
        f'<ELEMENT TAG="Stop" TYPE="BOOL" INDX="1" HOLDON="0"/>{elements}'
        '<ELEMENT TAG="WIDTH" TYPE="DOUBLE" INDX="8" HOLDON="1"/></ELEMENTS></RECEIVE></ROOT>')
    mapping = folder / f"rsi_{number}.yaml"
    mapping.write_text(
        f"takt_rsi: 1\nrole: controller\nrobot: Robot{number}\ntool: Gripper{number}\nconfiguration: rsi_{number}.xml\n"
        "cycle_ms: 4\ncorrections: absolute\ntime: simulated\ntimeout_packets: 100000\n"
        f"outputs:\n  WIDTH: {{gripper: Gripper{number}, as: width}}\n")
    return mapping


def run(bin_folder, config, level, courses, folder, factor):
    """The state hash at the end, empty at the pace realtime; None where the Parts are elsewhere. `factor` None: in lockstep."""
    rtde, primary, secondary, realtime, dashboard = free_ports(5)
    link, rsi = rsi_link()
    folder.joinpath("ur.yaml").write_text(
        f"takt_ur: 1\nrobot: Robot1\ntool: Gripper1\ntime: simulated\n"
        f"listen: {{address: 127.0.0.1, rtde: {rtde}, primary: {primary}, secondary: {secondary}, realtime: {realtime}, "
        f"dashboard: {dashboard}}}\noutputs:\n  {RTDE_INPUT}: {{gripper: Gripper1, as: width}}\n")
    mapping = rsi_mapping(folder, 2, rsi)
    here = cell_of_its_own()
    scenario = scenario_of(config, level, folder)
    takt = [bin_folder / "takt", *here]
    logs = {part: open(folder / f"{part}_{level}.log", "w") for part in ("server", "ur", "rsi")}
    children = [subprocess.Popen([bin_folder / "takt-server", scenario, *here, "--lod", str(level), "--paused",
                                  *([] if factor is None else ["--factor", str(factor)])],
                                 stdout=logs["server"], stderr=subprocess.STDOUT)]
    done = threading.Event()
    try:
        end_s = courses[0].duration_s + 1.0
        over = (lambda t: done.is_set()) if factor is not None else (lambda t: t >= end_s)
        program = threading.Thread(target=rsi_program, daemon=True, args=(link, courses[1], PacketClock(BEGIN_S), over))
        program.start()
        subprocess.run([*takt, "--timeout", "60", "status"], check=True, stdout=subprocess.DEVNULL)
        # Both begin while the cell is paused, so that their times are the cell's, and one course does not lag behind the other.
        for part, file, words in (("ur", folder / "ur.yaml", "RTDE at"), ("rsi", mapping, "RSI is on")):
            children.append(subprocess.Popen([bin_folder / f"takt-{part}", file, *here, *["--lockstep"] * (factor is None)], stdout=logs[part],
                                             stderr=subprocess.STDOUT))
            wait_for_text(folder / f"{part}_{level}.log", words, children[-1])
        driver = UrDriver(rtde, primary)
        time.sleep(1)  # takt-ur has seen the sockets: each run begins with the same cycle
        subprocess.run([*takt, "play"], check=True, stdout=subprocess.DEVNULL)
        width, sent_s = None, -BEGIN_S
        while (t := driver.newest_time_s() - UR_ZERO_S - BEGIN_S) < end_s:
            if not program.is_alive() and t < end_s - RSI_PERIOD_S:
                sys.exit(f"level {level}: the KRC sends no packets: {(folder / f'rsi_{level}.log').read_text()[-1500:]}")
            while sent_s < t - ROUNDING_S:  # a controller ignores jumps, so that set-points of cycles without a package are sent too
                sent_s = min(t, sent_s + 0.002)
                joints, wanted = courses[0].at(sent_s + 0.002)
                if wanted != width:
                    driver.width(wanted)
                    width = wanted
                driver.servo(joints)
        status = subprocess.run([*takt, "status"], capture_output=True, text=True, check=True).stdout
        done.set()
        state_hash = ""
        if factor is None:
            driver.stop()
            children[2].wait(timeout=PATIENCE_S)
            state_hash = re.search(r"Ends at [\d.]+ s of simulated time, state hash (\w+)", (folder / f"rsi_{level}.log").read_text())[1]
        subprocess.run([*takt, "pause"], check=True, stdout=subprocess.DEVNULL)
        check = subprocess.run([*takt, "check", scenario], capture_output=True, text=True)
        driver.stop()
        print(f"level {level}: {'as expected' if check.returncode == 0 else 'NOT as expected'} {state_hash}")
        print("\n".join("  " + line for line in check.stdout.splitlines()[-6:]))
        print("\n".join("  " + line.strip() for line in status.splitlines() if re.search("real-time|overrun|commands", line)), flush=True)
        return state_hash if check.returncode == 0 else None
    finally:
        end(takt, children)
        for log in logs.values():
            log.close()


def end(takt, children):
    """Ends the server, and the others with it."""
    subprocess.run([*takt, "quit"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    for child in reversed(children):
        try:
            child.wait(timeout=20)
        except subprocess.TimeoutExpired:
            child.kill()


def run_in_lockstep(bin_folder, config, level, courses, folder):
    """The state hash at the end; None where the Parts are elsewhere."""
    here = cell_of_its_own()
    scenario = scenario_of(config, level, folder)
    takt = [bin_folder / "takt", *here]
    links, ports = zip(rsi_link(), rsi_link())
    logs = [folder / f"{part}_{level}.log" for part in ("server", "rsi_1", "rsi_2")]

    def start(log, *command):
        with open(log, "w") as out:
            children.append(subprocess.Popen([*command, *here], stdout=out, stderr=subprocess.STDOUT))

    children = []
    try:
        start(logs[0], bin_folder / "takt-server", scenario, "--lod", str(level), "--paused")
        subprocess.run([*takt, "--timeout", "60", "status"], check=True, stdout=subprocess.DEVNULL)
        end_s = courses[0].duration_s + 1.0
        for course, link in zip(courses, links):
            threading.Thread(target=rsi_program, daemon=True,
                             args=(link, course, PacketClock(), lambda t: t >= end_s)).start()
        # The cell plays when both are registered, so that they begin at the same instant.
        for number, port, log in zip((1, 2), ports, logs[1:]):
            start(log, bin_folder / "takt-rsi", rsi_mapping(folder, number, port), "--name", f"rsi_{number}", "--lockstep",
                  *["--start"] * (number == 2))
            wait_for_text(log, "RSI is on", children[-1])
        codes = [child.wait() for child in children[1:]]
        ends = [re.search(r"Ends at ([\d.]+) s of simulated time, state hash (\w+)", log.read_text()) for log in logs[1:]]
        check = subprocess.run([*takt, "check", scenario], capture_output=True, text=True)
        good = codes == [0, 0] and check.returncode == 0 and None not in ends and ends[0].groups() == ends[1].groups()
        print(f"level {level}, lockstep: {'as expected' if good else 'NOT as expected'}, {[end and end[0] for end in ends]}")
        print("\n".join("  " + line for line in check.stdout.splitlines()[-6:]), flush=True)
        return ends[0][2] if good else None
    finally:
        end(takt, children)


def wait_for_text(log, text, process):
    deadline = time.monotonic() + PATIENCE_S
    while text not in log.read_text():
        if process.poll() is not None or time.monotonic() > deadline:
            sys.exit(f"{log.name}: {log.read_text()}")
        time.sleep(0.05)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=Path)
    parser.add_argument("config", type=Path)
    parser.add_argument("levels", type=int, nargs="*")
    parser.add_argument("--factor", type=float, help="at the pace realtime: simulated per wall time")
    parser.add_argument("--rsi", action="store_true", help="both robots by RSI")
    parser.add_argument("--runs", type=int, default=1, help="of each level")
    arguments = parser.parse_intermixed_args()
    bin_folder, config = arguments.bin.resolve(), arguments.config.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        subprocess.run([bin_folder / "takt-run", "run", config / "scenarios" / "block_assembly.yaml", "--csv", folder / "run.csv",
                        "--csv-period", "0.004", "--quiet"], check=True)
        with open(folder / "run.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        courses = [Course(rows, f"Robot{i}", f"Gripper{i}", 0.004) for i in (1, 2)]
        good = []
        for level in arguments.levels or [1, 3]:
            hashes = {run_in_lockstep(bin_folder, config, level, courses, folder) if arguments.rsi
                      else run(bin_folder, config, level, courses, folder, arguments.factor) for _ in range(arguments.runs)}
            good.append(len(hashes) == 1 and None not in hashes)
            print(f"level {level}: {arguments.runs} runs, state hashes: {hashes}", flush=True)
        if not all(good):
            for log in sorted(folder.glob("*.log")):
                print(f"--- {log.name}\n{log.read_text()[-1500:]}")
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    main()
