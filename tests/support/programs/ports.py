"""Ports for programs that tests start."""

import contextlib
import random
import socket


def free_ports(count, kind=socket.SOCK_STREAM):
    """None of those that the kernel gives to programs that ask for any: such a program could have it before the one of the test."""
    ports = []
    while len(ports) < count:
        port = random.randrange(10000, 32768)
        with socket.socket(socket.AF_INET, kind) as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            ports += [port] * (port not in ports)
    return ports
