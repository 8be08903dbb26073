"""Telemetry on its way in: a status that changed nothing but where a machine is becomes a way point, or nothing at all.

So does the news of a goal that it still runs.

What a tree, the allocator or the gate saw is kept whole: if a status moved anything else (a condition turned, a machine landed,
a request was looked at), its step is kept. So the fold of what is kept equals the engine's state at each kept step, but for

| what | comes from the newest way point |
|---|---|
| an agent's position, `stood_at`, battery, wind | to 0.1 m, 1 %, 0.1 m/s |
| its `seq`, `stamp`, `heard_at`, `heard_wall` | of that way point; one comes at least each 30 s |
| how long the look whether it is still heard of waits | of the last one that is kept |
| the count of a goal's news, its progress to a tenth | of the last news that is kept |
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Any, Final

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Position
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import AgentStatusInput, EngineStep, GoalEventInput, WallDue
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import LiveDue, WallTimer

THINNED: Final = ("position", "stood_at", "battery", "wind", "seq", "stamp", "heard_at", "heard_wall")
"""Fields of an agent that a status may change without its step being kept."""
THINNED_OF_GOAL: Final = ("n", "progress")
"""Fields of a goal that its news may change without its step being kept."""
PROGRESS: Final = 0.1
"""News of so much progress is kept."""
HEARD_EVERY_US: Final[Micros] = 30 * SECOND
BLOCK_US: Final[Micros] = 10 * SECOND
"""Way points of an agent are written together, after so long."""
BLOCK_POINTS: Final = 256
LOOK_US: Final[Micros] = SECOND // 2
"""Not more often is looked which blocks are ready."""
GRAIN: Final = 10
"""Steps of a metre, and of a metre a second."""


class TrackPoint(Struct, frozen=True, array_like=True):
    """Where an agent was, and how; `seq` is that of the step of its status."""

    seq: int
    at: Micros
    east: int | None
    north: int | None
    up: int | None
    battery: int | None
    wind_east: int | None
    wind_north: int | None
    n: int
    stamp: Micros
    wall: Micros

    @property
    def position(self) -> Position | None:
        """Return where it was."""
        if self.east is None or self.north is None or self.up is None:
            return None
        return Position(self.east / GRAIN, self.north / GRAIN, self.up / GRAIN)

    @property
    def seen(self) -> tuple[int | None, ...]:
        """Return what of it people see."""
        return (self.east, self.north, self.up, self.battery, self.wind_east, self.wind_north)

    def on(self, agent: AgentRecord) -> AgentRecord:
        """Return the record of the agent with this as its newest status."""
        position = self.position
        wind = None
        if self.wind_east is not None and self.wind_north is not None:
            wind = (self.wind_east / GRAIN, self.wind_north / GRAIN)
        stands = agent.landed == "grounded" and position is not None
        return replace(
            agent, position=position, stood_at=position.ground if stands and position is not None else agent.stood_at,
            battery=None if self.battery is None else float(self.battery), wind=wind,
            seq=self.n, stamp=self.stamp, heard_at=self.at, heard_wall=self.wall,
        )  # fmt: skip


def point_of(seq: int, agent: AgentRecord) -> TrackPoint:
    """Return the way point of an agent's record as a status left it."""
    at, wind = agent.position, agent.wind
    return TrackPoint(
        seq, agent.heard_at,
        None if at is None else round(at.east_m * GRAIN),
        None if at is None else round(at.north_m * GRAIN),
        None if at is None else round(at.up_m * GRAIN),
        None if agent.battery is None else round(agent.battery),
        None if wind is None else round(wind[0] * GRAIN),
        None if wind is None else round(wind[1] * GRAIN),
        agent.seq, agent.stamp, agent.heard_wall,
    )  # fmt: skip


class Block(Struct, frozen=True):
    """Way points of one agent, oldest first."""

    agent: str
    points: tuple[TrackPoint, ...]


class Thinner:
    """Says of each step whether it is kept, and gathers way points.

    Args:
        state: of the engine before the first step.
        thin: False: every step is kept.
    """

    def __init__(self, state: EngineState, *, thin: bool = True) -> None:
        self._thin = thin
        self._live: dict[str, AgentRecord] = dict(state.agents)
        self._kept: dict[str, AgentRecord] = dict(state.agents)
        """As the fold of what is kept has them."""
        self._wall: dict[WallTimer, Micros] = dict(state.wall)
        self._goals: dict[str, GoalRecord] = dict(state.goals)
        self.on_point: Callable[[str, TrackPoint], None] | None = None
        """Told of each way point."""
        self._points: dict[str, list[TrackPoint]] = {}
        self._last: dict[str, TrackPoint] = {}
        self._noted: dict[str, AgentRecord] = {}
        """Records that were compared with their way points."""
        self._look_at: Micros = 0
        self.seq, self.at = state.seq, state.now
        """Of the last step that is kept."""
        self.dropped = 0

    def keeps(self, step: EngineStep) -> bool:
        """Take a step; return whether it is kept."""
        if self._thin and self._is_telemetry(step):
            self.dropped += 1
            return False
        for change in step.changes:
            if type(change) is ch.AgentPut:
                self._live[change.agent.id] = self._kept[change.agent.id] = change.agent
                self._last.pop(change.agent.id, None)
            elif type(change) is ch.GoalPut:
                self._goals[change.goal.id] = change.goal
            elif type(change) is ch.GoalDrop:
                self._goals.pop(change.goal, None)
            elif type(change) is ch.WallTimerSet:
                if change.after_us is None:
                    self._wall.pop(change.timer, None)
                else:
                    self._wall[change.timer] = change.after_us
        self.seq, self.at = step.seq, step.at
        return True

    def _is_telemetry(self, step: EngineStep) -> bool:
        if step.effects or step.reply:
            return False
        given: Any = step.input
        kind = type(given)
        if kind is not AgentStatusInput:
            if kind is WallDue:
                return self._is_look(given.timer, step.changes)
            return kind is GoalEventInput and given.event.status is None and self._still_runs(step.changes)
        agent: str = given.status.id
        new = self._live.get(agent)
        for change in step.changes:
            if type(change) is not ch.AgentPut or change.agent.id != agent or new is None:
                return False
            old, new = new, change.agent
            if (new.position is None) != (old.position is None) or _REST(old) != _REST(new):
                return False
        if new is not None and step.changes:
            self._live[new.id] = new
            self._note(step.seq, new)
        return True

    def _still_runs(self, changes: Sequence[ch.Change]) -> bool:
        """Return whether nothing is new of a goal but that there was news."""
        for change in changes:
            old = self._goals.get(change.goal.id) if isinstance(change, ch.GoalPut) else None
            if old is None or not isinstance(change, ch.GoalPut):
                return False
            new = change.goal
            if abs((new.progress or 0.0) - (old.progress or 0.0)) >= PROGRESS:
                return False
            if replace(new, **{name: getattr(old, name) for name in THINNED_OF_GOAL}) != old:
                return False
        return True

    @staticmethod
    def _is_look(timer: WallTimer, changes: Sequence[ch.Change]) -> bool:
        """Return whether somebody was looked at, was heard of lately, and will be looked at again."""
        if not isinstance(timer, LiveDue) or len(changes) != 2:
            return False
        first, then = changes
        return (
            type(first) is ch.WallTimerSet and type(then) is ch.WallTimerSet
            and first.timer == then.timer == timer and first.after_us is None and then.after_us is not None
        )  # fmt: skip

    def _note(self, seq: int, agent: AgentRecord) -> None:
        last = self._last.get(agent.id)
        was = self._noted.get(agent.id)
        if (
            was is not None
            and last is not None
            and agent.heard_at - last.at < HEARD_EVERY_US
            and _SEEN(was) == _SEEN(agent)
        ):
            return
        self._noted[agent.id] = agent
        last = last or point_of(0, self._kept[agent.id])
        point = point_of(seq, agent)
        if point.seen != last.seen or point.at - last.at >= HEARD_EVERY_US:
            self._last[agent.id] = point
            self._kept[agent.id] = point.on(self._kept[agent.id])
            self._points.setdefault(agent.id, []).append(point)
            if self.on_point is not None:
                self.on_point(agent.id, point)

    # -- what is to be written -------------------------------------------------------------------------------------
    def blocks(self, now: Micros, *, all_: bool = False) -> list[Block]:
        """Return the way points that have waited long enough (or all), which are then taken for written."""
        if not all_ and now < self._look_at:
            return []
        self._look_at = now + LOOK_US
        ready = [
            agent
            for agent, points in self._points.items()
            if all_ or len(points) >= BLOCK_POINTS or now - points[0].at >= BLOCK_US
        ]
        return [Block(agent, tuple(self._points.pop(agent))) for agent in ready]

    def view(self, state: EngineState) -> EngineState:
        """Return the engine's present state as the fold of what is kept has it, all way points included."""
        agents = {name: self._kept[name] for name in state.agents}
        goals = {name: self._goals[name] for name in state.goals}
        return replace(state, seq=self.seq, now=self.at, agents=agents, goals=goals, wall=dict(self._wall))


_SEEN: Final = attrgetter("position", "battery", "wind")
_REST: Final = attrgetter(*(name for name in AgentRecord.__struct_fields__ if name not in THINNED))
"""What of two records is the same if only what is thinned differs."""


# -- way points as bytes -----------------------------------------------------------------------------------------------
def pack(points: Sequence[TrackPoint]) -> bytes:
    """Return way points as columns; times and numbers as differences, which are small."""
    columns = [list(column) for column in zip(*(msgspec.structs.astuple(point) for point in points), strict=True)]
    columns[9] = [stamp - at for stamp, at in zip(columns[9], columns[1], strict=True)]
    columns[10] = [wall - at for wall, at in zip(columns[10], columns[1], strict=True)]
    return msgspec.msgpack.encode([_squeezed(column) for column in columns])


def unpack(data: bytes) -> tuple[TrackPoint, ...]:
    """Return the way points that `pack` wrote."""
    columns = [_spread(column) for column in msgspec.msgpack.decode(data)]
    columns[9] = [stamp + at for stamp, at in zip(columns[9], columns[1], strict=True)]
    columns[10] = [wall + at for wall, at in zip(columns[10], columns[1], strict=True)]
    return tuple(TrackPoint(*row) for row in zip(*columns, strict=True))


def _squeezed(column: list[Any]) -> list[Any]:
    """Return a column behind a word how: n > 0: n times the same, 0: the first, then differences, -1: as it is."""
    if all(one == column[0] for one in column):
        return [len(column), column[0]]
    if None in column:
        return [-1, *column]
    return [0, column[0], *(after - before for before, after in pairwise(column))]


def _spread(column: list[Any]) -> list[Any]:
    how: int = column[0]
    rest = column[1:]
    if how > 0:
        return rest * how
    if how < 0:
        return rest
    found: list[Any] = [rest[0]]
    for more in rest[1:]:
        found.append(found[-1] + more)
    return found


def lay_over(state: EngineState, points: Mapping[str, TrackPoint], put: Mapping[str, int]) -> None:
    """Bring agents of a folded state to their newest way points.

    Args:
        state: is changed.
        points: the newest of each agent.
        put: agent -> `seq` of the last kept step that has its record, if one was folded.
    """
    for name, point in points.items():
        agent = state.agents.get(name)
        if agent is not None and point.seq > put.get(name, -1):
            state.agents[name] = point.on(agent)
