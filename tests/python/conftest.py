"""What the tests of cells share: where scenarios and programs are."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def config():
    return ROOT / "config"
