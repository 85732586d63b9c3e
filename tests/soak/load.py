"""A mesh of a million triangles loaded into a server that runs a cell.

    load.py BIN_DIRECTORY CONFIG_DIRECTORY [TRIANGLES]

Prints how long the request takes until the client has the new description with its mesh (goal 30 s), and how the cell that
ran went on meanwhile. Exit code 0: within the goal, and no step of the old cell was left out.
"""
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time

GOAL_S = 30.0


def write_ring(path, triangles):
    """A wavy ring: closed, not convex, two triangles for each cell of a grid."""
    n = math.ceil(math.sqrt(triangles / 2))
    with open(path, "w", encoding="ascii") as mesh:
        mesh.write("o Ring\n")
        for i in range(n):
            a = 2 * math.pi * i / n
            for j in range(n):
                b = 2 * math.pi * j / n
                r = 0.04 * (1 + 0.05 * math.sin(6 * a) * math.cos(5 * b))
                out = 0.1 + r * math.cos(b)
                mesh.write(f"v {out * math.cos(a):.7f} {out * math.sin(a):.7f} {r * math.sin(b):.7f}\n")
        for i in range(n):
            below, above = i * n, (i + 1) % n * n
            for j in range(n):
                k = (j + 1) % n
                mesh.write(f"f {below + j + 1} {above + j + 1} {above + k + 1}\n")
                mesh.write(f"f {below + j + 1} {above + k + 1} {below + k + 1}\n")
    return 2 * n * n


def main():
    bin_directory, config = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    wanted = int(sys.argv[3]) if len(sys.argv) > 3 else 1_000_000
    cell = f"load_{os.getpid()}"
    of_cell = ["--cell", cell, "--domain", str(100 + os.getpid() % 100), "--timeout", "120"]
    running = os.path.join(config, "scenarios", "block_assembly.yaml")
    with tempfile.TemporaryDirectory() as directory:
        triangles = write_ring(os.path.join(directory, "ring.obj"), wanted)
        with open(running, encoding="utf-8") as file:
            text = file.read().replace("../", config + "/")
        part = "  Ring: {mesh: ring.obj, mass_kg: 1.0, hierarchy: 1, pose: {position_m: [0.5, 0.5, 0.75]}}\n"
        scenario = os.path.join(directory, "large.yaml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(re.sub(r"^parts:\n", "parts:\n" + part, text, flags=re.M))
        server = subprocess.Popen(
            [os.path.join(bin_directory, "takt-server"), running, "--set", "duration_s=1000000"] + of_cell[:4],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            while "ready" not in server.stdout.readline():
                if server.poll() is not None:
                    raise SystemExit("load.py: takt-server ended")

            def takt(*words):
                command = [os.path.join(bin_directory, "takt"), *words, *of_cell]
                return subprocess.run(command, check=True, capture_output=True, text=True).stdout

            def status():
                return json.loads(takt("status", "--json"))

            first = last = status()
            begin = time.monotonic()
            load = subprocess.Popen([os.path.join(bin_directory, "takt"), "load", scenario, *of_cell])
            while load.poll() is None:
                now = status()
                if now["scenario_generation"] == first["scenario_generation"]:
                    last = now
            took_s = time.monotonic() - begin
            if load.returncode != 0:
                raise SystemExit("load.py: the scenario was not loaded")
            steps = last["step"] - first["step"]
            missed = last["overruns"] - first["overruns"]
            good = took_s <= GOAL_S and steps > 0 and last["schedule_resets"] == first["schedule_resets"]
            print(f"{triangles} triangles loaded, described and received in {took_s:.1f} s (goal {GOAL_S:g})")
            print(f"the running cell meanwhile: {steps} steps, {100 * missed / max(steps, 1):.2f} % missed ticks, "
                  f"re-based {last['schedule_resets'] - first['schedule_resets']} times, step p99 {1e6 * last['step_time']['p99']:.0f} us")
            return 0 if good else 1
        finally:
            server.terminate()
            server.wait()


if __name__ == "__main__":
    sys.exit(main())
