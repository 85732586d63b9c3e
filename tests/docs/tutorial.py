"""Follows a tutorial from an empty folder, as it is written. Usage: tutorial.py PAGE.md --bin DIR --config DIR
[--python DIR] [--install BUILD] [--typed-limit N]

A fenced block is one step of the page:
  ```LANGUAGE title="FILE"   FILE gets this text
  ```bash                    these commands run; a failure ends the tutorial
  ```text                    the block of commands before printed these lines, in this order
Any other block is an illustration and is not executed. In an expected line `...` stands for any characters, a line `...`
for any lines, and white space counts as one blank. All commands of a page run in one shell, so that variables and
background jobs stay; the jobs end with the page. Exit code 77: what the page needs is missing."""
import argparse
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

FENCE = re.compile(r"^(```+)([a-z]*)\s*(.*)$")
TITLE = re.compile(r'title="([^"]+)"')


class TutorialError(Exception):
    pass


@dataclass
class Step:
    line: int
    kind: str  # file, commands
    text: str
    name: str = ""
    expected: list = field(default_factory=list)


def steps_of(page):
    """The steps of a page; expected lines belong to the commands before them."""
    steps, block, head = [], None, None
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        fence = FENCE.match(line)
        if block is None and fence:
            block, head = [], (number, fence[1], fence[2], TITLE.search(fence[3]))
        elif block is not None and line == head[1]:
            start, _, language, title = head
            text = "\n".join(block) + "\n"
            if title:
                steps.append(Step(start, "file", text, title[1]))
            elif language == "bash":
                steps.append(Step(start, "commands", text))
            elif language == "text":
                if not steps or steps[-1].kind != "commands":
                    raise TutorialError(f"{page.name}:{start}: found expected lines; allowed: behind a block of commands alone")
                steps[-1].expected += block
            block = None
        elif block is not None:
            block.append(line)
    if block is not None:
        raise TutorialError(f"{page.name}:{head[0]}: found a fence without an end")
    return steps


def script_of(steps, outputs):
    lines = ["set -euo pipefail", "exec 3>&1"]
    for number, step in enumerate(steps):
        lines.append(f"echo {number} >&3")
        if step.kind == "file":
            lines += [f"mkdir -p \"$(dirname '{step.name}')\"", f"cat >'{step.name}' <<'END_OF_FILE'", step.text + "END_OF_FILE"]
        else:
            lines += [f"exec >'{outputs}/{number}' 2>&1", step.text]
    return "\n".join(lines) + "\n"


def pattern_of(line):
    words = " ".join(line.split())
    return re.compile(".*".join(re.escape(part) for part in words.split("...")) + r"\Z")


def missing_line(expected, output):
    """The first expected line that the output does not have behind the ones before it, or None."""
    lines = [" ".join(line.split()) for line in output.splitlines()]
    place = 0
    for line in expected:
        if line.strip() in ("", "..."):
            continue
        pattern = pattern_of(line)
        found = next((i for i in range(place, len(lines)) if pattern.match(lines[i])), None)
        if found is None:
            return line
        place = found + 1
    return None


def typed(steps):
    """Characters that a reader types or copies: files and commands, without comments of the shell."""
    return sum(len(re.sub(r"(?m)\s+#.*$", "", step.text)) for step in steps)


def free_domain():
    """A DDS domain whose first port no program on this machine uses, and the socket that keeps other tutorials, whose cells
    have the same name, from it."""
    used = "".join(Path(name).read_text() for name in ("/proc/net/udp", "/proc/net/udp6") if Path(name).exists())
    for domain in random.sample(range(101, 200), 99):
        if f":{7400 + 250 * domain:04X} " in used:
            continue
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f"\0takt_tutorial_{domain}")
        except OSError:
            continue
        return domain, claim
    raise TutorialError("every DDS domain from 101 to 199 is in use")


def environment_of(arguments, folder, domain):
    environment = dict(os.environ)
    environment["PATH"] = f"{arguments.bin.resolve()}:{environment['PATH']}"
    environment["TAKT_CONFIG"] = str(arguments.config.resolve())
    environment["HOME"] = str(folder.parent)
    environment.setdefault("TAKT_CACHE_DIR", str(folder.parent))
    environment["TAKT_DOMAIN"] = str(domain)
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    environment.pop("TAKT_CELL", None)
    if arguments.python:
        environment["PYTHONPATH"] = str(arguments.python.resolve())
    programs = folder.parent / "programs"  # python3 is the one that runs this: the package is built for it
    programs.mkdir()
    (programs / "python3").symlink_to(sys.executable)
    environment["PATH"] = f"{programs}:{environment['PATH']}"
    if arguments.install:
        install(arguments.install, folder.parent / "usr")
        environment["CMAKE_PREFIX_PATH"] = str(folder.parent / "usr")
    return environment


def install(build, prefix):
    result = subprocess.run(["cmake", "--install", str(build), "--prefix", str(prefix)], text=True, capture_output=True)
    if result.returncode != 0:
        raise TutorialError(f"cmake --install {build} failed:\n{result.stderr[-2000:]}")


def follow(page, steps, arguments):
    scratch = Path(tempfile.mkdtemp(prefix="takt_tutorial."))
    folder, outputs = scratch / "empty", scratch / "outputs"
    folder.mkdir()
    outputs.mkdir()
    domain, claim = free_domain()
    shell = subprocess.Popen(["bash", "-c", script_of(steps, outputs)], cwd=folder,
                             env=environment_of(arguments, folder, domain), stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True, start_new_session=True)
    try:
        progress, _ = shell.communicate(timeout=arguments.timeout) if not any_job(steps) else (read_progress(shell), None)
        code = shell.wait(timeout=arguments.timeout)
        numbers = [int(word) for word in progress.split() if word.isdigit()]
        last = steps[numbers[-1]] if numbers else steps[0]
        for number, step in enumerate(steps):
            output = (outputs / str(number)).read_text(errors="replace") if (outputs / str(number)).exists() else ""
            if step is last and code != 0:
                raise TutorialError(f"{page.name}:{step.line}: this step failed with code {code}; it printed:\n{output[-4000:]}")
            line = missing_line(step.expected, output)
            if line is not None:
                raise TutorialError(f"{page.name}:{step.line}: the page promises this line:\n{line}\nthe commands printed:\n{output[-4000:]}")
    except subprocess.TimeoutExpired:
        raise TutorialError(f"{page.name}: not at its end after {arguments.timeout} s") from None
    finally:
        try:
            os.killpg(shell.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        claim.close()
        shutil.rmtree(scratch, ignore_errors=True)


def any_job(steps):
    return any(re.search(r"(?m)&\s*(#.*)?$", step.text) for step in steps if step.kind == "commands")


def read_progress(shell):
    """What the shell wrote until it ended; background jobs keep its descriptor 3 open, so that there is no end of file."""
    shell.wait()
    os.set_blocking(shell.stdout.fileno(), False)
    with shell.stdout:
        return shell.stdout.read() or ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("page", type=Path)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--python", type=Path)
    parser.add_argument("--install", type=Path, help="build folder to be installed, for find_package(takt)")
    parser.add_argument("--timeout", type=float, default=240)
    parser.add_argument("--typed-limit", type=int, help="most characters that the reader may have to type")
    arguments = parser.parse_args()
    try:
        steps = steps_of(arguments.page)
        if not any(step.kind == "commands" for step in steps):
            raise TutorialError(f"{arguments.page.name}: it has no block of commands")
        follow(arguments.page, steps, arguments)
        if arguments.typed_limit and typed(steps) > arguments.typed_limit:
            raise TutorialError(f"{arguments.page.name}: {typed(steps)} characters to type; allowed: {arguments.typed_limit}")
    except TutorialError as error:
        sys.exit(f"tutorial: {error}")
    print(f"{arguments.page.name}: {len(steps)} steps, {typed(steps)} characters")
    return 0


if __name__ == "__main__":
    sys.exit(main())
