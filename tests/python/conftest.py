"""What the tests of cells share: where scenarios and programs are."""

import signal
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# A shell's background jobs ignore SIGINT, and Python leaves that as it is: tests of Ctrl-C would wait for ever.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def config():
    return ROOT / "config"
