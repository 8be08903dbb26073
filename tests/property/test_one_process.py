"""Whether one or two processes speak for a machine is judged by what the wire brings: statuses lost, late, twice, unordered.

One process gives no alarm, whatever the wire does and though its idea of engine time was wrong; two that count at once are
found, whatever their numbers.
"""

from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.engine.kernel.inputs import AgentStatusInput, Alarm
from formiga_bt.rehearsal.testing import effects
from formiga_bt.transport.messages import AgentStatus
from tests.unit.engine.yard import CART, Yard

LATE_US = 3 * SECOND
"""What a wire delays at most, wall time; after that a link is broken."""
Sent = tuple[Micros, AgentStatus]
"""When it left, wall time, and what."""


@st.composite
def one_process(draw: st.DrawFn, like: AgentStatus, start: Micros, first: int, statuses: int = 25) -> list[Sent]:
    """Return what a process says. Its clock was ahead, and stands still or steps back as `AgentSide` does."""
    ahead = draw(st.sampled_from([0, 0, 4 * SECOND, 9 * SECOND, 15 * SECOND, 60 * SECOND, 590 * SECOND]))
    hears_at = start + draw(st.integers(0, 12 * SECOND))
    at, newest, sent = start, 0, []
    for n in range(statuses):
        says = at + (ahead if at < hears_at else 0)
        newest = says if newest - says > 10 * SECOND else max(newest, says)
        sent.append((at, replace(like, seq=first + n, stamp=newest)))
        at += draw(st.integers(SECOND // 5, SECOND))
    return sent


@st.composite
def wire(draw: st.DrawFn, sent: list[Sent]) -> list[Sent]:
    """Return when what was sent comes in: lost, late, twice, in any order."""
    came = []
    for at, status in sent:
        for _ in range(draw(st.sampled_from([0, 1, 1, 1, 1, 2]))):
            came.append((at + draw(st.sampled_from([0, 0, 0, LATE_US // 10, LATE_US])), status))
    return sorted(came, key=lambda one: one[0])


def bring(yard: Yard, came: list[Sent]) -> None:
    """Let the engine hear it; of what comes within a driver's turn only the newest (the inbox is latest-wins)."""
    for n, (at, status) in enumerate(came):
        if n + 1 < len(came) and came[n + 1][0] - at < SECOND // 50:
            continue
        yard.run_for(max(0.0, (at - yard.now) / SECOND))
        yard.driver.feed(AgentStatusInput(status, yard.now, yard.now))


def alone() -> tuple[Yard, AgentStatus]:
    yard = Yard(CART + "steps: [{wait: 10 min}]")
    yard.run_for(2)
    yard.cart.silent = True
    return yard, yard.cart.side.status


def alarms(yard: Yard) -> list[str]:
    return [alarm.code for alarm in effects(yard, Alarm) if alarm.code in ("double", "bad_status")]


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_one_process_is_never_taken_for_two(data: st.DataObject) -> None:
    yard, like = alone()
    sent = data.draw(one_process(like, yard.now, yard.record("c1").seq + 1))
    bring(yard, data.draw(wire(sent)))

    assert alarms(yard) == []
    assert yard.record("c1").quarantine in ("", "lost", "asked")
    yard.close()


@settings(max_examples=30, deadline=None)
@given(st.data(), st.sampled_from([0, 1, 3, 1000, 2**40]), st.integers(SECOND // 4, SECOND * 3 // 4))
def test_two_processes_that_count_at_once_are_found_within_seconds(
    data: st.DataObject, apart: int, after: Micros
) -> None:
    yard, like = alone()
    first = yard.record("c1").seq + 1
    mine = [(yard.now + n * SECOND, first + n) for n in range(4)]
    other = [(yard.now + after + n * SECOND, first + apart + n) for n in range(4)]
    sent = [(at, replace(like, seq=seq, stamp=at)) for at, seq in sorted(mine + other)]
    late = st.sampled_from([0, SECOND // 10])
    bring(yard, sorted(((at + data.draw(late), status) for at, status in sent), key=lambda one: one[0]))

    assert alarms(yard) == ["double"]
    assert yard.record("c1").quarantine == "double"
    yard.close()
