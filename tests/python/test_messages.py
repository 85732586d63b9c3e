"""What is read of a cell: arrays, names, enumerations, lists of what has a name."""

import re
from pathlib import Path

import numpy as np
import pytest

import takt


@pytest.fixture(scope="module")
def server(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as running:
        yield running


@pytest.fixture
def cell(server):
    with server.client() as client:
        yield client


def test_numbers_are_arrays_in_their_shapes(cell):
    part = cell.info.components["P"]
    assert (part.vertices.shape[1:], part.vertices.dtype) == ((3,), np.float32)
    assert (part.triangles.shape[1:], part.triangles.dtype) == ((3,), np.uint32)
    assert part.triangles.max() == len(part.vertices) - 1
    assert (part.center_of_mass.shape, part.color.shape, cell.info.gravity.shape) == ((3,), (4,), (3,))
    robot = cell.info.robots["Robot1"]
    assert robot.base.rotation.shape == (3, 3)
    assert robot.base.rotation @ robot.base.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    state = cell.state
    assert (state.robots["Robot1"].position.shape, state.robots["Robot1"].position.dtype) == ((6,), np.float64)
    assert state.components["P"].orientation.shape == (4,)
    assert np.linalg.norm(state.components["P"].orientation) == pytest.approx(1)
    assert state.robots["Robot1"].motor_power.shape == (0,)


def test_the_volume_of_a_mesh_is_that_of_its_box(cell):
    """Signed tetrahedra of the triangles, against the product of the edges."""
    mesh = cell.info.components["Table1"]
    corners = mesh.vertices.astype(float)[mesh.triangles]
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert 0 < volume <= np.prod(np.ptp(mesh.vertices.astype(float), axis=0)) * (1 + 1e-6)


def test_an_array_is_a_copy(cell):
    state = cell.state
    before = state.robots["Robot1"].position
    changed = state.robots["Robot1"].position
    changed[0] += 1
    assert (state.robots["Robot1"].position == before).all()


def test_lists_are_lists_and_know_names(cell):
    info, state = cell.info, cell.state
    assert isinstance(info.components, list) and isinstance(state.components, takt.NamedList)
    assert state.components.names == info.components.names == [c.name for c in info.components]
    assert len(state.robots) == len(info.robots) == 2
    assert [j.name for j in info.robots[0].joints] == info.robots[0].joints.names
    assert "P" in info.components and "Q" not in info.components
    with pytest.raises(KeyError, match="no 'Robot9'; there are Robot1, Robot2"):
        state.robots["Robot9"]


def test_an_index_is_a_name_or_none(cell):
    state = cell.state
    assert state.components["P"].partner == state.partner_of("P") == "Table1"
    assert state.components["Table1"].partner is None
    assert state.grippers["Gripper1"].part is None
    gripper = cell.info.grippers["Gripper1"]
    assert (gripper.robot, cell.info.components[gripper.palm].type) == ("Robot1", takt.ComponentType.gripper)
    assert cell.get_entity_state("Table1").partner is None
    assert cell.get_entity_state("P").partner == "Table1"


def test_enumerations_are_enumerations(cell):
    assert cell.state.components["P"].state is takt.PartState.placed
    assert list(takt.Pace) == [takt.Pace.realtime, takt.Pace.free, takt.Pace.lockstep]
    assert takt.JointType["revolute"] is cell.info.robots["Robot1"].joints[0].type
    with pytest.raises(takt.Invalid, match="'ajar' is no GripperAction; allowed are open, close, width"):
        cell.set_gripper("Gripper1", "ajar")
    cell.set_gripper("Gripper1", "close")


def test_a_part_of_a_state_outlives_it(cell):
    position = cell.state.components["P"].position
    part = cell.state.components["P"]
    cell.step(1)
    assert (part.position == position).all()
    assert "PartState" not in repr(part) and "partner='Table1'" in repr(part)


def test_status_has_all_its_figures(cell):
    status = cell.wait_for_status(lambda s: s.step_time_max > 0 or s.step == 0, timeout=60)
    for name in ("step_time_p50", "step_time_p99", "wakeup_latency_max", "command_latency_p99", "contact_calls",
                 "solver_steps", "mpr_calls", "schedule_resets"):
        assert getattr(status, name) >= 0
    assert status.processes.names and status.processes[0].level_of_detail == 1
    assert status.state in (takt.SimulationState.paused, takt.SimulationState.stopped)


@pytest.mark.parametrize("made", [list, tuple, np.array, lambda v: np.array(v, dtype=np.float32)])
def test_arguments_are_arrays_or_sequences(cell, made):
    cell.stop()
    cell.set_entity_state("P", position=made([0.25, 0.5, 1.0]), orientation=made([0.0, 0.0, 0.0, 1.0]))
    assert cell.state.components["P"].position == pytest.approx([0.25, 0.5, 1.0])
    here = cell.get_entity_state("P")
    assert isinstance(here.position, np.ndarray) and here.position == pytest.approx([0.25, 0.5, 1.0])
    cell.send_joint_command("Robot1", made(cell.state.robots["Robot1"].position.tolist()), efforts=made([0.0] * 6))
    cell.step(np.int64(2))
    point = takt.TrajectoryPoint(1.0, made([0.5] * 6), efforts=made([1.0] * 6))
    assert (point.positions == 0.5).all() and (point.efforts == 1.0).all() and point.velocities.shape == (0,)
    cell.reset()


def topics_of_the_table():
    """Ids of the topics of takt's own types that a client reads."""
    text = (Path(__file__).resolve().parents[2] / "idl" / "takt_msgs.idl").read_text()
    rows = re.findall(r'@topic\(id="(\w+)", name="[^"]*", by="(\w+)", qos="(\w+)"', text)
    return [topic for topic, by, qos in rows if by == "server" and qos != "control"]


def test_every_topic_of_the_table_is_read(config):
    waits = {name for name in vars(takt.Topics) if name.startswith("wait_for_")}
    assert waits == {f"wait_for_{topic}" for topic in topics_of_the_table()} >= {"wait_for_power", "wait_for_event"}
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as server, server.client() as cell:
        cell.set_pace(takt.Pace.free)
        cell.set_level_of_detail(3)
        cell.watch_pressures(["P-Table1"], duration=86400)
        cell.step(20)
        samples = {topic: getattr(cell, f"wait_for_{topic}")(timeout=60) for topic in topics_of_the_table()}
        assert [topic for topic, sample in samples.items() if sample is None] == []
        assert all(sample.sample_number >= 1 for sample in samples.values())
        assert isinstance(samples["state"], takt.State) and isinstance(samples["power"], takt.Power)
        assert samples["description"].components.names == cell.info.components.names
        assert samples["power"].consumers.names == cell.info.robots.names
        assert {(c.base, c.target) for c in samples["contacts"].contacts} & {("P", "Table1"), ("Table1", "P")}
        pressed = samples["contact_pressures"].pairs[0]
        assert {pressed.base, pressed.target} == {"P", "Table1"}
        assert pressed.corners.shape == (len(pressed.pressures), 3, 3)
        assert cell.wait_for_contacts(lambda sample: not sample.contacts, timeout=0.05) is None
