#!/usr/bin/env python3
"""A server that runs out of resources, is stopped, or gets another time of day; and fifty clients at once.

hostile_processes.py BIN CONFIG
"""
import concurrent.futures
import os
import resource
import signal
import subprocess
import sys

import drill

# The time of day, shifted by the number of seconds that stands in a file. Steady clocks stay.
CLOCK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
static int (*real)(clockid_t, struct timespec*);
int clock_gettime(clockid_t clock, struct timespec* now) {
  if (!real) real = (int (*)(clockid_t, struct timespec*))dlsym(RTLD_NEXT, "clock_gettime");
  int result = real(clock, now);
  if (clock != CLOCK_REALTIME) return result;
  char text[32] = {0};
  int file = open(getenv("TAKT_DRILL_SHIFT"), O_RDONLY | O_CLOEXEC);
  if (file >= 0) {
    if (read(file, text, sizeof text - 1) > 0) now->tv_sec += atol(text);
    close(file);
  }
  return result;
}
"""


def limited(kind, value):
    """Arguments in front of a program that limit it."""
    return ("prlimit", f"--{kind}={value}:{value}")


def last_line(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip()[:57] if lines else "nothing"


def nothing(d):
    server = d.server()
    d.served_on("nothing (to compare with)", server, lambda: d.ends_within(server, 10))
    d.end(server)


def descriptors(d):
    server = d.server()
    used = len(os.listdir(f"/proc/{server.pid}/fd"))
    _, most = resource.prlimit(server.pid, resource.RLIMIT_NOFILE)

    def act():
        resource.prlimit(server.pid, resource.RLIMIT_NOFILE, (used, most))
        for _ in range(3):
            d.takt("--timeout", "3", "load", f"{d.config}/scenarios/furnace.yaml")
        d.ends_within(server, 2)
        resource.prlimit(server.pid, resource.RLIMIT_NOFILE, (most, most))
        d.takt("load", f"{d.config}/scenarios/block_assembly.yaml")
        d.takt("play")

    d.served_on("no file descriptor left, then again", server, act, growth_MB=40)
    d.end(server)
    for most in (8, 16, 32):
        server = d.server(prefix=limited("nofile", most), log=f"files{most}")
        refusal = last_line(d.log(f"files{most}"))
        if server is not None:
            d.served_on(f"start with {most} file descriptors", server, lambda: d.ends_within(server, 1))
        else:
            child = d.children[-1]
            clear = child.poll() is not None and child.returncode > 0
            d.row(f"start with {most} file descriptors", f"{drill.end_of(child)}: {refusal}"[:58], clear)
        d.end(d.children[-1])


def address_space(d):
    for most_MB in (200, 400, 800):
        server = d.server(prefix=limited("as", most_MB << 20), log=f"as{most_MB}")
        if server is not None:
            def act():
                for name in ("furnace", "block_assembly"):
                    d.takt("load", f"{d.config}/scenarios/{name}.yaml")
                d.takt("play")
            d.served_on(f"address space of {most_MB} MB", server, act, growth_MB=60)
        else:
            child = d.children[-1]
            child_end = drill.end_of(child)
            clear = child.poll() is not None and child.returncode > 0
            d.row(f"address space of {most_MB} MB", f"{child_end}: {last_line(d.log(f'as{most_MB}'))}"[:58], clear)
        d.end(d.children[-1])


def stopped(d):
    server = d.server()
    watcher = d.start("takt", "record", "-", log="stopped")

    def act():
        os.kill(server.pid, signal.SIGSTOP)
        d.ends_within(server, 10)
        os.kill(server.pid, signal.SIGCONT)
        d.ends_within(server, 3)

    after = d.served_on("stopped for 10 s, then continued", server, act)
    resets = after["schedule_resets"] if after else "?"
    heard = d.hears(watcher, "stopped", 20)
    d.row("  its watcher", f"{'hears it again' if heard else 'hears nothing'}; {resets} schedule resets", heard)
    d.end(watcher)
    d.end(server)


def clock(d):
    with open(d.path("clock.c"), "w") as file:
        file.write(CLOCK)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", d.path("clock.so"), d.path("clock.c"), "-ldl"], check=True)

    def shift(seconds):
        with open(d.path("shift.new"), "w") as file:
            file.write(str(seconds))
        os.replace(d.path("shift.new"), d.path("shift"))

    shift(0)
    server = d.server(environment={"LD_PRELOAD": d.path("clock.so"), "TAKT_DRILL_SHIFT": d.path("shift")})
    for name, seconds in (("an hour ahead", 3600), ("a day back", -86400), ("10 years ahead", 315360000), ("true again", 0)):
        def act():
            shift(seconds)
            d.ends_within(server, 7)  # longer than a lease
        watcher = d.start("takt", "record", "-", log="clock")
        d.hears(watcher, "clock", 20)
        d.served_on(f"time of day of the server: {name}", server, act)
        heard = d.hears(watcher, "clock", 20)
        d.row("  a client from before", "hears it still" if heard else "hears nothing", heard)
        d.end(watcher)
    d.end(server)


def crowd(d):
    server = d.server()
    kinds = (("state",), ("status",), ("explain", "P1-B"), ("entities",), ("pause",), ("play",), ("snapshot", "x"),
             ("request", "get_cell"), ("load", "none.yaml"), ("spawn", "X", "none.obj"))
    answers = []

    def act():
        asked = [kinds[i % len(kinds)] for i in range(150)]
        with concurrent.futures.ThreadPoolExecutor(50) as pool:
            answers.extend(zip(asked, pool.map(lambda kind: d.takt("--timeout", "60", *kind, limit=120), asked)))
        d.takt("play")
        d.ends_within(server, 12)  # leases of clients run out

    before = len(os.listdir("/dev/shm"))
    d.served_on("50 clients with requests at once, 150 in all", server, act)
    failed = [(kind, code, text) for kind, (code, text) in answers if code > 100 or code < 0]
    d.row("  their answers", f"{len(answers) - len(failed)} of {len(answers)} answered or refused, "
          f"{len(failed)} died or hung", not failed)
    for kind, code, text in failed:
        print(f"    takt {' '.join(kind)}: {code}, {text.strip()[-300:]}")
    d.row("  files in /dev/shm", f"{before} before, {len(os.listdir('/dev/shm'))} after",
          len(os.listdir("/dev/shm")) <= before + 4)
    d.end(server)


def main():
    drill.isolate()
    d = drill.Drill("processes", *sys.argv[1:3])
    chosen = sys.argv[3:]
    for part in (nothing, descriptors, address_space, stopped, clock, crowd):
        if not chosen or part.__name__ in chosen:
            part(d)
    d.finish()


main()
