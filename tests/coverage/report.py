"""Branches that the tests have taken: report.py SOURCES BUILD PROFILE, after the tests of the coverage preset.

Prints each file of boundary.txt with its share, the least covered first, and what all of them have together. Ends
with 1 where that is less than the goal of quality.md. The branches that were not taken: llvm-cov show, whose command
is printed.
"""

import fnmatch
import json
import os
import subprocess
import sys
from pathlib import Path

GOAL_PERCENT = 90.0


def objects_of(build):
    """Programs and modules that hold counters."""
    found = [path for path in (build / "bin").iterdir() if path.is_file() and os.access(path, os.X_OK)]
    found += (build / "python").rglob("*.so")
    return [str(path) for path in sorted(found) if path.read_bytes()[:4] == b"\x7fELF"]


def main():
    sources, build, profile = (Path(argument).resolve() for argument in sys.argv[1:4])
    patterns = [line.strip() for line in (Path(__file__).parent / "boundary.txt").read_text().splitlines()]
    patterns = [line for line in patterns if line and not line.startswith("#")]
    first, *others = objects_of(build)
    command = [first, *(word for name in others for word in ("-object", name)), f"-instr-profile={profile}"]
    export = subprocess.run(["llvm-cov", "export", "-summary-only", *command], check=True, capture_output=True)
    rows, unused = [], set(patterns)
    for file in json.loads(export.stdout)["data"][0]["files"]:
        path = Path(file["filename"])
        if not path.is_relative_to(sources):
            continue
        name = str(path.relative_to(sources))
        matching = [pattern for pattern in patterns if fnmatch.fnmatchcase(name, pattern) and
                    name.count("/") == pattern.count("/")]
        unused -= set(matching)
        branches = file["summary"]["branches"]
        if matching and branches["count"] > 0:
            rows.append((branches["covered"], branches["count"], name))
    for pattern in sorted(unused):
        print(f"note: nothing is counted of {pattern}")
    for covered, count, name in sorted(rows, key=lambda row: row[0] / row[1]):
        print(f"{100 * covered / count:6.1f} %  {covered:5} of {count:5}  {name}")
    covered, count = sum(row[0] for row in rows), sum(row[1] for row in rows)
    percent = 100 * covered / max(count, 1)
    print(f"{percent:6.1f} %  {covered:5} of {count:5}  all {len(rows)} files (goal {GOAL_PERCENT:g} %)")
    script = build / "uncovered.sh"
    script.write_text("#!/bin/sh\n# uncovered.sh FILE: its lines, with how often each branch was taken\nexec llvm-cov show "
                      "-show-branches=count " + " ".join(command) + ' "$@"\n')
    print(f"which branches of a file: sh {script.relative_to(sources)} FILE")
    return 0 if percent >= GOAL_PERCENT else 1


if __name__ == "__main__":
    sys.exit(main())
