"""takt.Arm: kinematics of a robot of the cell, and lines that the simulated robot follows."""

import numpy as np
import pytest

import takt


@pytest.fixture(scope="module")
def server(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml", pace="free") as running:
        yield running


@pytest.fixture
def cell(server):
    with server.client() as client:
        client.reset()
        yield client


@pytest.fixture
def arm(cell):
    return takt.Arm(cell.info, "Robot1", "Gripper1")


def home(cell):
    return cell.state.robots["Robot1"].position


def test_forward_and_inverse_kinematics_are_inverse(cell, arm):
    joints = cell.info.robots["Robot1"].joints
    lower, upper = np.array([j.lower for j in joints]), np.array([j.upper for j in joints])
    random = np.random.default_rng(7)
    for _ in range(50):
        X_WT = arm.forward_kinematics(random.uniform(lower, upper))
        found = arm.inverse_kinematics(X_WT, near=home(cell))
        assert (lower <= found).all() and (found <= upper).all()
        assert arm.forward_kinematics(found) == pytest.approx(X_WT, abs=1e-11)


def test_the_flange_is_where_the_palm_is_mounted(cell):
    """The arm's kinematics against the state: the palm's frame is the gripper frame, which is fixed to the flange."""
    flange = takt.Arm(cell.info, "Robot1").forward_kinematics(home(cell))
    gripper = cell.info.grippers["Gripper1"]
    mount = np.eye(4)
    mount[:3, :3], mount[:3, 3] = gripper.mount.rotation, gripper.mount.position
    palm = cell.state.components[gripper.palm]
    assert flange @ mount == pytest.approx(takt.pose(palm.position, palm.orientation), abs=1e-9)


def test_a_robot_on_a_track_is_where_its_carriage_stands(config):
    """The arm's kinematics against the state, while the carriage moves and after."""
    with takt.Server(config / "devices" / "robot_track.yaml") as server, server.client() as cell:
        arm = takt.Arm(cell.info, "Robot", "Gripper")
        cell.set_signals("Track", {"set_position": 0.4})
        for steps, way in ((500, 0.125), (2000, 0.4)):
            cell.step(steps)
            state = cell.state
            assert state.components["Carriage"].position[1] == pytest.approx(way, abs=1e-3)
            arm.set_base(state)
            palm = state.components["Gripper"]
            tcp = takt.pose(palm.position, palm.orientation) @ takt.pose([0, 0, 0.2], [0, 0, 0, 1])
            assert arm.forward_kinematics(state.robots["Robot"].position) == pytest.approx(tcp, abs=1e-9)
        up = arm.forward_kinematics(state.robots["Robot"].position)
        up[2, 3] += 0.05
        assert arm.inverse_kinematics(up, near=state.robots["Robot"].position) is not None


def test_poses_and_quaternions():
    X = takt.pose([1, 2, 3], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    assert X == pytest.approx(np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]))
    assert takt.orientation_of(X) == pytest.approx([0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    with pytest.raises(takt.Invalid, match="unit quaternion"):
        takt.pose([0, 0, 0], [0, 0, 0, 2])


def moved(cell, points):
    """The states of the way, from the arrival of the trajectory at the stopped cell to its end."""
    cell.send_trajectory("Robot1", points)
    states = []
    while (done := cell.wait_for_event(lambda e: e.subject == "Robot1", timeout=0)) is None:
        cell.step(8)
        states.append(cell.state)
    assert done.code == "trajectory_done", done.message
    return states


def test_a_robot_moves_its_tool_on_a_line(cell, arm):
    start = home(cell)
    X = arm.forward_kinematics(start)
    end = X.copy()
    way = np.array([0.05, -0.1, 0.05])
    end[:3, 3] += way
    points = arm.plan_line(start, end, speed_m_per_s=0.5)
    limits = [j.max_velocity for j in cell.info.robots["Robot1"].joints]
    assert all((np.abs(p.velocities) <= limits).all() for p in points)
    states = moved(cell, points)
    assert len(states) >= len(points)
    for state in states:
        point = arm.forward_kinematics(state.robots["Robot1"].position)[:3, 3] - X[:3, 3]
        assert np.linalg.norm(np.cross(point, way)) / np.linalg.norm(way) < 1e-6
    assert arm.forward_kinematics(home(cell)) == pytest.approx(end, abs=1e-9)


def test_a_joint_move_arrives_at_full_speed(cell, arm):
    target = home(cell) + [0.8, -0.4, 0.3, 0.0, -0.6, 1.2]
    moved(cell, arm.plan_joint_move(home(cell), target, speed=1.0, acceleration_rad_per_s2=20.0))
    assert home(cell) == pytest.approx(target, abs=1e-9)


def test_what_cannot_be_is_reported(cell, arm):
    X = arm.forward_kinematics(home(cell))
    X[0, 3] += 10
    with pytest.raises(takt.MotionError, match="cannot be reached"):
        arm.inverse_kinematics(X, home(cell))
    with pytest.raises(takt.MotionError, match="straight line"):
        arm.plan_line(home(cell), X)
    with pytest.raises(takt.Invalid, match="6 joints .*; 5 positions"):
        arm.forward_kinematics(np.zeros(5))
    with pytest.raises(takt.NotFound, match="no robot 'Robot9'; it has Robot1, Robot2"):
        takt.Arm(cell.info, "Robot9")
    with pytest.raises(takt.Invalid, match="array \\(4, 4\\)"):
        arm.inverse_kinematics(np.eye(3), home(cell))
    with pytest.raises(takt.CellError):
        takt.Arm(cell.info, "Robot2", "Gripper1")
