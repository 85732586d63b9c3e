"""Devices: description of their signals for a client, and signals read and commanded without the scenario's file."""

import json
import subprocess

import pytest

import takt

OVEN = """
takt_scenario: 1
name: oven
solver: {method: rk2, step_s: 0.01}
world: {temperature_degC: 20}
furnaces:
  Oven:
    chamber: {center: {position_m: [0, 0, 0.4]}, size_m: [0.7, 0.7, 0.7]}
    mass_kg: 2
    specific_heat_J_per_kg_K: 900
    convection_W_per_m2_K: 15
    loss_W_per_m2_K: 0.8
    set_temperature_degC: 60
    max_set_temperature_degC: 200
    control: {gain_W_per_K: 200, integral_time_s: 600, max_power_W: 9000}
"""


@pytest.fixture
def scenario(tmp_path):
    file = tmp_path / "oven.yaml"
    file.write_text(OVEN)
    return file


@pytest.fixture
def server(scenario):
    with takt.Server(scenario) as running:
        yield running


@pytest.fixture
def cell(server):
    with server.client() as client:
        yield client


def test_the_description_has_units_and_limits(cell):
    oven = cell.info.devices["Oven"]
    assert oven.name == "Oven"
    assert oven.signals.names == list(cell.state.signals("Oven"))
    wanted = oven.signals["set_temperature"]
    assert (wanted.unit, wanted.commanded, wanted.lower, wanted.upper) == ("degC", True, 20.0, 200.0)
    door = oven.signals["door"]
    assert (door.unit, door.commanded, door.lower, door.upper) == ("", True, 0.0, 1.0)
    assert [(oven.signals[s].unit, oven.signals[s].commanded) for s in ("temperature", "power")] == [
        ("degC", False), ("W", False)]


def test_a_furnace_is_heated_in_lockstep(cell):
    with cell.lockstep(["Oven"], 0.1) as controller:
        before = controller.advance().signals("Oven")
        assert before["temperature"] == pytest.approx(60, abs=0.1)
        controller.set_signals("Oven", {"set_temperature": 100})
        while controller.state.time < 4:
            controller.advance()
        after = controller.state.signals("Oven")
        assert after["set_temperature"] == pytest.approx(100)
        assert before["temperature"] + 10 < after["temperature"] < 100
        assert before["power"] + 1000 < after["power"] <= 9000
        assert controller.state.applied["Oven"].count == 40
        assert controller.state.applied["Oven"].newest_stamp == pytest.approx(3.9)


def test_signals_are_set_at_any_pace_and_invalid_ones_rejected(cell):
    cell.set_pace(takt.Pace.free)
    cell.play()
    cell.set_signals("Oven", {"set_temperature": 100, "door": 1})
    state = cell.wait_for_state(lambda s: s.applied["Oven"].count >= 1, timeout=60)
    assert state is not None
    assert state.signals("Oven")["set_temperature"] == pytest.approx(100)
    assert state.signals("Oven")["door"] == 1
    for signals, reason in (({"temperature": 90}, "read_only_signal"), ({"set_temperature": 201}, "201")):
        cell.set_signals("Oven", signals)
        refused = cell.wait_for_event(lambda e: e.code == "command_rejected", timeout=60)
        assert refused is not None and refused.subject == "Oven"
        assert reason in refused.message
    with pytest.raises(takt.NotFound, match="no device 'Stove'; it has Oven"):
        cell.set_signals("Stove", {"door": 1})


def test_a_robot_follows_a_trajectory(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml", pace="free") as server, server.client() as cell:
        target = cell.state.robot("Robot1").position
        target[5] += 0.2
        cell.send_trajectory("Robot1", [takt.TrajectoryPoint(0.5, target, velocities=[0.0] * 6)])
        cell.play()
        done = cell.wait_for_event(lambda e: e.code == "trajectory_done", timeout=60)
        assert done is not None and done.subject == "Robot1"
        cell.pause()
        assert cell.state.robot("Robot1").position == pytest.approx(target)
        assert cell.state.applied["Robot1"].count == 1


def output(server, *arguments):
    command = [takt.program_path("takt"), *arguments, "--timeout", "60"]
    return subprocess.run(command, env=server.environment, capture_output=True, text=True, check=True).stdout


def test_the_command_line_shows_signals_with_units_and_limits(server, cell):
    state = json.loads(output(server, "state", "--json"))
    assert state["devices"]["Oven"]["signals"] == cell.state.signals("Oven")
    signals = state["description"]["devices"]["Oven"]["signals"]
    assert (signals["temperature"]["unit"], signals["door"]["unit"]) == ("degC", "")
    assert {name: [s["lower"], s["upper"]] for name, s in signals.items() if s["commanded"]} == {
        "set_temperature": [20, 200], "door": [0, 1]}
    lines = [line.split() for line in output(server, "state").splitlines() if line.startswith("Oven ")]
    assert lines[0] == ["Oven", "set_temperature", "60", "degC", "can", "be", "set:", "20", "to", "200"]
    assert ["Oven", "temperature", "60", "degC"] in lines
    assert json.loads(output(server, "reload", "--json"))["devices"] == ["Oven"]
    header, row = output(server, "record", "-", "--duration", "0").splitlines()[:2]
    assert float(dict(zip(header.split(","), row.split(",")))["devices.Oven.signals.set_temperature"]) == pytest.approx(60)
    recorded = [json.loads(line) for line in output(server, "record", "-", "--json", "--duration", "0").splitlines()]
    line = next(line for line in recorded if line["kind"] == "state")
    assert line["devices"]["Oven"]["signals"]["set_temperature"] == pytest.approx(60)


def test_a_recording_of_takt_run_has_the_same_description(scenario, cell, tmp_path):
    recording = tmp_path / "oven.mcap"
    subprocess.run([takt.program_path("takt-run"), "run", scenario, "--duration", "0.1", "--quiet", "--mcap", recording],
                   check=True)
    lines = subprocess.run([takt.program_path("takt"), "export", recording, "--json"], check=True,
                           capture_output=True, text=True).stdout.splitlines()
    descriptions = [line["sample"] for line in map(json.loads, lines) if line["topic"].endswith("/description")]
    oven = descriptions[0]["devices"]["Oven"]
    signals = cell.info.devices["Oven"].signals
    assert oven["signals"] == {s.name: {"unit": s.unit, "commanded": s.commanded, "lower": s.lower, "upper": s.upper,
                                        "type": s.type.name, "wire": s.wire}
                               for s in signals}
