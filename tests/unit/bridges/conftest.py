"""The catalogue that ships, and the trees that bridges are tried on."""

from pathlib import Path

import pytest

from formiga_bt.cli.inputs import CheckWorld, read_world

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def world() -> CheckWorld:
    return read_world([ROOT / "actions" / "base.yaml"])
