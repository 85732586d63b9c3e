"""One row for each hostile act against a running cell: answer of the cell, memory, missed ticks.

Each script hostile_NAME.py restarts itself in namespaces of its own (mounts, network, IPC): nothing that it breaks is
seen by other programs of the machine.
"""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

IN_NAMESPACE = "TAKT_DRILL_NAMESPACE"


def isolate(shared_memory_MB=256):
    """Continues in namespaces of its own, with a /dev/shm of its own; without the right to make them the drill ends."""
    if os.environ.get(IN_NAMESPACE):
        return
    os.environ[IN_NAMESPACE] = "1"
    setup = f"mount -t tmpfs -o size={shared_memory_MB}m tmpfs /dev/shm && ip link set lo up && exec \"$@\""
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    os.execvp("unshare", ["unshare", *user, "--mount", "--net", "--ipc", "--propagation", "private", "bash", "-c",
                          setup, "drill", sys.executable, *sys.argv])


class Drill:
    def __init__(self, name, programs, config):
        self.name, self.programs, self.config = name, os.path.abspath(programs), os.path.abspath(config)
        self.domain, self.failed, self.children = 3, False, []
        self.folder = tempfile.TemporaryDirectory(prefix="takt-drill-")
        print(f"{'drill':44} {'answer':58} {'MB before':>9} {'after':>6} {'missed':>8}  ok", flush=True)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def start(self, program, *arguments, prefix=(), environment=None, log="log"):
        command = [*prefix, f"{self.programs}/{program}", *arguments]
        settings = {**os.environ, "TAKT_DOMAIN": str(self.domain), **(environment or {})}
        out = open(self.path(log), "ab")
        child = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT, env=settings, start_new_session=True)
        out.close()
        self.children.append(child)
        return child

    def server(self, *arguments, scenario="block_assembly.yaml", **settings):
        """A server that plays in real time, once it answers."""
        self.domain += 1
        child = self.start("takt-server", f"{self.config}/scenarios/{scenario}", *arguments, **settings)
        return child if self.status(40) else None

    def takt(self, *arguments, limit=30):
        """Exit code and text of a command; -1 if it does not end."""
        settings = {**os.environ, "TAKT_DOMAIN": str(self.domain)}
        try:
            done = subprocess.run([f"{self.programs}/takt", *arguments], capture_output=True, text=True, timeout=limit,
                                  env=settings, errors="replace")
            return done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired:
            return -1, "no end"

    def status(self, patience_s=20):
        """Status of the cell as a dictionary; None if it does not answer for so long."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            code, text = self.takt("--timeout", "5", "--json", "status")
            if code == 0:
                return json.loads(text)
        return None

    @staticmethod
    def ends_within(child, seconds):
        """Whether the program ends within so long; an act that lasts for some time ends with its server."""
        try:
            child.wait(seconds)
            return True
        except subprocess.TimeoutExpired:
            return False

    def hears(self, child, log, patience_s):
        """Whether this program prints more within so long."""
        size, end = os.path.getsize(self.path(log)), time.monotonic() + patience_s
        while time.monotonic() < end:
            if self.ends_within(child, 0.1):
                return False
            if os.path.getsize(self.path(log)) > size:
                return True
        return False

    @staticmethod
    def memory_MB(child):
        try:
            with open(f"/proc/{child.pid}/status") as file:
                return int(re.search(r"VmRSS:\s+(\d+)", file.read()).group(1)) / 1024
        except (OSError, AttributeError):
            return 0.0

    def log(self, name="log"):
        with open(self.path(name), errors="replace") as file:
            return file.read()

    def row(self, name, answer, ok, before_MB=None, after_MB=None, missed=""):
        def number(value):
            return "" if value is None else f"{value:.1f}"
        self.failed |= not ok
        print(f"{name:44} {answer:58} {number(before_MB):>9} {number(after_MB):>6} {missed:>8}  "
              f"{'yes' if ok else 'NO'}", flush=True)

    def served_on(self, name, child, act, growth_MB=16, note=""):
        """Runs act() against a server that plays, and says whether it still serves with flat memory."""
        before = self.status()
        before_MB = self.memory_MB(child)
        act()
        first = self.status()
        after = self.status()
        after_MB = self.memory_MB(child)
        if child.poll() is not None or first is None:
            self.row(name, f"the server ended ({end_of(child)})" if child.poll() is not None else
                     "the server does not answer", False, before_MB)
        elif before is None or after is None:
            self.row(name, "the server does not answer", False, before_MB, after_MB)
        else:
            plays = after["step"] > first["step"] and after["state"] == "playing"
            # A scenario that was loaded, or a server that was started again, counts from the start.
            since = before if after["step"] > before["step"] and after["overruns"] >= before["overruns"] else None
            steps = after["step"] - (since["step"] if since else 0)
            missed = 100 * (after["overruns"] - (since["overruns"] if since else 0)) / max(1, steps)
            flat = after_MB - before_MB < growth_MB
            answer = ("served on" if plays else "stands still") + (note and f"; {note}") + ("" if flat else "; grows")
            self.row(name, answer, plays and flat, before_MB, after_MB, f"{missed:.2f} %")
        return after

    def end(self, child, patience_s=20):
        if child is None:
            return
        for number in (signal.SIGCONT, signal.SIGTERM, signal.SIGKILL):
            if child.poll() is not None:
                return
            os.kill(child.pid, number)
            self.ends_within(child, 0.1 if number == signal.SIGCONT else patience_s)

    def finish(self):
        for child in self.children:
            self.end(child)
        self.folder.cleanup()
        sys.exit(1 if self.failed else 0)


def end_of(child):
    code = child.poll()
    return f"signal {-code}" if code is not None and code < 0 else f"exit {code}"
