"""Any moment of the past: seeking there is folding to there, whatever snapshots lie on the way."""

from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import JournalError
from formiga_bt.engine.kernel.inputs import EngineStep, Started
from formiga_bt.engine.kernel.state import EngineState, board_of, fold
from formiga_bt.journal.past import Past, without_ended
from formiga_bt.journal.store import Journal
from formiga_bt.nodes.blackboard import Blackboard
from tests.golden import Wording
from tests.replay.missions import MISSIONS
from tests.unit.journal.conftest import Opener, Recording, as_told, folded, steps_of
from tests.unit.journal.test_thin import near, without_thinned

LONG = "watch_dogs"


@pytest.mark.parametrize("name", MISSIONS)
def test_the_end_of_each_mission_is_the_live_state(name: str, taken: Journal, opened: Opener) -> None:
    recording = Recording(taken, thin=False, snapshot_steps=100)
    recording.feed(steps_of(name), 20)
    state = Past(opened(read_only=True)).state()
    assert as_told(state) == as_told(recording.state)
    assert state == without_ended(recording.state)
    assert dict(board_of(state).under("/")) == dict(board_of(recording.state).under("/"))


@pytest.mark.parametrize("thin", [False, True])
def test_the_blackboard_of_a_moment_shows_its_state(taken: Journal, thin: bool) -> None:
    steps = steps_of("survey")
    Recording(taken, thin=thin, snapshot_steps=30).feed(steps, 5)
    past = Past(taken)
    at = steps[len(steps) // 2].at
    assert dict(past.board(at).under("/")) == dict(board_of(past.state(at)).under("/"))


@cache
def prefix(until: int) -> EngineState:
    return folded([step for step in steps_of(LONG) if step.at <= until])


def moments() -> st.SearchStrategy[int]:
    steps = steps_of(LONG)
    return st.sampled_from(steps).map(lambda step: step.at) | st.integers(steps[0].at, steps[-1].at + SECOND)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_seeking_a_moment_is_folding_to_it(seekable: Journal, data: st.DataObject) -> None:
    at = data.draw(moments())
    state = Past(seekable).state(at)
    assert as_told(state) == as_told(prefix(at))


@pytest.fixture
def seekable(taken: Journal) -> Journal:
    Recording(taken, thin=False, snapshot_steps=60).feed(steps_of(LONG), 8)
    return taken


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_seeking_a_thinned_moment_is_folding_to_it_but_for_what_is_thinned(
    thinned: tuple[Journal, Journal], data: st.DataObject
) -> None:
    many, one = thinned
    at = data.draw(moments())
    state = Past(many).state(at)
    assert as_told(state) == as_told(Past(one).state(at)), "snapshots change nothing"
    whole = prefix(at)
    kept = [kept.step for kept in one.read(until=at)]
    assert without_thinned(state) == without_thinned(without_ended(folded(kept)))
    for name, agent in whole.agents.items():
        if agent.position is not None:
            near(state.agents[name], agent)


@pytest.fixture
def thinned(opened: Opener, where: str) -> tuple[Journal, Journal]:
    """Return two journals of the same steps: with many snapshots, and with none but the first."""
    found = []
    for site, often in (("many", 40), ("one", 10**9)):
        journal = opened(where, site)
        journal.take()
        recording = Recording(journal, snapshot_steps=often)
        recording.feed(steps_of(LONG), 8)
        journal.append((), recording.writer._thinner.blocks(0, all_=True))
        found.append(journal)
    return found[0], found[1]


def test_two_starts_are_two_stories_of_one_site(opened: Opener) -> None:
    steps = steps_of("move_task")
    first = opened()
    first.take()
    old = Recording(first, thin=False)
    old.feed(steps, 10)
    old.writer.end()
    first.close()
    second = opened()
    second.take()
    seq, at = second.last()
    begins = EngineState(seq=seq, now=at + 1)
    new = Recording(second, begins, thin=False)
    new.feed([EngineStep(seq + 1, at + 5 * SECOND, Started(2), (), ())])
    past = Past(opened(read_only=True))
    assert as_told(past.state(at)) == as_told(old.state)
    assert past.state(at + 1).agents == {}
    assert (past.state().seq, past.state().now) == (seq + 1, at + 5 * SECOND)
    assert past.first() == 0


def test_a_moment_that_is_not_kept_is_told(taken: Journal, opened: Opener, wording: Wording) -> None:
    with pytest.raises(JournalError) as refused:
        Past(opened(site="empty")).state()
    wording(refused.value)
    steps = steps_of("move_task")
    state, board = EngineState(), Blackboard()
    for step in steps[:50]:
        fold(state, board, step)
    Recording(taken, state)
    with pytest.raises(JournalError) as told:
        Past(taken).state(5)
    wording(str(told.value))
