"""Standing rules never fire twice and forget nothing, whatever comes in what order and however often the engine is killed.

The oracle looks at the whole history at once: who was outside from when to when, by which positions, and when nobody looked.
"""

import tempfile
from functools import cache
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import (
    AgentEventInput,
    AgentSeenInput,
    AgentStatusInput,
    EngineStep,
    Input,
    LockdownOrder,
    Resumed,
    Started,
    TimerDue,
    WallDue,
)
from formiga_bt.engine.kernel.state import snapshot
from formiga_bt.engine.kernel.timers import ResumeDue
from formiga_bt.engine.rules.borders import BAND_M, OLDEST_US
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.rehearsal.testing import folded
from formiga_bt.transport.messages import AgentCard, AgentEvent, AgentStatus
from tests.reloading import reloaded
from tests.unit.engine.ruled import site_in, tasks_in

TASK = "formiga: 1\ntask: Help\nsteps: [{wait: 30 s}]\n"
FOR_S = 75
BEGIN = 1_000_000 * SECOND
RULES = (
    f"left: {{on: 'leaves(picker, regions.square)', for: {FOR_S} s, request: Help}}",
    "gone: {on: 'leaves(picker, regions.square)', request: Help, at_most: 2 running}",
    "sos: {on: picker.sos, request: Help}",
)

walks = st.tuples(st.just("at"), st.integers(-30, 160), st.floats(0.1, 90.0))
acts = st.one_of(
    walks,
    walks,
    walks,
    st.tuples(st.just("press"), st.integers(1, 6), st.floats(0.1, 5.0)),
    st.tuples(st.just("killed"), st.just(0), st.floats(0.1, 100.0)),
    st.tuples(st.just("lockdown"), st.booleans(), st.floats(0.1, 5.0)),
)


@cache
def world() -> tuple[Site, Catalogue, dict[str, Task]]:
    with tempfile.TemporaryDirectory() as name:
        found = site_in(Path(name), *RULES, tasks=(TASK,))
        assert found.site is not None, found.diagnostics
        return found.site, found.catalogue, {task.name: task for task in tasks_in(Path(name), found)}


class Killable:
    """An engine that can be killed; time passes by its deadlines."""

    def __init__(self) -> None:
        self.now, self.seq, self.epoch = BEGIN, 0, 1
        self.steps: list[EngineStep] = []
        self.engine = Engine(*world())
        self.give(Started(1))
        self.give(AgentSeenInput(AgentCard(id="picker_1", type="picker", boot_id="b", actions=(), mobility="people")))

    def give(self, one: Input) -> None:
        self.steps.append(self.engine.handle(self.now, one))
        for name in ("left", "sos"):
            assert len(self.running(name)) <= 1

    def running(self, rule: str) -> list[str]:
        state = self.engine.state
        return [t for t in self.engine.open_tasks if (c := state.tasks[t].request.cause) and c.rule == rule]

    def pass_time(self, until: int) -> None:
        while (due := self.engine.next_deadline()) is not None and due[0] < until:
            self.now = max(due[0], self.now)
            self.give(TimerDue(due[1]))
        self.now = until

    def stand_at(self, east: int) -> None:
        self.seq += 1
        at = Position(float(east), 50.0, 0.0)
        status = AgentStatus(
            id="picker_1", type="picker", boot_id="b", seq=self.seq, stamp=self.now, position=at, battery=90.0,
            landed="grounded", control="engine", status="STANDBY",
        )  # fmt: skip
        self.give(AgentStatusInput(status, self.now))

    def kill(self, down_us: int) -> None:
        """Kill it between two inputs: what was kept is all there is."""
        state = reloaded(self.engine.state)
        self.engine = Engine(*world(), state=state, resumes=True)
        at, self.epoch = self.now, self.epoch + 1
        self.now += down_us
        self.give(Resumed(epoch=self.epoch, at=at, since=at, wall=self.now))
        if ResumeDue() in self.engine.state.wall:
            self.give(WallDue(ResumeDue(), self.now))
        self.pass_time(self.now + 1)


def passages(history: list[tuple[int, int]], downs: list[tuple[int, int]], after_us: int, end: int) -> int:
    """Return how often somebody has left: of each stay outside after one inside, whether it was seen to last."""
    count, inside, run = 0, None, []
    for at, east in [*history, (end, 0)]:
        side = True if 0 <= east <= 100 else False if east < -BAND_M or east > 100 + BAND_M else None
        if (side is not None and side != inside) or (side is False and run):
            if side is True:
                count += _lasted(run, downs, after_us, at)
                run = []
            elif inside is True or run:
                run.append((at, True))
            inside = side
        elif run:
            run.append((at, False))
    return count


def _lasted(run: list[tuple[int, bool]], downs: list[tuple[int, int]], after_us: int, until: int) -> int:
    if not run:
        return 0
    due = run[0][0] + after_us
    due = next((up for down, up in downs if down <= due <= up), due)
    if due >= until:
        return 0
    seen = max(at for at, _ in run if at <= due)
    return int(due - seen <= OLDEST_US or any(beyond and at > due for at, beyond in run))


@settings(max_examples=120, deadline=None)
@given(st.lists(acts, max_size=25))
def test_each_thing_that_happens_has_one_outcome(acted: list[tuple[str, int, float]]) -> None:
    one = Killable()
    history: list[tuple[int, int]] = []
    downs: list[tuple[int, int]] = []
    pressed: set[int] = set()
    for act, value, seconds in acted:
        span = round(seconds * 1e6) | 1
        if act == "killed":
            downs.append((one.now, one.now + span))
            one.kill(span)
            continue
        one.pass_time(one.now + span)
        if act == "at":
            history.append((one.now, value))
            one.stand_at(value)
        elif act == "press":
            pressed.add(value)
            one.give(AgentEventInput(AgentEvent(agent="picker_1", event="sos", boot_id="b", n=value)))
        else:
            one.give(LockdownOrder("return" if value else "release", "ann"))
    one.pass_time(one.now + 300 * SECOND + 2)
    end = one.now + 1  # as if they came back then

    rules = one.engine.state.rules
    assert rules["sos"].fired == len(pressed)
    assert rules["gone"].fired == passages(history, [], 0, end)
    assert rules["left"].fired == passages(history, downs, FOR_S * SECOND, end)
    for name, rule in rules.items():
        started = [f.task for f in rule.last if f.outcome == "started"]
        of_rule = [t.id for t in one.engine.state.tasks.values() if t.request.cause and t.request.cause.rule == name]
        assert len(rule.last) < 20, "all of them are kept here"
        assert sorted(started) == sorted(of_rule)
    assert snapshot(folded(one.steps)) == snapshot(one.engine.state)
