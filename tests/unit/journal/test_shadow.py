"""Snapshots beside the engine, and steps whose commit is waited for in another thread."""

import time
from collections.abc import Callable

import msgspec
import pytest

from formiga_bt.engine.drivers.persist import DURABLE, Ahead, Outcome, PersistAhead
from formiga_bt.engine.state import EngineState, fold
from formiga_bt.journal import codec
from formiga_bt.journal.codec import SLICE, Codec
from formiga_bt.journal.past import Past, without_ended
from formiga_bt.journal.store import Journal, Overtaken
from tests.unit.journal.conftest import Opener, Recording, as_told, folded, steps_of

LONG = steps_of("pick_up")


def wait_until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not done():
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.002)


@pytest.mark.parametrize("thin", [False, True])
def test_snapshots_written_beside_are_the_fold_up_to_them(taken: Journal, thin: bool) -> None:
    recording = Recording(taken, thin=thin, snapshot_steps=40, beside=True)
    for first in range(0, len(LONG), 40):
        recording.feed(LONG[first : first + 40], 8)
        wait_until(lambda: not recording.writer._shadow._given)  # type: ignore[union-attr]
    live = as_told(recording.writer.view(recording.state))
    recording.writer.end()
    found = taken.snapshots()
    assert len(found) > 4
    assert as_told(Past(taken).state()) == live
    for _, at in found[1:-1]:
        state = taken.snapshot_at(at)
        assert state is not None
        whole, board = EngineState(), recording.board
        for kept in taken.read(to=state.seq):
            fold(whole, board, kept.step)
        if not thin:
            assert state == without_ended(whole)
        else:
            assert (state.seq, state.tasks, state.memory, state.scopes) == (
                whole.seq, whole.tasks, whole.memory, whole.scopes,
            )  # fmt: skip
            assert Past(taken).state(at).agents.keys() == whole.agents.keys()


def test_an_engine_whose_site_was_taken_writes_no_snapshot_beside(opened: Opener) -> None:
    old = opened()
    old.take()
    Recording(old).feed(LONG[:20], 20)
    new = opened()
    new._release = lambda: None
    old.epoch -= 1  # as another engine's take makes it
    with pytest.raises(Overtaken):
        old.snapshot_beside(EngineState(), 0, lambda: None)


def test_a_state_in_slices_has_the_bytes_of_the_whole() -> None:
    states = [EngineState(), *(folded(steps_of(name)) for name in ("survey", "pick_up"))]
    many = folded(LONG)
    many.counters |= {f"n{n}": n for n in range(70_000)}
    many.agents |= {f"a{n}": next(iter(many.agents.values())) for n in range(3 * SLICE + 1)}
    pauses = []
    for state in [*states, many]:
        whole = msgspec.msgpack.encode(codec._lowered(state))
        assert b"".join(codec._sliced(state, lambda: pauses.append(1))) == whole
        assert Codec({}, 0).decode_state(Codec({}, 0).encode_state(state)) == state
    assert len(pauses) > 70_000 / SLICE


def test_steps_are_there_after_the_commit_and_not_before(taken: Journal, opened: Opener) -> None:
    recording = Recording(taken, thin=False)
    assert isinstance(recording.writer, PersistAhead)
    other = opened(read_only=True)
    ahead: Ahead[str] = Ahead(recording.writer)
    for step in LONG[:5]:
        fold(recording.state, recording.board, step)
    assert recording.writer.start(LONG[:5])
    assert list(other.read()) == []
    recording.writer.commit()
    assert [kept.step for kept in other.read()] == list(LONG[:5])
    assert recording.writer.finish() == DURABLE
    ahead.begin("batch", LONG[5:9])
    assert ahead.is_under_way
    assert ahead.end() == ("batch", Outcome(True))
    assert [kept.step for kept in other.read()] == list(LONG[:9])
    ahead.begin("nothing", [])
    assert ahead.is_done, "there is nothing to wait for"
    assert ahead.end() == ("nothing", DURABLE)
    ahead.close()


def test_an_error_of_the_commit_comes_back_with_the_batch(taken: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recording(taken, thin=False)

    def overtaken(*_: object) -> Callable[[], None]:
        def commit() -> None:
            raise Overtaken("gone")

        return commit

    monkeypatch.setattr(taken, "stage", overtaken)
    ahead: Ahead[int] = Ahead(recording.writer)
    ahead.begin(7, LONG[:5])
    batch, kept = ahead.end()
    assert batch == 7
    assert isinstance(kept, Overtaken)
    ahead.close()
