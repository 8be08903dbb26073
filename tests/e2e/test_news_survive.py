"""News survive a dead receiver and two kills of the engine: real processes, real sockets, a real disk.

10,000 of them, and their times: `python benchmarks/bench_news.py`.
"""

from pathlib import Path

import pytest

from benchmarks.bench_news import Engine, Receiver, survive

pytestmark = pytest.mark.network
NEWS = 240


def test_none_is_lost_and_doubles_have_their_id(tmp_path: Path) -> None:
    receiver = Receiver()
    engine = Engine(tmp_path, receiver)
    try:
        found = survive(engine, receiver, NEWS)
    finally:
        engine.end()
        receiver.end()
    assert (found.lost, found.changed) == (0, 0)
    assert found.in_outbox >= found.answered >= NEWS
    assert found.came >= found.in_outbox
    log = (tmp_path / "engine.log").read_text(encoding="utf-8")
    assert "whsec" not in log
    assert str(receiver.port) not in log
