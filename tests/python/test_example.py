"""A test of a cell to start from: copy it, put in your scenario, say what must happen. No sleep, no clock: the
cell stands still while the test thinks, so that it passes or fails alike on any machine. See docs/testing.md."""

import pytest

import takt

PERIOD_S = 0.008


@pytest.fixture
def cell(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as server, server.client() as client:
        yield client


def test_blocks_stand_on_the_table_at_the_beginning(cell):
    cell.step(100)
    for part in ("P", "C", "O", "B"):
        assert cell.state.partner_of(part) == "Table1"
        assert cell.state.component(part).state == takt.PartState.placed


def test_the_wrist_follows_its_set_points_and_the_jaws_close(cell):
    with cell.lockstep(["Robot1", "Gripper1"], PERIOD_S) as controller:
        target = controller.state.robot("Robot1").position
        controller.grip("Gripper1", takt.GripperAction.close)
        while controller.state.time < 0.8:
            target[5] += 0.004
            controller.move("Robot1", target)
            state = controller.advance()
            assert state.robot("Robot1").position == pytest.approx(target)
        assert state.gripper("Gripper1").closed
        assert state.gripper("Gripper1").width < 0.15
        assert state.gripper("Gripper1").moving and not state.gripper("Gripper1").in_position
        assert state.part_present("Gripper1") is None


def test_a_set_point_out_of_range_is_rejected_and_reported(cell):
    positions = cell.state.robot("Robot1").position
    positions[1] = 100.0
    cell.send_joint_command("Robot1", positions)
    event = cell.wait_for_event(lambda e: e.code == "command_rejected", timeout=60)
    assert event is not None
    assert event.subject == "Robot1"
    assert "shoulder_lift_joint" in event.message


def test_an_unknown_part_is_an_error_with_the_names_there_are(cell):
    with pytest.raises(takt.Refused) as refusal:
        cell.explain_part("Q")
    assert refusal.value.result == 2
    assert "Table1" in str(refusal.value)
