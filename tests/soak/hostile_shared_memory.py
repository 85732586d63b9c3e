#!/usr/bin/env python3
"""Shared memory of Fast DDS in hostile hands while a cell plays: garbage, missing files, no room.

hostile_shared_memory.py BIN CONFIG

takt's own participants use UDP alone. The files belong to a client with the transports that Fast DDS has by default, as a
node of ROS 2 has them. It may end by them; the server and its other clients go on.
"""
import glob
import os
import random
import sys
import time

import drill

GARBAGE_S = 5.0


def ports():
    return [file for file in glob.glob("/dev/shm/fastrtps_port*") if not file.endswith("_el")]


def segments():
    return [file for file in glob.glob("/dev/shm/fastrtps_*") if "port" not in file and not file.endswith("_el")]


DEFAULT_TRANSPORTS = """<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="takt_client">
    <rtps><useBuiltinTransports>true</useBuiltinTransports></rtps>
  </participant>
</profiles>
"""


def mapped(child):
    """Files of shared memory that this program has mapped."""
    with open(f"/proc/{child.pid}/maps") as maps:
        return {line.split()[5] for line in maps if "/dev/shm/" in line}


def write_garbage(server, files, seed, whole=False):
    """Random bytes at random places of these files for some seconds, as any program of the same user can write. The
    end of the server ends it."""
    rng = random.Random(seed)
    end = time.monotonic() + GARBAGE_S
    while time.monotonic() < end and not drill.Drill.ends_within(server, 0.02):
        for file in files():
            try:
                size = os.path.getsize(file)
                with open(file, "r+b") as out:
                    length = size if whole else rng.randrange(1, 64)
                    out.seek(0 if whole else rng.randrange(max(1, size - length)))
                    out.write(rng.randbytes(length))
            except OSError:
                pass


def fill():
    with open("/dev/shm/full", "wb") as out:
        try:
            while True:
                out.write(b"\1" * (1 << 20))
        except OSError:
            pass


def main():
    drill.isolate()
    d = drill.Drill("shared memory", *sys.argv[1:3])

    profiles = d.path("default_transports.xml")
    with open(profiles, "w") as out:
        out.write(DEFAULT_TRANSPORTS)

    def run(name, act):
        for file in glob.glob("/dev/shm/*"):
            os.unlink(file)
        server = d.server()
        if server is None:
            d.row(name, "no cell to begin with: " + d.log()[-60:].strip(), False)
            return
        watcher = d.start("takt", "record", "-", log="watch")
        stock = d.start("takt", "--profiles", profiles, "record", "-", log="stock")
        d.hears(stock, "stock", 20)
        files = {"server": mapped(server), "client": mapped(watcher)}
        if not ports() or not segments():
            d.row(name, "the client with default transports has no shared memory", False)
        elif any(files.values()):
            d.row(name, f"takt has files: {files}"[:58], False)
        d.served_on(name, server, lambda: act(server))
        if not d.hears(watcher, "watch", 20):
            d.row("  " + name, "its other client hears nothing", False)
        for child in (stock, watcher, server):
            d.end(child)

    run("nothing (to compare with)", lambda server: d.ends_within(server, GARBAGE_S))
    run("random bytes in ports", lambda server: write_garbage(server, ports, 1))
    run("ports overwritten as a whole", lambda server: write_garbage(server, ports, 2, whole=True))
    run("random bytes in segments", lambda server: write_garbage(server, segments, 3))
    run("segments overwritten as a whole", lambda server: write_garbage(server, segments, 4, whole=True))

    def unlink(_):
        for file in glob.glob("/dev/shm/*"):
            os.unlink(file)

    def cut(_):
        for file in ports() + segments():
            os.truncate(file, 0)

    run("all files unlinked", unlink)
    run("files cut to nothing", cut)

    def full(server):
        fill()
        d.ends_within(server, 3)

    run("/dev/shm full while the cell plays", full)
    for file in glob.glob("/dev/shm/*"):
        os.unlink(file)
    fill()
    server = d.server()
    if server is not None:
        d.served_on("/dev/shm full before the start", server, lambda: d.ends_within(server, 1))
    else:
        d.row("/dev/shm full before the start", "not served: " + d.log()[-45:].strip().replace("\n", " "), False)
    d.end(server)
    d.finish()


main()
