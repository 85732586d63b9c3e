#!/usr/bin/env python3
"""Makes the files of LinuxCNC's soft PLC (ClassicLadder, with mb2hal as its Modbus client) from a ladder program in text:

    ladder.py PROGRAM.ladder FOLDER [--port 5020] [--address 127.0.0.1] [--period-ms 10]
    cd FOLDER && ./run.sh

A line of the program is a rung, with parallel branches of contacts in series. ! is a normally closed contact:

    Q1 = !I2 !B1 | I2 B1          coil
    set Q0 = I0 !I2               latch; reset Q0 = ... takes it back

I0 to I31 are discrete inputs 0 to 31 of takt-modbus, Q0 to Q31 its coils, B0 to B49 bits of the program. A rung has at most
6 branches of at most 8 contacts. # begins a remark.
"""
import argparse
import pathlib
import re
import sys

COLUMNS, ROWS, MOST_RUNGS, MOST_BITS, MOST_POINTS = 10, 6, 100, 50, 32
VARIABLES = {"B": 0, "I": 50, "Q": 60}
COILS = {"": 50, "set": 52, "reset": 53}
OPEN, CLOSED, WIRE = 1, 2, 9


class LadderError(Exception):
    pass


def variable(word, place, outputs_only=False):
    match = re.fullmatch(r"([BIQ])(\d+)", word)
    if not match or (outputs_only and match[1] == "I"):
        allowed = "Q0 to Q31 or B0 to B49" if outputs_only else "I0 to I31, Q0 to Q31 or B0 to B49"
        raise LadderError(f"{place}: '{word}'; allowed: {allowed}")
    number = int(match[2])
    most = MOST_BITS if match[1] == "B" else MOST_POINTS
    if number >= most:
        raise LadderError(f"{place}: '{word}'; allowed: numbers 0 to {most - 1}")
    return match[1], number


def parse(text, name):
    """Rungs: (type of coil, its variable, branches of (closed, variable))."""
    rungs = []
    for number, line in enumerate(text.splitlines(), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        place = f"{name}:{number}"
        if line.count("=") != 1:
            raise LadderError(f"{place}: '{line}'; a rung is COIL = CONTACTS")
        left, right = (side.split() for side in line.split("="))
        if len(left) not in (1, 2) or (len(left) == 2 and left[0] not in ("set", "reset")):
            raise LadderError(f"{place}: '{' '.join(left)}'; allowed: Q0, set Q0 or reset Q0")
        branches = []
        for branch in " ".join(right).split("|"):
            contacts = [(w.startswith("!"), variable(w.lstrip("!"), place)) for w in branch.split()]
            if not 1 <= len(contacts) <= COLUMNS - 2:
                raise LadderError(f"{place}: a branch with {len(contacts)} contacts; allowed: 1 to {COLUMNS - 2}")
            branches.append(contacts)
        if len(branches) > ROWS:
            raise LadderError(f"{place}: {len(branches)} branches; allowed: at most {ROWS}")
        rungs.append((COILS[left[0] if len(left) == 2 else ""], variable(left[-1], place, True), branches))
    if not 1 <= len(rungs) <= MOST_RUNGS:
        raise LadderError(f"{name}: {len(rungs)} rungs; allowed: 1 to {MOST_RUNGS}")
    return rungs


def element(kind, connected=0, where=("B", 0)):
    return f"{kind}-{connected}-{VARIABLES[where[0]]}/{where[1]}"


def rung_text(rung, number, count):
    coil, output, branches = rung
    join = max(len(branch) for branch in branches)  # where parallel branches meet
    grid = [[element(0) for _ in range(COLUMNS)] for _ in range(ROWS)]
    for row, branch in enumerate(branches):
        for column in range(join):
            grid[row][column] = element(WIRE)
        for column, (closed, where) in enumerate(branch):
            grid[row][column] = element(CLOSED if closed else OPEN, 0, where)
        if row > 0:
            grid[row][join] = element(0, 1)
    for column in range(join, COLUMNS - 1):
        grid[0][column] = element(WIRE)
    grid[0][COLUMNS - 1] = element(coil, 0, output)
    after = number + 1 if number + 1 < count else -1
    head = f"#VER=2.0\n#LABEL=\n#COMMENT=\n#PREVRUNG={number - 1}\n#NEXTRUNG={after}\n"
    return head + "".join(" , ".join(row) + "\n" for row in grid)


def project_text(rungs, period_ms):
    files = {
        "symbols.csv": "#VER=1.0\n",
        "modbusioconf.csv": "#VER=1.0\n",
        "com_params.txt": "MODBUS_MASTER_SERIAL_PORT=\n",
        "sections.csv": f"#VER=1.0\n#NAME000=Prog1\n000,0,-1,0,{len(rungs) - 1},0\n",
        "arithmetic_expressions.csv": "#VER=2.0\n",
        "ioconf.csv": "#VER=1.0\n",
        "general.txt": f"PERIODIC_REFRESH={period_ms}\nSIZE_NBR_RUNGS={MOST_RUNGS}\nSIZE_NBR_BITS={MOST_BITS}\n"
        "SIZE_NBR_WORDS=50\nSIZE_NBR_TIMERS=10\nSIZE_NBR_MONOSTABLES=10\nSIZE_NBR_COUNTERS=10\n"
        f"SIZE_NBR_TIMERS_IEC=10\nSIZE_NBR_PHYS_INPUTS={MOST_POINTS}\nSIZE_NBR_PHYS_OUTPUTS={MOST_POINTS}\n"
        "SIZE_NBR_ARITHM_EXPR=50\nSIZE_NBR_SECTIONS=10\nSIZE_NBR_SYMBOLS=50\n",
    }
    for number, rung in enumerate(rungs):
        files[f"rung_{number}.csv"] = rung_text(rung, number, len(rungs))
    body = "".join(f"_FILE-{name}\n{text}_/FILE-{name}\n" for name, text in files.items())
    return f"_FILES_CLASSICLADDER\n{body}_/FILES_CLASSICLADDER\n"


def points(rungs):
    """How many inputs and outputs the program has."""
    used = {"I": 0, "Q": 0, "B": 0}
    for _, output, branches in rungs:
        for kind, number in [output] + [where for branch in branches for _, where in branch]:
            used[kind] = max(used[kind], number + 1)
    return used["I"], used["Q"]


def write(rungs, folder, address, port, period_ms):
    folder.mkdir(parents=True, exist_ok=True)
    inputs, outputs = points(rungs)
    (folder / "plc.clp").write_text(project_text(rungs, period_ms))
    transactions = []
    if inputs:
        transactions.append(("fnct_02_read_discrete_inputs", "in", inputs))
    if outputs:
        transactions.append(("fnct_15_write_multiple_coils", "out", outputs))
    ini = f"[MB2HAL_INIT]\nINIT_DEBUG=0\nHAL_MODULE_NAME=mb2hal\nSLOWDOWN=0.0\nTOTAL_TRANSACTIONS={len(transactions)}\n"
    for number, (code, name, count) in enumerate(transactions):
        ini += (
            f"[TRANSACTION_{number:02}]\nLINK_TYPE=tcp\nTCP_IP={address}\nTCP_PORT={port}\nMB_SLAVE_ID=1\n"
            f"FIRST_ELEMENT=0\nNELEMENTS={count}\nMB_TX_CODE={code}\nMB_RESPONSE_TIMEOUT_MS=500\n"
            f"MB_BYTE_TIMEOUT_MS=500\nHAL_TX_NAME={name}\nMAX_UPDATE_RATE=100.0\nDEBUG=0\n"
        )
    (folder / "mb2hal.ini").write_text(ini)
    hal = (
        f"loadrt threads name1=slow period1={period_ms * 1000000}\n"
        f"loadrt classicladder_rt numPhysInputs={MOST_POINTS} numPhysOutputs={MOST_POINTS} numRungs={MOST_RUNGS} "
        f"numBits={MOST_BITS} numWords=50\n"
        "loadusr -w classicladder --nogui plc.clp\n"
        "loadusr -Wn mb2hal mb2hal config=mb2hal.ini\n"
    )
    for i in range(inputs):
        hal += f"net i{i} mb2hal.in.{i:02} => classicladder.0.in-{i:02}\n"
    for i in range(outputs):
        hal += f"net o{i} classicladder.0.out-{i:02} => mb2hal.out.{i:02}\n"
    # The script, and with it the PLC, ends when a line comes out of the pipe.
    hal += "addf classicladder.0.refresh slow\nstart\nloadusr -w sh running.sh\n"
    (folder / "plc.hal").write_text(hal)
    (folder / "running.sh").write_text('echo "The PLC runs."\nread -r line <stop.pipe\n')
    (folder / "run.sh").write_text(
        "#!/bin/sh\n# The PLC runs until ./stop.sh. It needs Debian's linuxcnc-uspace, and no real-time kernel.\n"
        'cd "$(dirname "$0")" || exit 1\n'
        'export RTAPI_UID=65534 RTAPI_FIFO_PATH="$PWD/.rtapi_fifo" HOME="$PWD"\n'
        "rm -f stop.pipe\nmkfifo stop.pipe\nchmod a+rwx . stop.pipe\n"
        "exec halrun -f plc.hal\n"
    )
    (folder / "stop.sh").write_text(
        '#!/bin/sh\ncd "$(dirname "$0")" && exec timeout 5 sh -c "echo stop >stop.pipe"\n'
    )
    for script in ("run.sh", "stop.sh"):
        (folder / script).chmod(0o755)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=5020)
    parser.add_argument("--period-ms", type=int, default=10)
    options = parser.parse_args()
    try:
        rungs = parse(options.program.read_text(), options.program.name)
    except (LadderError, OSError) as error:
        sys.exit(f"ladder.py: {error}")
    write(rungs, options.folder, options.address, options.port, options.period_ms)
    inputs, outputs = points(rungs)
    print(f"{len(rungs)} rungs, {inputs} inputs, {outputs} outputs: {options.folder}/run.sh")


if __name__ == "__main__":
    main()
