"""Parts are put elsewhere, held and let go by hand; the state of a simulation is kept and taken up again."""

import pytest

import takt


def need(cell, request):
    if request not in cell.get_features().requests:
        pytest.skip(f"this server has no request {request}")


def test_a_part_is_put_elsewhere_held_and_let_go(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as server, server.client() as cell:
        need(cell, "attach")
        cell.set_entity_state("P", position=[0.2, 0.3, 1.0])
        assert cell.state.component("P").position == pytest.approx([0.2, 0.3, 1.0])
        cell.attach("P", "Gripper1")
        cell.step(100)
        assert cell.state.partner_of("P") == "Gripper1"
        assert cell.state.component("P").position[2] == pytest.approx(1.0, abs=1e-3)
        cell.detach("P")
        cell.step(100)
        assert cell.state.partner_of("P") is None
        assert cell.state.component("P").position[2] < 0.97
        with pytest.raises(takt.Refused):
            cell.attach("Table1", "Gripper1")


def test_a_snapshot_goes_on_with_the_same_bits(config, tmp_path):
    scenario = config / "scenarios" / "block_assembly.yaml"
    with takt.Server(scenario) as server, server.client() as cell:
        need(cell, "save_snapshot")
    with takt.Server(scenario, options=["--snapshots", str(tmp_path)]) as server, server.client() as cell:
        cell.step(100)
        saved = cell.state
        cell.save_snapshot("here")
        cell.step(50)
        later = cell.state
        cell.restore_snapshot("here")
        restored = cell.state
        assert (restored.step, restored.state_hash) == (saved.step, saved.state_hash)
        assert restored.epoch > saved.epoch
        cell.step(50)
        assert cell.state.state_hash == later.state_hash
        with pytest.raises(takt.Refused):
            cell.restore_snapshot("never_saved")
