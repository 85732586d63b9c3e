"""takt-server as a child process, for tests."""

from __future__ import annotations

import collections
import itertools
import os
import random
import shutil
import socket
import subprocess
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Sequence

if TYPE_CHECKING:
    from . import Client

_numbers = itertools.count(1)


class ServerError(RuntimeError):
    """takt-server did not start, or ended with an error; the text is its output."""


def program_path(name: str) -> str:
    """Path of one of takt's programs: in $TAKT_BIN, in the build or prefix this package is part of, or on the PATH.

    Raises ServerError where it is in none of them.
    """
    package = Path(__file__).resolve().parent  # build/python/takt, or PREFIX/lib/python3/dist-packages/takt
    for folder in (os.environ.get("TAKT_BIN"), package.parents[1] / "bin", package.parents[3] / "bin"):
        if folder and (Path(folder) / name).is_file():
            return str(Path(folder) / name)
    found = shutil.which(name)
    if found is None:
        raise ServerError(f"{name} was not found: neither in $TAKT_BIN nor beside this package nor on the PATH.")
    return found


def _free_domain() -> int:
    """A DDS domain that no process on this machine uses: its first port is free."""
    for _ in range(50):
        domain = random.randint(1, 100)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", 7400 + 250 * domain))
                return domain
            except OSError:
                continue
    return domain


class Server:
    """takt-server with a scenario, from entering a `with` block to leaving it.

    It starts paused at pace `lockstep`, under a name and on a DDS domain of its own, so that tests do not
    disturb one another. Leaving the block ends it and raises ServerError when it ended with an error by itself.
    The kernel ends it when the thread that started it is gone, also after kill -9 of this process.
    """

    cell: str
    """Name of the cell."""
    domain: int
    """DDS domain of the cell, 0 to 232."""

    def __init__(self, scenario: str | os.PathLike[str] | None = None, *, pace: str = "lockstep", paused: bool = True,
                 cell: str | None = None, domain: int | None = None, level_of_detail: int | None = None,
                 overrides: Sequence[str] = (), options: Sequence[str] = ()) -> None:
        """Prepares the command; start() or a `with` block runs it.

        scenario: scenario file; None: the server starts without one
        pace: realtime, free or lockstep
        paused: simulated time stands until a client lets it run
        cell: name of the cell; None: a name that is unique on this machine
        domain: DDS domain, 0 to 232; None: one that no process on this machine uses
        level_of_detail: of every process, 1 to 3; None: those of the scenario
        overrides: KEY=VALUE for keys of the scenario, e.g. solver.step_s=0.0005
        options: further options of takt-server
        """
        self.cell = cell or f"python_{os.getpid()}_{next(_numbers)}"
        self.domain = _free_domain() if domain is None else domain
        # The launcher asks the kernel for the signal and then becomes the server; code between fork and exec in
        # this process could meet a lock that another thread holds.
        self._command = ["setpriv", "--pdeathsig", "KILL", "--", program_path("takt-server")]
        if scenario is not None:
            self._command.append(os.fspath(scenario))
        self._command += ["--cell", self.cell, "--domain", str(self.domain), "--pace", pace]
        if paused:
            self._command.append("--paused")
        if level_of_detail is not None:
            self._command += ["--lod", str(level_of_detail)]
        for override in overrides:
            self._command += ["--set", override]
        self._command += options
        self._process: subprocess.Popen[str] | None = None
        self._reader: threading.Thread | None = None
        self._lines: collections.deque[str] = collections.deque(maxlen=200)

    @property
    def output(self) -> str:
        """Output of the server so far: the newest 200 lines."""
        return "".join(self._lines)

    @property
    def environment(self) -> dict[str, str]:
        """Environment for other programs that are to find this cell: TAKT_CELL and TAKT_DOMAIN."""
        return {**os.environ, "TAKT_CELL": self.cell, "TAKT_DOMAIN": str(self.domain)}

    def client(self, **options: Any) -> Client:
        """A Client of this server's cell; `options` are those of Client."""
        from . import Client

        options.setdefault("timeout", 60.0)
        options.setdefault("liveliness_timeout", 30.0)
        return Client(self.cell, self.domain, **options)

    def start(self) -> Server:
        """Starts the server and returns when it is ready. Raises ServerError with its output when it ends before."""
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
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

    def kill(self) -> None:
        """Ends the server without notice, as a crash does."""
        if self._process is not None:
            self._process.kill()
            self._finish()

    def stop(self, timeout: float = 30.0) -> int:
        """Ends the server and returns its exit code. It is killed after `timeout` seconds of wall time."""
        if self._process is None:
            return 0
        self._process.terminate()
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
        return self._finish()

    def _finish(self) -> int:
        code = self._process.wait()
        if self._reader is not None:
            self._reader.join()
            self._reader = None
        self._process.stdout.close()
        self._process = None
        return code

    def __enter__(self) -> Server:
        return self.start()

    def __exit__(self, exception_type: type[BaseException] | None, *_: object) -> None:
        code = self.stop()
        if code != 0 and exception_type is None:
            raise ServerError(f"takt-server ended with code {code}:\n{self.output}")
