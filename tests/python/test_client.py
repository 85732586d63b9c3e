"""The Python module itself: errors, waits, threads, scenarios and parts."""

import json
import os
import select
import signal
import subprocess
import sys
import threading

import pytest

import takt


@pytest.fixture(scope="module")
def server():
    with takt.Server(None, pace="free") as running:
        yield running


@pytest.fixture
def cell(server, config):
    with server.client() as client:
        client.load_scenario(str(config / "scenarios" / "block_assembly.yaml"))
        yield client


def test_scenarios_are_exchanged(cell, config):
    assert cell.info.scenario == "block_assembly"
    loaded = cell.load_scenario(str(config / "scenarios" / "robot_r3_single_axis.yaml"))
    assert loaded.scenario == cell.info.scenario != "block_assembly"
    assert cell.state.robots.names == cell.info.robots.names != []
    cell.unload_scenario()
    assert cell.info.scenario == ""
    assert cell.get_state().state == takt.SimulationState.no_scenario
    with pytest.raises(takt.Refused) as refusal:
        cell.load_scenario("nowhere.yaml")
    assert refusal.value.result == 2


def test_parts_come_and_go(cell):
    name = cell.spawn_entity("P", [0.2, 0.3, 1.0], copy_of="P", allow_renaming=True).entity
    assert name == "P_2"
    assert {e.name for e in cell.get_entities("P*", "part").entities} == {"P", "P_2"}
    cell.step(100)
    fallen = cell.get_entity_state(name)
    assert fallen.position[2] == pytest.approx(1.0 - 0.5 * 9.80665 * 0.1**2)
    assert fallen.state == takt.PartState.free
    assert cell.state.partner_of(name) is None
    cell.stop()
    cell.delete_entity(name)
    assert name not in cell.info.components
    with pytest.raises(takt.Refused, match="position.*3 finite numbers"):
        cell.spawn_entity("X", [0.2, 0.3], copy_of="P")


def test_state_is_that_after_the_request(cell):
    for steps in (1, 10, 100):
        before = cell.state.step
        cell.step(steps)
        assert cell.state.step == before + steps
    cell.reset()
    assert (cell.state.epoch, cell.state.step) == (1, 0)


def test_waits_let_other_threads_run(cell):
    """Without releasing the interpreter's lock this would end in the wait's timeout."""
    asked = threading.Event()

    def predicate(state):
        asked.set()
        return state.step >= 50

    def step_when_asked():
        asked.wait()
        cell.step(50)

    helper = threading.Thread(target=step_when_asked)
    helper.start()
    assert cell.wait_for_state(predicate, timeout=60).step == 50
    helper.join()


def test_an_error_in_a_predicate_comes_out(cell):
    with pytest.raises(ZeroDivisionError):
        cell.wait_for_state(lambda s: 1 / 0, timeout=30)
    with pytest.raises(takt.NotFound, match="no component 'Q'"):
        cell.wait_for_state(lambda s: s.partner_of("Q") is None, timeout=30)


def test_a_wait_ends_with_none(cell):
    assert cell.wait_for_state(lambda s: False, timeout=0.05) is None


def test_ctrl_c_ends_the_wait_for_a_boundary(server, cell):
    """A controller waits for another that is silent; afterwards it can go on waiting."""
    cell.register_controller("silent", 0.008, ["Robot2"], command_timeout=600)
    with server.client() as watcher, cell.lockstep(["Robot1"], 0.008, timeout=600) as controller:

        def interrupt_once_it_waits():
            # The cell waits for the other alone: advance() has sent its commands.
            if watcher.wait_for_status(lambda s: s.waiting_for == ["silent"], timeout=300) is not None:
                signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

        helper = threading.Thread(target=interrupt_once_it_waits)
        watcher.wait_for_status(lambda s: "python" in s.waiting_for, timeout=60)
        helper.start()
        with pytest.raises(KeyboardInterrupt):
            controller.advance()
        helper.join()
        cell.unregister_controller("silent")
        assert controller.advance().time == pytest.approx(0.008)


@pytest.mark.parametrize("ask", [lambda cell: cell.step(5, timeout=600),
                                 lambda cell: cell.request("step", {"steps": 5}, timeout=600),
                                 lambda cell: cell.wait_for_event(lambda e: False, timeout=600)])
def test_ctrl_c_ends_each_wait(server, cell, ask):
    """In lockstep a step waits for the controllers that are registered; this one sends nothing."""
    cell.set_pace(takt.Pace.lockstep)
    cell.register_controller("silent", 0.008, ["Robot1"], command_timeout=600)
    with server.client() as watcher:
        seen = set()

        def interrupt_some_statuses_later():
            watcher.wait_for_status(lambda s: seen.add(s.sample_number) or len(seen) > 5, timeout=300)
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

        helper = threading.Thread(target=interrupt_some_statuses_later)
        with pytest.raises(KeyboardInterrupt):
            helper.start()
            ask(cell)
        helper.join()
    cell.unregister_controller("silent")


def test_a_forked_child_leaves_its_parents_client_alone(server, cell):
    child = os.fork()
    if child == 0:
        code = 1
        try:
            cell.get_state()
        except takt.Invalid as error:
            code = 0 if "fork" in str(error) else 2
        except BaseException:
            code = 3
        del cell
        os._exit(code)
    assert os.waitpid(child, 0)[1] == 0
    cell.step(3)
    assert cell.state.step == 3


def test_a_stopped_server_is_lost_after_the_silence_limit(server):
    """Stopped by a signal: DDS itself remembers it for longer."""
    with server.client(liveliness_timeout=3.0) as cell:
        # The server has sent what a new client gets: a removal of its readers meanwhile may end in a deadlock of Fast DDS 2.9.1.
        assert cell.get_state()
        begun = cell.status.wall_time
        assert cell.wait_for_status(lambda s: s.wall_time > begun + 0.5, timeout=60)
        process = server._process
        process.send_signal(signal.SIGSTOP)
        try:
            with pytest.raises(takt.Lost, match="silent for 3 s"):
                cell.wait_for_state(lambda s: False, timeout=60)
        finally:
            process.send_signal(signal.SIGCONT)


def test_a_server_that_is_not_there_can_be_stopped():
    server = takt.Server("nowhere.yaml")
    with pytest.raises(takt.ServerError, match="nowhere.yaml"):
        server.start()
    server.stop()
    server.kill()


def test_killed_server_is_noticed(config):
    with takt.Server(config / "scenarios" / "block_assembly.yaml") as server:
        with server.client(liveliness_timeout=2.0) as cell:
            assert cell.connected
            server.kill()
            with pytest.raises(takt.Lost):
                cell.wait_for_state(lambda s: False, timeout=60)


def test_an_invalid_scenario_is_reported_in_the_servers_words(tmp_path):
    scenario = tmp_path / "wrong.yaml"
    scenario.write_text("takt_scenario: 1\nname: wrong\nduration: 0.2\n")
    with pytest.raises(takt.ServerError, match=r"wrong.yaml:3:.*duration"):
        takt.Server(scenario).start()


def takt_command(server, *arguments):
    command = [takt.program_path("takt"), *arguments, "--json", "--timeout", "60"]
    done = subprocess.run(command, env=server.environment, capture_output=True, text=True)
    return done.returncode, done.stdout


def test_command_line_speaks_json(server, cell):
    code, text = takt_command(server, "step", "7")
    assert (code, json.loads(text)["values"]["step"]) == (0, 7)
    code, text = takt_command(server, "state")
    assert (code, json.loads(text)["step"]) == (0, 7)
    code, text = takt_command(server, "entities", "P", "--type", "part")
    assert (code, [e["name"] for e in json.loads(text)]) == (0, ["P"])
    code, text = takt_command(server, "explain", "Q")
    assert (code, json.loads(text)["kind"], json.loads(text)["result"]) == (1, "refused", 2)
    code, text = takt_command(server, "spawn", "P2", "--copy-of", "P", "--at", "0.2", "0.3", "1.0")
    assert (code, json.loads(text)["result"]) == (1, 3)  # only while stopped
    code, text = takt_command(server, "request", "set_state", "state=stopped")
    assert code == 0
    code, text = takt_command(server, "spawn", "P2", "--copy-of", "P", "--at", "0.2", "0.3", "1.0", "--rpy-deg", "0", "0", "90")
    assert (code, json.loads(text)["entity"]) == (0, "P2")
    code, text = takt_command(server, "delete", "P2")
    assert code == 0
    code, text = takt_command(server, "lod", "9")
    assert code == 2


def test_command_line_without_a_cell():
    done = subprocess.run([takt.program_path("takt"), "--cell", "nobody", "--timeout", "1", "status", "--json"],
                          capture_output=True, text=True)
    assert done.returncode == 3
    assert json.loads(done.stdout)["kind"] == "no_cell"


def test_a_server_ends_with_the_process_that_started_it(config):
    """Also when that is killed."""
    program = """
import sys
import takt
server = takt.Server(sys.argv[1]).start()
print(server._process.pid, flush=True)
sys.stdin.read()
"""
    starter = subprocess.Popen([sys.executable, "-c", program, str(config / "scenarios" / "block_assembly.yaml")],
                               env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}, stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, text=True)
    with starter:
        pid = starter.stdout.readline()
        watch = os.pidfd_open(int(pid))
        starter.kill()
    ended, _, _ = select.select([watch], [], [], 60)
    os.close(watch)
    assert ended


def test_bash_completes_the_words_of_all_programs(tmp_path):
    script = """
        source <("$0" completion bash)
        compopt() { :; }
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _takt "$1" "${@: -1}" "${@: -2: 1}"; echo "${COMPREPLY[*]}"
    """

    def completed(program, *words):
        return subprocess.run(["bash", "-c", script, takt.program_path("takt"), takt.program_path(program), *words],
                              capture_output=True, text=True, check=True).stdout.split()

    assert completed("takt", "st") == ["status", "state", "step"]
    assert completed("takt", "--json", "spawn", "--co") == ["--copy-of"]
    assert completed("takt", "pace", "--f") == ["--factor"]
    assert completed("takt", "pace", "--do") == ["--domain"]
    assert completed("takt", "pace", "l") == ["lockstep"]
    assert completed("takt", "request", "set_p") == ["set_pace"]
    assert completed("takt-run", "re") == ["replay", "reference"]
    assert completed("takt-run", "study", "x.yaml", "--j") == ["--jobs"]
    assert completed("takt-run", "compare", "--j") == []
    assert completed("takt-server", "--snapshot-") == ["--snapshot-every"]
    (tmp_path / "run.json").touch()
    assert completed("takt-run", "compare", f"{tmp_path}/ru") == [f"{tmp_path}/run.json"]


def test_robots_say_what_they_do_when_commands_stay_away(config):
    overrides = [f"robots.Robot1.{field}" for field in
                 ("command_deadline_s=0.5", "safe_action=stop", "max_acceleration_rad_per_s2=5")]
    with takt.Server(config / "scenarios" / "block_assembly.yaml", overrides=overrides) as server:
        with server.client() as cell:
            robots = cell.info.robots
            assert (robots["Robot1"].command_deadline, robots["Robot1"].safe_action) == (0.5, takt.SafeAction.stop)
            assert (robots["Robot2"].command_deadline, robots["Robot2"].safe_action) == (0.0, takt.SafeAction.hold)
