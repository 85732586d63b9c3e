"""takt for Python: tests and programs for robotic cells.

    import takt

    with takt.Server("config/scenarios/block_assembly.yaml") as server, server.client() as cell:
        with cell.lockstep(["Robot1", "Gripper1"]) as controller:
            while controller.state.time_s < 2.0:
                controller.move("Robot1", [0.1, -1.57, 1.57, -1.57, -1.57, 0])
                controller.advance()
        assert cell.state.partner_of("P") == "Table1"

All numbers are SI, vectors plain lists, quaternions x y z w; docs/testing.md is a page about tests with pytest.
Errors are CellError and what is derived from it; every wait takes a timeout in seconds of wall time, and
Ctrl-C ends it.
"""

from . import _takt
from ._takt import (
    AppliedCommand,
    CellError,
    CellInfo,
    CellTimeout,
    ComponentInfo,
    ComponentState,
    ComponentType,
    Contact,
    Contacts,
    DeviceInfo,
    Event,
    GripperAction,
    GripperInfo,
    GripperState,
    Invalid,
    JointInfo,
    Lost,
    NotFound,
    Pace,
    PartState,
    Power,
    PowerConsumer,
    Refused,
    Reply,
    RobotInfo,
    RobotState,
    SafeAction,
    Severity,
    SignalInfo,
    SimulationState,
    State,
    Status,
    TrajectoryPoint,
    list_cells,
)
from .requests import Requests
from .server import Server, ServerError, program_path


class LockstepController(_takt.LockstepController):
    """Commands robots, grippers and devices in step with simulated time; leave it by `with` or close()."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Client(_takt.Client, Requests):
    """A connection to one cell; waits until the cell has described itself."""

    def play(self):
        """Lets the simulation run."""
        self.set_state(SimulationState.playing)

    def pause(self):
        """Stops the simulation where it is."""
        self.set_state(SimulationState.paused)

    def resume(self):
        """Lets a paused simulation go on."""
        self.set_state(SimulationState.playing)

    def stop(self):
        """Stops the simulation and resets it."""
        self.set_state(SimulationState.stopped)

    def quit(self):
        """Ends the server."""
        self.set_state(SimulationState.quitting)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def lockstep(self, targets, period_s=0.008, **options):
        """A controller of these robots, grippers and devices; sets the cell to lockstep and playing."""
        return LockstepController(self, targets, period_s, **options)
