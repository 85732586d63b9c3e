#!/usr/bin/env python3
"""The integration tests of Universal_Robots_Client_Library against takt-ur: urcl.py BUILD SOURCE [FILTER].

BUILD: its build folder, configured with -DINTEGRATION_TESTS=ON; SOURCE: its sources. Each test runs in a process of its own,
as ctest does it. takt-ur listens at 127.0.0.2, since some tests need ports of 127.0.0.1 themselves. Prints a line for
each test that does not pass, with its reason, and the counts. Exit code 1 where a test fails without a known reason.
"""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ADDRESS = "127.0.0.2"
LIMIT_S = 120
# What the tests want to know of their robot.
ENVIRONMENT = dict(os.environ, URSIM_VERSION="latest", ROBOT_MODEL="ur10e")
HEADLESS, URCAP = ["--headless", "true"], ["--headless", "false"]
PROGRAMS = [("rtde_tests", []), ("dashboard_client_g5_tests", []), ("dashboard_client_x_tests", []),
            ("primary_client_test_headless", []), ("ur_driver_deprecated_constructor_test", []),
            ("ur_driver_tests_headless", HEADLESS), ("ur_driver_tests_urcap", URCAP),
            ("external_control_program_tests_headless", HEADLESS), ("external_control_program_tests_urcap", URCAP),
            ("trajectory_streaming_tests_headless", HEADLESS), ("spline_tests_headless", HEADLESS),
            ("spline_tests_urcap", URCAP), ("instruction_executor_test_headless", HEADLESS),
            ("instruction_executor_test_urcap", URCAP)]
# Tests that need no robot but ports of their own, or a network without a robot: they run in an empty network namespace.
ALONE = re.compile(r"PrimaryClientFakeTest|connection_limits|RTDEClientTest.connect_non_running_robot|fake_server|after_server_stops|test_initialization")
# Why a test fails here.
KNOWN = {
    **{f"RTDEClientTest.{name}": "the library's own fake RTDE server does not answer its client, without takt too"
       for name in ("get_data_package_fake_server", "destroy_client_after_server_stops_sending",
                    "reconnect_fake_server_background_read", "reconnect_fake_server_blocking_read")},
}
# Not run: it would wait for minutes.
LEFT_OUT = {"DashboardClientTestG5.connect_non_running_robot": "needs the robot, and a network that refuses 192.168.56.123"}


def names_of(program, cwd):
    suite, names = "", []
    listed = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, cwd=cwd).stdout
    for line in listed.splitlines():
        if line.startswith("Running main"):
            continue
        if not line.startswith(" "):
            suite = line.split("#")[0].strip()
        else:
            names.append(suite + line.split("#")[0].strip())
    return names


def run(program, name, arguments, cwd):
    """The result and its reason."""
    command = [program, f"--gtest_filter={name}", *arguments, "--robot_ip", ADDRESS]
    if ALONE.search(name):
        command = ["unshare", "--map-root-user", "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh", *command]
    try:
        done = subprocess.run(command, capture_output=True, cwd=cwd, timeout=LIMIT_S, env=ENVIRONMENT)
    except subprocess.TimeoutExpired:
        return "failed", f"no end within {LIMIT_S} s"
    text = done.stdout.decode(errors="replace")
    if "[  SKIPPED ]" in text:
        return "skipped", "skips itself"
    if done.returncode == 0:
        return "passed", ""
    reasons = [line.strip() for line in text.splitlines() if re.search(r"Failure|Actual|exception", line)]
    return "failed", " / ".join(reasons)[:200]


def main():
    build, source = Path(sys.argv[1]), Path(sys.argv[2])
    wanted = re.compile(sys.argv[3] if len(sys.argv) > 3 else "")
    counts, unexpected = Counter(), 0
    for program, arguments in PROGRAMS:
        path = build / "tests" / program
        for name in names_of(path, source / "tests"):
            if not wanted.search(f"{program} {name}"):
                continue
            reason = KNOWN.get(name, "") or LEFT_OUT.get(name, "")
            result, found = ("not run", "") if name in LEFT_OUT else run(path, name, arguments, source / "tests")
            counts[result] += 1
            if result != "passed":
                print(f"{result:8} {program} {name}: {reason or found}", flush=True)
            unexpected += result == "failed" and not reason
    total = sum(counts.values())
    print(f"{counts['passed']} of {total} passed, {counts['skipped']} skipped themselves, {counts['failed']} failed, "
          f"{counts['not run']} not run")
    return 1 if unexpected or not counts["passed"] else 0


if __name__ == "__main__":
    sys.exit(main())
