"""A client process that is stopped for longer than DDS remembers the cell, and continued."""

import os
import signal
import subprocess
import sys

import pytest

import takt

CLIENT = """
import sys
import time
import takt

with takt.Client() as cell:
    print("ready", flush=True)
    if sys.argv[1] == "elsewhere":
        sys.stdin.readline()
    begun = cell.state.time
    assert cell.wait_for_state(lambda state: state.time > begun + 0.5, timeout=60)
    assert cell.wait_for_state(lambda state: state.time > float(sys.argv[2]), timeout=60)
    cell.get_state()
    assert cell.state.time > begun
"""


@pytest.mark.parametrize("stopped_s", [3.5, 4.7, 5.3, 8.0])
def test_clients_that_were_frozen_go_on(config, stopped_s):
    """Others forget them after 5 s without a sign of life, of which the last came up to 1 s before the stop."""
    until_s = stopped_s + 2.0
    scenario = config / "scenarios" / "block_assembly.yaml"
    with takt.Server(scenario, pace="realtime", paused=False) as server, server.client() as cell:
        environment = server.environment | {"PYTHONPATH": os.pathsep.join(sys.path)}
        clients = [subprocess.Popen([sys.executable, "-c", CLIENT, where, str(until_s)], env=environment,
                                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
                   for where in ("waiting", "elsewhere")]
        try:
            for client in clients:
                assert client.stdout.readline() == "ready\n"
            # So far that each is where it is to be stopped.
            frozen_s = cell.status.wall_time
            assert cell.wait_for_status(lambda s: s.wall_time > frozen_s + 0.5, timeout=60)
            for client in clients:
                client.send_signal(signal.SIGSTOP)
            assert cell.wait_for_status(lambda s: s.wall_time > frozen_s + 0.5 + stopped_s, timeout=60)
            for client in clients:
                client.send_signal(signal.SIGCONT)
            for client in clients:
                client.communicate("\n", timeout=120)
                assert client.returncode == 0
        finally:
            for client in clients:
                client.kill()
                client.wait()


def test_clients_of_a_server_that_was_frozen_find_it_again(config):
    """The server accepts commands of a client that it has taken for dead."""
    scenario = config / "scenarios" / "block_assembly.yaml"
    with takt.Server(scenario, pace="realtime") as server, server.client() as cell:
        def send():
            cell.send_joint_command("Robot1", cell.state.robots["Robot1"].position)

        cell.play()
        send()
        assert cell.wait_for_state(lambda state: state.applied["Robot1"].count == 1, timeout=60)
        server._process.send_signal(signal.SIGSTOP)
        try:
            with pytest.raises(takt.Lost, match="silent for 5 s|gone"):
                cell.wait_for_state(lambda state: False, timeout=60)
            assert not cell.wait_for_connection(3.0)
        finally:
            server._process.send_signal(signal.SIGCONT)
        assert cell.wait_for_connection(60.0)
        send()
        assert cell.wait_for_state(lambda state: state.applied["Robot1"].count == 2, timeout=60)
        cell.get_state()
