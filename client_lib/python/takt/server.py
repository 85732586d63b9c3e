"""takt-server as a child process, for tests."""

import collections
import ctypes
import itertools
import os
import random
import shutil
import signal
import socket
import subprocess
import threading
from pathlib import Path

_numbers = itertools.count(1)
_prctl = ctypes.CDLL(None).prctl
_PR_SET_PDEATHSIG = 1


class ServerError(RuntimeError):
    """takt-server did not start, or ended with an error; the text is its output."""


def program_path(name):
    """Where one of takt's programs is: in $TAKT_BIN, in the build this package is part of, or on the PATH."""
    for folder in (os.environ.get("TAKT_BIN"), Path(__file__).resolve().parents[2] / "bin"):
        if folder and (Path(folder) / name).is_file():
            return str(Path(folder) / name)
    found = shutil.which(name)
    if found is None:
        raise ServerError(f"{name} was not found: neither in $TAKT_BIN nor in the build nor on the PATH.")
    return found


def _free_domain():
    """A DDS domain that nobody on this machine uses: its first port is free."""
    for _ in range(50):
        domain = random.randint(1, 100)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7400 + 250 * domain))
                return domain
            except OSError:
                continue
    return domain


def _end_with_parent():
    """In the child: the kernel ends it when this process is gone, also by kill -9."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


class Server:
    """takt-server with a scenario, from entering a `with` block to leaving it.

    It starts paused at pace `lockstep`, under a name and on a DDS domain of its own, so that tests do not
    disturb one another. Leaving ends it and raises ServerError when it ended with an error by itself.
    """

    def __init__(self, scenario=None, *, pace="lockstep", paused=True, cell=None, domain=None, lod=None,
                 overrides=(), options=()):
        self.cell = cell or f"python_{os.getpid()}_{next(_numbers)}"
        self.domain = _free_domain() if domain is None else domain
        self._command = [program_path("takt-server")]
        if scenario is not None:
            self._command.append(os.fspath(scenario))
        self._command += ["--cell", self.cell, "--domain", str(self.domain), "--pace", pace]
        if paused:
            self._command.append("--paused")
        if lod is not None:
            self._command += ["--lod", str(lod)]
        for override in overrides:
            self._command += ["--set", override]
        self._command += options
        self._process = None
        self._reader = None
        self._lines = collections.deque(maxlen=200)

    @property
    def output(self):
        """What the server has written so far, the newest 200 lines."""
        return "".join(self._lines)

    @property
    def environment(self):
        """For other programs that are to find this cell: TAKT_CELL and TAKT_DOMAIN."""
        return {**os.environ, "TAKT_CELL": self.cell, "TAKT_DOMAIN": str(self.domain)}

    def client(self, **options):
        """A Client of this server's cell."""
        from . import Client

        options.setdefault("timeout", 60.0)
        options.setdefault("liveliness_timeout", 30.0)
        return Client(self.cell, self.domain, **options)

    def start(self):
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                         preexec_fn=_end_with_parent)
        for line in self._process.stdout:
            self._lines.append(line)
            if " ready: " in line:
                break
        else:
            code = self._finish()
            raise ServerError(f"takt-server ended with code {code}:\n{self.output}")
        # The pipe must not fill up.
        self._reader = threading.Thread(target=self._lines.extend, args=(self._process.stdout,), daemon=True)
        self._reader.start()
        return self

    def kill(self):
        """Ends it without notice, as a crash does."""
        if self._process is not None:
            self._process.kill()
            self._finish()

    def stop(self, timeout=30.0):
        """Ends it; returns its exit code. One that does not end within `timeout` seconds is killed."""
        if self._process is None:
            return 0
        self._process.terminate()
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
        return self._finish()

    def _finish(self):
        code = self._process.wait()
        if self._reader is not None:
            self._reader.join()
            self._reader = None
        self._process.stdout.close()
        self._process = None
        return code

    def __enter__(self):
        return self.start()

    def __exit__(self, exception_type, *_):
        code = self.stop()
        if code != 0 and exception_type is None:
            raise ServerError(f"takt-server ended with code {code}:\n{self.output}")
