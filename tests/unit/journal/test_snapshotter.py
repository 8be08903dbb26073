"""Snapshots beside the engine, and steps whose commit is waited for in another thread."""

import time
from collections.abc import Callable

import msgspec
import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.drivers.persist import DURABLE, Ahead, Outcome, PersistAhead
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.state import EngineState, fold
from formiga_bt.journal import codec
from formiga_bt.journal.codec import SLICE, Codec
from formiga_bt.journal.past import Past, without_ended
from formiga_bt.journal.snapshotter import Cadence
from formiga_bt.journal.store import Journal, Overtaken, Unwritable
from formiga_bt.journal.writer import MEND_S
from tests.unit.journal.conftest import Opener, Recording, as_told, folded, steps_of


def long() -> tuple[EngineStep, ...]:
    """Return the steps of a mission; not when tests are collected."""
    return steps_of("pick_up")


def wait_until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + 20.0
    while not done():
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.002)


@pytest.mark.parametrize("thin", [False, True])
def test_snapshots_written_beside_are_the_fold_up_to_them(taken: Journal, thin: bool) -> None:
    recording = Recording(taken, thin=thin, snapshot_steps=20, beside=True)
    for first in range(0, len(long()), 40):
        recording.feed(long()[first : first + 40], 8)
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
    Recording(old).feed(long()[:20], 20)
    new = opened()
    new._release = lambda: None
    old.epoch -= 1  # as another engine's take makes it
    with pytest.raises(Overtaken):
        old.snapshot_beside(EngineState(), 0, lambda: None)


def test_a_state_in_slices_has_the_bytes_of_the_whole() -> None:
    states = [EngineState(), *(folded(steps_of(name)) for name in ("survey", "pick_up"))]
    many = folded(long())
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
    for step in long()[:5]:
        fold(recording.state, recording.board, step)
    assert recording.writer.start(long()[:5])
    assert list(other.read()) == []
    recording.writer.commit()
    assert [kept.step for kept in other.read()] == list(long()[:5])
    assert recording.writer.finish() == DURABLE
    ahead.begin("batch", long()[5:9])
    assert ahead.is_under_way
    assert ahead.end() == ("batch", Outcome(True))
    assert [kept.step for kept in other.read()] == list(long()[:9])
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
    ahead.begin(7, long()[:5])
    batch, kept = ahead.end()
    assert batch == 7
    assert isinstance(kept, Overtaken)
    ahead.close()


def test_after_a_fault_snapshots_are_made_again_each_minute_at_most(
    taken: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = Recording(taken, thin=False, snapshot_steps=40, beside=True)

    def is_broken() -> bool:
        return recording.writer._shadow is not None and recording.writer._shadow.is_broken

    with monkeypatch.context() as broken:
        broken.setattr(taken, "snapshot_beside", raises(RuntimeError("a bug")))
        recording.feed(long()[:40], 8)
        wait_until(is_broken)
        recording.feed(long()[40:88], 8)  # the first batch is where it begins again
        wait_until(is_broken)
    recording.feed(long()[88:96], 8)
    assert is_broken()
    recording.clock += MEND_S
    recording.feed(long()[96:200], 8)
    wait_until(lambda: len(taken.snapshots()) > 1)
    assert not is_broken()
    live = as_told(recording.writer.view(recording.state))
    recording.writer.end()
    assert as_told(Past(taken).state()) == live


def test_what_is_followed_after_a_full_disk_is_not_ahead_of_what_is_written(
    taken: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = Recording(taken, thin=False, snapshot_steps=8, beside=True)
    with monkeypatch.context() as full:
        full.setattr(taken, "stage", raises(Unwritable("the disk is full")))
        for step in long()[:10]:
            fold(recording.state, recording.board, step)
        assert not recording.writer.keep(long()[:10]).durable
    recording.clock += 2.0
    assert recording.writer.start(())
    for step in long()[10:20]:  # the engine goes on while that is committed
        fold(recording.state, recording.board, step)
    recording.writer.commit()
    assert recording.writer.finish().durable

    assert recording.writer._shadow is not None
    wait_until(lambda: not recording.writer._shadow._given)  # type: ignore[union-attr]
    assert recording.writer._shadow._state.seq <= long()[9].seq
    assert recording.writer.keep(long()[10:20]).durable
    recording.writer.end()


@pytest.mark.parametrize("open_tasks", [0, 500])
def test_a_snapshot_is_due_after_so_many_steps_and_not_before_as_many_as_there_are_open_tasks(open_tasks: int) -> None:
    state = EngineState()
    state.memory = {f"Task-{n}": {} for n in range(open_tasks)}
    cadence = Cadence(100)
    assert not cadence.count(99, 0, state)
    assert cadence.count(1, 0, state) == (open_tasks == 0)
    assert cadence.count(400, 0, state)
    cadence.begin(0)
    assert not cadence.count(1, 3599 * SECOND, state)
    assert cadence.count(0, 3600 * SECOND, state)


def raises(error: Exception) -> Callable[..., None]:
    def fail(*_: object) -> None:
        raise error

    return fail
