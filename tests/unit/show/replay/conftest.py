"""Folders with the journal of a mission in each; they are flown once."""

from pathlib import Path

import pytest

from tests.unit.show.replay.flown import ABORTED, BLOCKED, GOOD, Flown, fly


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Return two missions that went well, the second five minutes after the first."""
    return fly(tmp_path_factory.mktemp("good"), GOOD, again=2)


@pytest.fixture(scope="session")
def blocked(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Return a mission that failed on its way."""
    return fly(tmp_path_factory.mktemp("blocked"), BLOCKED)


@pytest.fixture(scope="session")
def aborted(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Return a mission that a person aborted."""
    return fly(tmp_path_factory.mktemp("aborted"), ABORTED)


@pytest.fixture
def here(blocked: Flown, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in the folder of the mission that failed; no engine runs there."""
    monkeypatch.chdir(blocked.folder)
    monkeypatch.setenv("TZ", "UTC")
    monkeypatch.delenv("FORMIGA_URL", raising=False)
    monkeypatch.delenv("FORMIGA_SITE", raising=False)
    return blocked.folder
