#!/usr/bin/env python3
"""A ladder program (LinuxCNC's ClassicLadder over Modbus) as the only sequencer of the line of config/scenarios/line.yaml.

    tests/soak/plc.py BIN CONFIG [--minutes M] [--parts N] [--factor F]

Runs for M minutes of wall time (5), or until N parts have left the line (then without another end), F times as fast as wall time
(6). Prints how many parts were released, removed, and are on the line; what the server answered to the PLC; and the memory of the
server after the first minute and at the end. Exit code 1: a part is lost (released, and neither removed nor on a belt, the tray or in the gripper), no
part leaves for 180 s of simulated time, or a program ends.
"""
import argparse
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support" / "programs"))
from ports import free_ports  # noqa: E402

PLACES = ["a_x_m=0.1", "a_y_m=0", "b_x_m=0.55", "b_y_m=0", "height_m=0.255", "lift_m=0.12"]  # of the robot's program
LOWEST_M = 0.2  # belts and tray are at 0.25 m
STUCK_S = 180.0
PATIENCE_S = 120
EVERY_S = 10


class Failure(Exception):
    pass


class Line:
    def __init__(self, bin_folder, config, folder):
        self.bin, self.config, self.folder = bin_folder, config, folder
        self.cell = ["--cell", f"plc_{os.getpid()}", "--domain", str(random.randint(1, 100))]
        self.children = {}
        self.port = free_ports(1)[0]
        mapping = (config / "plc" / "line_modbus.yaml").read_text()
        mapping, count = re.subn(r"port: 5020", f"port: {self.port}", mapping)
        assert count == 1
        (folder / "map.yaml").write_text(mapping)

    def begin(self, factor):
        config, folder = self.config, self.folder
        self.start("server", self.bin / "takt-server", config / "scenarios" / "line.yaml", "--paused", "--factor", str(factor), *self.cell)
        self.takt("--timeout", str(PATIENCE_S), "status")
        self.start("robot", self.bin / "takt-controller", config / "plc" / "carry.lua", "--pace", "realtime",
                   *[word for place in PLACES for word in ("--set", place)], *self.cell)
        self.start("gateway", self.bin / "takt-modbus", folder / "map.yaml", "--start", *self.cell)
        self.wait("gateway", "Listens")
        subprocess.run([sys.executable, "-B", config / "plc" / "ladder.py", config / "plc" / "line.ladder", folder / "plc",
                        "--port", str(self.port)], check=True, stdout=subprocess.DEVNULL)
        folder.chmod(0o755)  # halrun gives up its privileges
        self.start("ladder", folder / "plc" / "run.sh")
        self.wait("ladder", "The PLC runs")

    def log(self, name):
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def start(self, name, *command):
        with open(self.folder / f"{name}.log", "w") as out:
            self.children[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)

    def wait(self, name, words):
        deadline = time.monotonic() + PATIENCE_S
        while words not in self.log(name):
            if self.children[name].poll() is not None or time.monotonic() > deadline:
                raise Failure(f"{name} is not ready")
            time.sleep(0.1)

    def takt(self, *words):
        return subprocess.run([self.bin / "takt", *self.cell, *words], check=True, capture_output=True, text=True).stdout

    def memory_kB(self):
        text = Path(f"/proc/{self.children['server'].pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text)[1])

    def counts(self):
        """Of one instant: time, released, removed, on the line; names of lost parts."""
        state = json.loads(self.takt("state", "--json"))
        signals = {name: device["signals"] for name, device in state["devices"].items()}
        boxes = {name: part for name, part in state["components"].items() if name.startswith("Boxes_") and part["state"] != "parked"}
        lost = [name for name, part in boxes.items() if part["position"]["z"] < LOWEST_M]
        return state["time"], round(signals["Feeder"]["released"]), round(signals["Outlet"]["removed"]), len(boxes) - len(lost), lost

    def run(self, seconds, parts):
        begin, first_kB = time.monotonic(), None
        newest, newest_s = 0, 0.0
        while True:
            time.sleep(EVERY_S)
            ended = [name for name, child in self.children.items() if child.poll() is not None]
            if ended:
                raise Failure(f"{', '.join(ended)} has ended")
            time_s, released, removed, present, lost = self.counts()
            print(f"{time_s:9.1f} s: {released} released, {removed} removed, {present} on the line, {released - removed - present} lost", flush=True)
            if lost or released != removed + present:
                raise Failure(f"lost: {', '.join(lost) or 'parts that are nowhere'}")
            if removed > newest:
                newest, newest_s = removed, time_s
            elif time_s - newest_s > STUCK_S:
                raise Failure(f"no part has left the line for {time_s - newest_s:.0f} s")
            if first_kB is None and time.monotonic() - begin > 60:
                first_kB = self.memory_kB()
            if time.monotonic() - begin > seconds or removed >= parts:
                break
        last_kB = self.memory_kB()
        status = json.loads(self.takt("status", "--json"))
        print(f"server: {first_kB or last_kB} kB after the first minute, {last_kB} kB at the end; real-time factor {status['real_time_factor']:.2f}")

    def stop(self):
        if self.children.get("ladder") and self.children["ladder"].poll() is None:
            subprocess.run([self.folder / "plc" / "stop.sh"], check=False)
            self.end("ladder")
        for name in ("gateway", "robot", "server"):
            if name in self.children:
                self.children[name].terminate()
                self.end(name)

    def end(self, name):
        try:
            self.children[name].wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.children[name].kill()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin", type=Path)
    parser.add_argument("config", type=Path)
    parser.add_argument("--minutes", type=float, help="of wall time (5, with --parts without end)")
    parser.add_argument("--parts", type=int, help="end when so many have left the line")
    parser.add_argument("--factor", type=float, default=6.0, help="simulated per wall time")
    arguments = parser.parse_args()
    if not Path("/usr/bin/halrun").exists() or not Path("/usr/bin/mb2hal").exists():
        sys.exit("soak plc: needs the soft PLC: apt-get install --no-install-recommends linuxcnc-uspace")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("soak plc: ended from outside"))  # the PLC ends with it
    with tempfile.TemporaryDirectory() as temporary:
        folder, failure = Path(temporary), ""
        line = Line(arguments.bin.resolve(), arguments.config.resolve(), folder)
        try:
            line.begin(arguments.factor)
            line.run(60 * (arguments.minutes or (5 if arguments.parts is None else math.inf)), arguments.parts or math.inf)
        except (Failure, subprocess.CalledProcessError) as error:
            failure = str(error)
        finally:
            line.stop()
        figures = re.search(r"\d+ requests of .*", line.log("gateway")) if "gateway" in line.children else None
        if figures:
            print(f"Modbus: {figures[0]}")
        if failure:
            for log in sorted(folder.glob("*.log")):
                print(f"--- {log.name}\n{log.read_text(errors='replace')[-1500:]}")
            sys.exit(f"soak plc: {failure}")


if __name__ == "__main__":
    main()
