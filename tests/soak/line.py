#!/usr/bin/env python3
"""A line between two network namespaces that loses, repeats and delays packets, so that later ones overtake them.

    line.py NAMESPACE DEVICE NAMESPACE DEVICE      (as root; the namespaces exist)

Makes a TUN device in each namespace, says "ready", and carries IP packets both ways. Each line of standard input says how
from now on: words `lose=P twice=P late=P up_to_ms=T`, P in percent of the packets, each at random of its own; what
is not named is 0. A late packet, and the second of a pair, waits for a random time of up to T. Each such line, and the
end of the input, is answered by what was done since the one before:

    carried=N lost=N twice=N late=N overtaken=N refused=N

overtaken: packets that left the line after one that had entered it later, the same way (RFC 4737, type-P-reordered;
second ones of a pair are not counted). refused: the device at the end was down.
"""
import ctypes
import fcntl
import heapq
import os
import random
import select
import struct
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI, CLONE_NEWNET = 0x400454CA, 0x0001, 0x1000, 0x40000000
LARGEST_PACKET = 65536
COUNTS = ("carried", "lost", "twice", "late", "overtaken", "refused")


def open_device(namespace, name):
    """A TUN device in a namespace, which this process enters for it."""
    fd = os.open(f"/run/netns/{namespace}", os.O_RDONLY)
    if ctypes.CDLL(None, use_errno=True).setns(fd, CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), f"cannot enter the network namespace {namespace}")
    os.close(fd)
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TUN | IFF_NO_PI))
    return device


class Line:
    def __init__(self, ends):
        self.other = {ends[0]: ends[1], ends[1]: ends[0]}
        self.entered = dict.fromkeys(ends, 0)  # packets so far, by where they came from
        self.newest_left = dict.fromkeys(ends, 0)
        self.waiting = []  # heap of (when, tie, from, number, packet); number 0: a second one
        self.ties = 0
        self.dice = random.Random(1)
        self.how = {}
        self.counts = dict.fromkeys(COUNTS, 0)

    def order(self, words):
        how = dict.fromkeys(("lose", "twice", "late", "up_to_ms"), 0.0)
        for word in words.split():
            name, _, value = word.partition("=")
            if name not in how:
                raise ValueError(f"'{name}': there are {', '.join(how)}")
            how[name] = float(value)
        self.how = how

    def report(self):
        print(" ".join(f"{name}={self.counts[name]}" for name in COUNTS), flush=True)
        self.counts = dict.fromkeys(COUNTS, 0)

    def happens(self, what):
        return self.dice.random() * 100.0 < self.how[what]

    def enter(self, end, packet):
        self.entered[end] += 1
        number = self.entered[end]
        if self.happens("lose"):
            self.counts["lost"] += 1
            return
        twice, late = self.happens("twice"), self.happens("late")
        if late:
            self.counts["late"] += 1
            self.wait(end, number, packet)
        else:
            self.leave(end, number, packet)
        if twice:
            self.counts["twice"] += 1
            self.wait(end, 0, packet)

    def wait(self, end, number, packet):
        seconds = 1e-3 * self.how["up_to_ms"] * self.dice.random()
        if seconds == 0.0:
            self.leave(end, number, packet)
            return
        self.ties += 1
        heapq.heappush(self.waiting, (time.monotonic() + seconds, self.ties, end, number, packet))

    def leave(self, end, number, packet):
        try:
            os.write(self.other[end], packet)
        except OSError:
            self.counts["refused"] += 1
            return
        if number == 0:
            return
        self.counts["carried"] += 1
        if number < self.newest_left[end]:
            self.counts["overtaken"] += 1
        else:
            self.newest_left[end] = number

    def carry(self):
        self.order("")
        orders = b""
        while True:
            pause = max(0.0, self.waiting[0][0] - time.monotonic()) if self.waiting else None
            ready, _, _ = select.select([*self.other, sys.stdin], [], [], pause)
            while self.waiting and self.waiting[0][0] <= time.monotonic():
                self.leave(*heapq.heappop(self.waiting)[2:])
            for end in self.other:
                try:
                    if end in ready:
                        self.enter(end, os.read(end, LARGEST_PACKET))
                except BlockingIOError:
                    pass
            if sys.stdin in ready:
                text = os.read(sys.stdin.fileno(), 4096)
                *lines, orders = (orders + text).split(b"\n")
                for words in lines:
                    self.report()
                    self.order(words.decode())
                if not text:
                    self.report()
                    return


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    line = Line([open_device(*sys.argv[1:3]), open_device(*sys.argv[3:5])])
    print("ready", flush=True)
    line.carry()


if __name__ == "__main__":
    main()
