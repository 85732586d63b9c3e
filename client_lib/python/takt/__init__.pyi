# Types of the package takt. Units are SI and in the names; vectors are lists [x, y, z], quaternions [x, y, z, w].
import os
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Union

from .requests import Requests

class CellError(RuntimeError):
    """What went wrong, as a whole sentence; `result` is the server's result code of a refused request, else 0."""
    result: int
class CellTimeout(CellError): """No answer within the time allowed."""
class NotFound(CellError): """No such cell, robot, gripper or component."""
class Invalid(CellError): """Refused before sending: wrong count, not a finite number."""
class Refused(CellError): """Refused by the server; `result` says how."""
class Lost(CellError): """The server went away, or what a controller commanded was reset."""
class ServerError(RuntimeError): """takt-server did not start, or ended with an error."""

# Enumerations: their values are compared and hashed, and have `name` and `value`; all by name: `__members__`.
class ComponentType:
    part: "ComponentType"
    gripper: "ComponentType"
    ground: "ComponentType"
class PartState:
    free: "PartState"
    grasped: "PartState"
    placed: "PartState"
    assembled: "PartState"
    fixed: "PartState"
class SimulationState:
    stopped: "SimulationState"
    playing: "SimulationState"
    paused: "SimulationState"
    quitting: "SimulationState"
    no_world: "SimulationState"
    loading_world: "SimulationState"
class Severity:
    information: "Severity"
    warning: "Severity"
    error: "Severity"
class SafeAction:
    hold: "SafeAction"
    stop: "SafeAction"
class GripperAction:
    open: "GripperAction"
    close: "GripperAction"
    width: "GripperAction"
class Pace:
    realtime: "Pace"
    free: "Pace"
    lockstep: "Pace"

class ComponentInfo:
    name: str
    type: ComponentType
    hierarchy: int
    mass_kg: float
    center_of_mass_m: List[float]
    mesh_uri: str
    vertices_m: List[float]
    triangles: List[int]
class JointInfo:
    name: str
    prismatic: bool
    lower: float
    upper: float
    max_velocity: float
    max_effort: float
class RobotInfo:
    name: str
    urdf: str
    joints: List[JointInfo]
    command_period_s: float
    command_deadline_s: float
    safe_action: SafeAction
class GripperInfo:
    name: str
    max_width_m: float
    max_force_N: float
    jaw_speed_m_per_s: float
class SignalInfo:
    """A named value of a device. `lower` and `upper`, in `unit`, are of what may be commanded; 0 where nothing may."""
    name: str
    unit: str
    commanded: bool
    lower: float
    upper: float
class DeviceInfo:
    """What is neither robot nor gripper: a furnace, a screwdriver, the temperature of a Part."""
    name: str
    signals: Dict[str, SignalInfo]
class CellInfo:
    """What a cell consists of; another object when another scenario is loaded."""
    cell: str
    scenario: str
    scenario_generation: int
    server_version: str
    step_s: float
    components: Dict[str, ComponentInfo]
    robots: Dict[str, RobotInfo]
    grippers: Dict[str, GripperInfo]
    devices: Dict[str, DeviceInfo]

class ComponentState:
    position_m: List[float]
    orientation: List[float]
    linear_velocity: List[float]
    angular_velocity: List[float]
    force_N: List[float]
    torque_Nm: List[float]
    state: PartState
class RobotState:
    position: List[float]
    velocity: List[float]
    effort: List[float]
    motor_power_W: List[float]
class GripperState:
    """`closed` is what was commanded; all else is measured. State.part_present(name) tells which Part is gripped."""
    width_m: float
    """Between the grip faces, never negative."""
    force_N: float
    """Of the jaws' drives, mean of both; at levels of detail 1 and 2, holding: that with which they press."""
    closed: bool
    """The last command closes the jaws, or they hold something."""
    moving: bool
    """A jaw is faster than 1 mm/s against the palm."""
    in_position: bool
    """The jaws stand, 0.1 mm from the commanded width at most."""
class AppliedCommand:
    """What was applied of the commands for one robot, gripper or device since the last reset."""
    target: str
    count: int
    newest_stamp_s: float
class State:
    """One instant. `state_hash` is chained over all steps since the last reset: equal runs have equal hashes."""
    time_s: float
    step: int
    epoch: int
    state_hash: int
    sample_number: int
    info: CellInfo
    components: Dict[str, ComponentState]
    robots: Dict[str, RobotState]
    grippers: Dict[str, GripperState]
    devices: Dict[str, Dict[str, float]]
    """Values of the signals: state.devices["Furnace"]["temperature"], in the unit of its SignalInfo."""
    applied: Dict[str, AppliedCommand]
    def component(self, name: str) -> ComponentState: ...
    def robot(self, name: str) -> RobotState: ...
    def gripper(self, name: str) -> GripperState: ...
    def partner_of(self, name: str) -> Optional[str]:
        """Who holds it; None: nobody."""
    def part_present(self, gripper: str) -> Optional[str]:
        """The Part that both jaws touch and hold (of several the first); None: none."""
class Status:
    time_s: float
    step: int
    epoch: int
    scenario_generation: int
    state: SimulationState
    pace: str
    pace_factor: float
    wall_time_s: float
    real_time_factor: float
    computation_ratio: float
    lag_s: float
    overruns: int
    commands_applied: int
    commands_rejected: int
    levels_of_detail: Dict[str, int]
    waiting_for: List[str]
    scheduling: str
    fault: str
    sample_number: int
class Event:
    sequence_number: int
    missed_before: int
    time_s: float
    step: int
    epoch: int
    severity: Severity
    code: str
    subject: str
    sender: str
    message: str
class PowerConsumer:
    name: str
    mechanical_W: List[float]
    mechanical_total_W: float
    electrical_W: float
    mechanical_energy_J: float
    electrical_energy_J: float
class Power:
    time_s: float
    step: int
    epoch: int
    consumers: Dict[str, PowerConsumer]
class Contact:
    base: str
    target: str
    force_N: List[float]
    torque_Nm: List[float]
    center_of_pressure_m: List[float]
    elements: int
    area_m2: float
    normal_force_N: float
    friction_force_N: float
    largest_pressure_Pa: float
    largest_penetration_m: float
class Contacts:
    time_s: float
    step: int
    epoch: int
    contacts: List[Contact]
    omitted: int
class Reply:
    message: str
    values: Dict[str, Any]

class TrajectoryPoint:
    """Positions (rad, m) of all joints, and how they are passed, at a time from the start of the trajectory."""
    def __init__(self, time_s: float, positions: Sequence[float], velocities: Sequence[float] = (),
                 accelerations: Sequence[float] = ()) -> None: ...
    @property
    def time_s(self) -> float: ...
    @property
    def positions(self) -> List[float]: ...
    @property
    def velocities(self) -> List[float]: ...
    @property
    def accelerations(self) -> List[float]: ...

class LockstepController:
    """Commands robots, grippers and devices in step with simulated time; the cell waits for it at every period."""
    def __init__(self, cell: Client, targets: Sequence[str], period_s: float = 0.008, *, name: str = "python",
                 timeout: float = 60.0, start: bool = True) -> None: ...
    @property
    def state(self) -> State: ...
    @property
    def period_s(self) -> float: ...
    def move(self, robot: str, positions: Sequence[float], velocities: Sequence[float] = (),
             efforts: Sequence[float] = ()) -> None:
        """Where the robot is to be one period from now; it stays there, with the same efforts, until another command."""
    def grip(self, gripper: str, action: GripperAction, width_m: float = 0.0, max_force_N: float = 0.0) -> None: ...
    def set_signals(self, device: str, signals: Dict[str, float]) -> None:
        """What is set stays so; signals that were never set are left as they are."""
    def advance(self) -> State:
        """Sends the commands of this period; returns the instant at the next one. CellTimeout: it did not come within
        `timeout` (s of wall time), with the reason; like Ctrl-C that leaves it waiting for the same instant."""
    def close(self) -> None: ...
    def __enter__(self) -> LockstepController: ...
    def __exit__(self, *exception: object) -> None: ...

class Client(Requests):
    def __init__(self, cell: str = "", domain: int = -1, *, timeout: float = 10.0, liveliness_timeout: float = 5.0,
                 name: str = "python", ownership_strength: int = 1, profiles_file: str = "",
                 profile: str = "takt_client", secure_directory: str = "") -> None:
        """Defaults: the cell of $TAKT_CELL (else "cell") on the DDS domain of $TAKT_DOMAIN (else 0)."""
    @property
    def client_id(self) -> str: ...
    @property
    def info(self) -> CellInfo: ...
    @property
    def state(self) -> State:
        """The newest; never older than the reply to the last request."""
    @property
    def status(self) -> Status: ...
    @property
    def connected(self) -> bool: ...
    def wait_for_connection(self, timeout: float) -> bool: ...
    def wait_for_state(self, predicate: Callable[[State], bool], timeout: float) -> Optional[State]:
        """The first state, from the newest on, that fulfils the predicate; None after the timeout."""
    def wait_for_status(self, predicate: Callable[[Status], bool], timeout: float) -> Optional[Status]: ...
    def wait_for_power(self, predicate: Callable[[Power], bool], timeout: float) -> Optional[Power]: ...
    def wait_for_contacts(self, predicate: Callable[[Contacts], bool], timeout: float) -> Optional[Contacts]: ...
    def next_event(self, timeout: float) -> Optional[Event]: ...
    def wait_for_event(self, predicate: Callable[[Event], bool], timeout: float) -> Optional[Event]: ...
    def send_joint_command(self, robot: str, positions: Sequence[float], velocities: Sequence[float] = (),
                           stamp_s: Optional[float] = None, efforts: Sequence[float] = ()) -> None:
        """Efforts (N m or N at the joints) are the feed-forward of the drives at level of detail 2 and 3."""
    def send_trajectory(self, robot: str, points: Sequence[TrajectoryPoint],
                        start_s: Optional[float] = None) -> None:
        """Linear through positions, cubic with velocities, quintic with accelerations; its end is the event
        trajectory_done. Without points: stop."""
    def set_signals(self, device: str, signals: Mapping[str, float], stamp_s: Optional[float] = None) -> None:
        """Sets signals of a device (info.devices: which, within which limits); the others stay as they are."""
    def set_gripper(self, gripper: str, action: GripperAction, width_m: float = 0.0, max_force_N: float = 0.0,
                    stamp_s: Optional[float] = None) -> None: ...
    def lockstep(self, targets: Sequence[str], period_s: float = 0.008, *, name: str = "python",
                 timeout: float = 60.0, start: bool = True) -> LockstepController: ...
    def play(self) -> None: ...
    def pause(self) -> None: ...
    def resume(self) -> None: ...
    def stop(self) -> None: ...
    def quit(self) -> None: ...
    def request(self, name: str, arguments: Mapping[str, Any] = ..., timeout: Optional[float] = None) -> Reply: ...
    def __enter__(self) -> Client: ...
    def __exit__(self, *exception: object) -> None: ...

class Server:
    """takt-server as a child process, from entering a `with` block to leaving it."""
    cell: str
    domain: int
    def __init__(self, scenario: Optional[Union[str, os.PathLike[str]]] = None, *, pace: str = "lockstep",
                 paused: bool = True, cell: Optional[str] = None, domain: Optional[int] = None,
                 lod: Optional[int] = None, overrides: Sequence[str] = (), options: Sequence[str] = ()) -> None: ...
    @property
    def output(self) -> str: ...
    @property
    def environment(self) -> Dict[str, str]: ...
    def client(self, **options: Any) -> Client: ...
    def start(self) -> Server: ...
    def stop(self) -> int: ...
    def kill(self) -> None: ...
    def __enter__(self) -> Server: ...
    def __exit__(self, *exception: object) -> None: ...

def list_cells(domain: int = -1, duration: float = 2.0) -> Dict[str, Optional[Status]]: ...
def program_path(name: str) -> str: ...
