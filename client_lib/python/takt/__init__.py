"""takt for Python: tests and programs for robotic cells.

    import takt

    with takt.Server("config/scenarios/block_assembly.yaml") as server, server.client() as cell:
        with cell.lockstep(["Robot1", "Gripper1"]) as controller:
            while controller.state.time < 2.0:
                controller.move("Robot1", [0.1, -1.57, 1.57, -1.57, -1.57, 0])
                controller.advance()
        assert cell.state.partner_of("P") == "Table1"

All numbers are SI, vectors numpy arrays, quaternions x y z w; docs/clients.md is a page about clients, docs/testing.md one
about tests with pytest. Errors are CellError and its subclasses; every wait takes a timeout in seconds of wall
time, and Ctrl-C ends it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from . import _takt
from ._takt import (
    Arm,
    CellInfo,
    Event,
    Reply,
    State,
    TrajectoryPoint,
    list_cells,
    orientation_of,
    pose,
)
from .enumerations import (
    ComponentType,
    GripperAction,
    JointType,
    Pace,
    PartState,
    PartnerRule,
    SafeAction,
    Severity,
    SimulationState,
)
from .errors import CellError, CellTimeout, Invalid, Lost, MotionError, NotFound, Refused
from .messages import Contacts, Power, Status
from .named_list import NamedList
from .requests import Requests
from .server import Server, ServerError, program_path
from .topics import Topics


class LockstepController(_takt.LockstepController):
    """Commands robots, grippers and devices in step with simulated time; the cell waits for it at every period.

    close() or the end of a `with` block unregisters it.
    """

    def __enter__(self) -> LockstepController:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Client(_takt.Client, Requests, Topics):
    """A connection to one cell. Any thread may call it; a wait lets other threads run."""

    def play(self) -> None:
        """Lets the simulation run; waits for the reply.

        In lockstep simulated time advances only with registered controllers.
        """
        self.set_state(SimulationState.playing)

    def pause(self) -> None:
        """Stops the simulation at its present instant; waits for the reply."""
        self.set_state(SimulationState.paused)

    def stop(self) -> None:
        """Stops the simulation and resets it; waits for the reply."""
        self.set_state(SimulationState.stopped)

    def quit(self) -> None:
        """Ends the server."""
        self.set_state(SimulationState.quitting)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def lockstep(self, targets: Sequence[str], period_s: float = 0.008, **options: Any) -> LockstepController:
        """A LockstepController of these targets; sets the cell to lockstep and playing.

        targets: names of robots, grippers and devices
        period_s: simulated time from boundary to boundary, in s
        options: name, timeout and start of LockstepController
        """
        return LockstepController(self, targets, period_s, **options)
