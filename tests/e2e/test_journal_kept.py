"""Nothing that was acknowledged is forgotten, whoever looks at the journal meanwhile: the engine itself, others, any tool."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.client import Client, PastClient
from tests.e2e.test_resume import kill
from tests.e2e.test_service import ASK, Shell, new_site

pytestmark = pytest.mark.network

READERS = (
    ("replay", "--text"),
    ("map", "--all", "--at", "end", "--ascii"),
    ("journal", "stats"),
    ("why", "Ask-1", "--at", "end"),
)
"""Commands that look at the live journal from outside."""


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    (made.folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    yield made
    made.close()


def submit(at: EngineAddress) -> str:
    return Client(at).request("Ask")


def known(at: EngineAddress) -> set[str]:
    return {one.id for one in Client(at).tasks().tasks}


def journal_of(shell: Shell) -> Path:
    (file,) = shell.folder.glob(".formiga/*/journal.db")
    return file


def look_inside(at: EngineAddress, old: str) -> None:
    """Have the engine look into its own journal."""
    PastClient(Client(at), "").now()
    PastClient(Client(at), f"{old} start").task(old)
    Client(at).why(old)


def test_what_is_acknowledged_outlives_looks_at_the_live_journal_from_inside_and_outside(shell: Shell) -> None:
    at = shell.up("--desk", "watcher_1")
    first = submit(at)
    kill(shell)
    at = shell.up("--desk", "watcher_1")
    acknowledged = {first, submit(at)}
    look_inside(at, first)
    for reader in READERS:
        shell.run(*reader)
        acknowledged.add(submit(at))
    kill(shell)

    at = shell.up("--desk", "watcher_1")
    assert known(at) == acknowledged
    assert submit(at) not in acknowledged
