"""Torque mode of takt-ur on a robot at level of detail 2: external control, and direct_torque of URScript."""

import socket

import pytest

import takt
from ur_clients import Driver, free_ports, Gateway, MAPPING, opened, PATIENCE_S, Rtde  # noqa: F401  (fixtures)

SERVOJ, TORQUE, STOPPED = 1, 8, -2


@pytest.fixture(scope="module")
def dynamic(config, tmp_path_factory):
    ports = free_ports(5)
    mapping = tmp_path_factory.mktemp("takt_ur") / "mapping.yaml"
    mapping.write_text(MAPPING.format(*ports) + "controller: {version: 5.25.1}\n")
    with (takt.Server(config / "scenarios" / "block_assembly.yaml", level_of_detail=2, pace="realtime") as server,
          server.client() as cell):
        gateway = Gateway(server, mapping)
        yield cell, ports, gateway
        gateway.close()


def place_of_rest(cell):
    """The joints of Robot1 when they have stood for 0.3 s of the cell's time."""
    since = []

    def stands(state):
        q = state.robot("Robot1").position
        if not since or max(abs(q - since[-1][1])) > 1e-4:
            since.append((state.time, q))
        return state.time > since[-1][0] + 0.3

    found = cell.wait_for_state(stands, timeout=PATIENCE_S)
    assert found is not None, since[-1]
    return found.robot("Robot1").position


def test_torques_of_a_driver_move_the_arm_and_none_lets_it_float(dynamic, opened):
    cell, ports, _ = dynamic
    client, driver = Rtde(opened, ports[0]), Driver(opened, ports[1])
    begin = client.wait(lambda s: s["runtime_state"] == 2)
    driver.command(TORQUE)
    floats = client.wait(lambda s: s["timestamp"] > begin["timestamp"] + 0.5)
    assert floats["actual_q"] == pytest.approx(begin["actual_q"], abs=1e-4)
    driver.command(TORQUE, (5.0, 0, 0, 0, 0, 0))  # slow: the next command may be late by half a second
    moved = client.wait(lambda s: s["actual_q"][0] > begin["actual_q"][0] + 0.05)
    assert moved["target_q"] == pytest.approx(moved["actual_q"], abs=1e-6)
    # Position control goes on from there: the arm brakes, and stays.
    driver.command(SERVOJ, moved["actual_q"])
    brakes = client.wait(lambda s: s["target_q"] != s["actual_q"])
    assert abs(place_of_rest(cell)[0] - brakes["actual_q"][0]) < 0.2
    driver.command(STOPPED)
    client.wait(lambda s: s["runtime_state"] == 1)


def test_direct_torque_lasts_a_cycle_and_the_robot_brakes_without_it(dynamic, opened):
    cell, ports, _ = dynamic
    client = Rtde(opened, ports[0])
    begin = client.wait(lambda s: s["runtime_state"] == 1)
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(b"def swing():\n  i = 0\n  while i < 150:\n    direct_torque([-5, 0, 0, 0, 0, 0], friction_comp=False)\n"
                    b"    i = i + 1\n  end\n  sleep(0.5)\nend\n")
    client.wait(lambda s: s["runtime_state"] == 2)
    end = client.wait(lambda s: s["runtime_state"] == 1)
    assert end["actual_q"][0] < begin["actual_q"][0] - 0.02
    assert list(place_of_rest(cell)) == pytest.approx(list(end["actual_q"]), abs=1e-3)


def test_torques_beyond_a_limit_are_a_protective_stop(dynamic, opened):
    cell, ports, _ = dynamic
    client = Rtde(opened, ports[0])
    client.wait(lambda s: s["runtime_state"] == 1)
    dashboard = opened(socket.create_connection(("127.0.0.1", ports[4]), timeout=PATIENCE_S)).makefile("rw")
    assert dashboard.readline().startswith("Connected")

    def ask(command):
        dashboard.write(command + "\n")
        dashboard.flush()
        return dashboard.readline().rstrip("\n")

    assert ask("safetystatus") == "Safetystatus: NORMAL"
    primary = opened(socket.create_connection(("127.0.0.1", ports[1]), timeout=PATIENCE_S))
    primary.sendall(b"def race():\n  while True:\n    direct_torque([300, 0, 0, 0, 0, 0], friction_comp=False)\n  end\nend\n")
    client.wait(lambda s: s["runtime_state"] == 2)
    client.wait(lambda s: ask("safetystatus") == "Safetystatus: PROTECTIVE_STOP")
    place_of_rest(cell)  # it brakes, and takes no torques
    assert ask("stop") == "Stopped"
    assert "releasing" in ask("unlock protective stop")
    assert ask("safetystatus") == "Safetystatus: NORMAL"
