"""Flies a checked task on the site's simulated fleet in virtual time, and tells what happened: who, where, how it ended."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.diagnostics import Diagnostic, UnknownName
from formiga_bt.base.errors import FormigaError
from formiga_bt.lang.model import Site, Task
from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.world import RequestWorld
from formiga_bt.show.facts import Chart, Point, Track

if TYPE_CHECKING:
    from formiga_bt.engine.kernel.records import TaskRecord
    from formiga_bt.rehearsal.rehearsal import Rehearsal
    from formiga_bt.show.history.rows import ActionRow
    from formiga_bt.show.history.runlog import RunLog

LIMIT_S: Final = 6 * 3600.0
OVER_M: Final = 8.0
"""So near to a place, seen from above, a machine is over it."""
AT_M: Final = 4.0
"""So near to a place a machine stands at it."""
MOVED_M: Final = 2.0
_AT: Final = re.compile(r"at (-?\d+) E (-?\d+) N")
_WRITTEN: Final = re.compile(r"[A-Za-z_]+\[\d+\](?:\.[A-Za-z_]+\[\d+\])*")
"""A path of steps down to the first call."""
FULL_PCT: Final = 99.5
"""A machine with so much charge is full."""
MOST_STEPS: Final = 200_000
"""Of the engine; a task that takes more is given up."""


def fly(
    task: Task,
    world: RequestWorld,
    *,
    params: Mapping[str, str] | None = None,
    others: Sequence[Task] = (),
    limit_s: float = LIMIT_S,
    says: str = "",
) -> RehearsedFlight:
    """Run a task and return what happened. People answer the first option of every question that agrees.

    Args:
        task: it has passed the checker.
        world: the site and its fleet.
        params: values as on the command line; the others have their defaults.
        others: tasks that it requests.
        limit_s: of virtual time; who is not done then is UNFINISHED.
        says: what people answer instead, where it is an option.
    """
    from formiga_bt.lang.request.binding import bind_params
    from formiga_bt.lang.scenario.entries import START
    from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of, patience, simulated

    values, problems, _ = bind_params(task, dict(params or {}), world.site, START)
    if problems:
        return RehearsedFlight(task=task.name, status="REFUSED", code=problems[0].code, reason=problems[0].message)
    scripts = {one: [{"match": "*", "options": [says]}] for one in world.site.agents} if says else None
    fleet = fleet_of(world.site, world.catalogue, scripts=scripts)
    rehearsal = Rehearsal(simulated(world.site), world.catalogue, [task, *others], fleet)
    try:
        rehearsal.run_for(1.0)
        try:
            task_id = rehearsal.submit(task.name, values, wait=patience(task))
        except FormigaError as error:
            return RehearsedFlight(task=task.name, status="REFUSED", code=getattr(error, "code", ""), reason=str(error))
        end = rehearsal.now + round(limit_s * 1e6)
        in_time = rehearsal.driver.run_until(
            lambda: rehearsal.ended(task_id) or len(rehearsal.steps) > MOST_STEPS, end
        ) and rehearsal.ended(task_id)
        return _flight(rehearsal, task_id, [task, *others], world, in_time=in_time)
    finally:
        rehearsal.close()


def _flight(
    rehearsal: "Rehearsal", task_id: str, tasks: list[Task], world: RequestWorld, *, in_time: bool
) -> RehearsedFlight:
    from formiga_bt.show.history.folded import FoldedSource
    from formiga_bt.show.history.runlog import RunLog

    log = RunLog()
    for step in rehearsal.steps:
        log.feed(step)
    site = world.site
    lands = {one.name for one in world.catalogue.actions.values() if one.lands}
    landings = [row for row in log.rows_of([task_id]) if row.action in lands]
    source = FoldedSource(log.ledger, site, {one.name: one for one in tasks}, world.catalogue)
    record = log.state.tasks[task_id]
    picture, everywhere = source.task(task_id), source.chart()
    machines = [one for one in record.agents.granted if not log.state.agents[one].human]
    ways = {one: [t for t in everywhere.tracks if t.agent == one] for one in machines}
    spots = _spots(everywhere)
    moved = {t.agent for t in everywhere.tracks if not t.human and _span(t.points) > MOVED_M}
    status = record.status if in_time else "UNFINISHED"
    agents: dict[str, tuple[str, ...]] = {}
    for verdict in log.state.explanations.get(task_id, ()):
        if verdict.code == "chosen":
            agents[verdict.role] = (*agents.get(verdict.role, ()), verdict.agent)
    end = record.times.ended_at if record.times.ended_at is not None else rehearsal.now
    return RehearsedFlight(
        task=tasks[0].name,
        status=status,
        code=record.outcome.code,
        reason=_reason(record, log, ways, everywhere, site) if in_time else "it is not over after a long time",
        breach=_breach(rehearsal, task_id),
        short={
            one.agent: one.detail
            for one in log.state.explanations.get(task_id, ())
            if one.code == "energy" and (log.state.agents[one.agent].battery or 0.0) >= FULL_PCT
        },
        duration_s=round((end - record.times.submitted_at) / 1e6, 1),
        agents=agents,
        visited={one: _visited(way, _without_home(spots, one, site)) for one, way in ways.items()},
        landed={one: _landings(one, way, landings, spots, site) for one, way in ways.items()},
        stands={one: _stand(one, way, log, spots, site) for one, way in ways.items()},
        moved_unasked=tuple(sorted(moved - set(record.agents.granted))),
        asked=tuple(dict.fromkeys(row.agent for row in log.rows_of([task_id]) if row.action == CONFIRM and row.path)),
        crashes=len(rehearsal.referee.verdict(rehearsal.now).crashes),
        least_battery={one: round(log.least_battery[one], 1) for one in machines if one in log.least_battery},
        drawing=picture.drawing,
        steps=picture.steps,
        timeline=source.timeline([task_id]),
        chart=source.chart([task_id]),
        lines=picture.lines,
    )


def _breach(rehearsal: "Rehearsal", task_id: str) -> float | None:
    """Return how far the goal of a task that the gate refused last would have gone over a limit."""
    from formiga_bt.engine.kernel.changes import GoalPut

    changes = (change for step in reversed(rehearsal.steps) for change in reversed(step.changes))
    goals = (one.goal for one in changes if isinstance(one, GoalPut) and one.goal.task == task_id)
    return next((goal.breach for goal in goals if goal.state == "gate_refused"), None)


def _reason(record: "TaskRecord", log: "RunLog", ways: Mapping[str, Sequence[Track]], chart: Chart, site: Site) -> str:
    """Return why a task ended as it did: who was refused, or which action failed and where the machine was then."""
    if record.outcome.code == "no_agent":
        verdicts = log.state.explanations.get(record.id, ())
        served = {v.role for v in verdicts if v.code in ("chosen", "fits")}
        telling = [v for v in verdicts if v.role not in served and v.code != "wrong_type"]
        said = [f"{v.role}: {v.agent} {v.code} {v.detail}".strip() for v in telling]
        return "; ".join([record.outcome.reason, *said[:4]]).strip("; ")
    failed = [row for row in log.rows_of([record.id]) if row.path and row.end is not None and row.state != "succeeded"]
    if record.status == "FAILED" and failed and failed[-1].end is not None and failed[-1].agent in ways:
        row = failed[-1]
        at = _at(ways[row.agent], row.end or 0)
        over = f" while it was over {_named(row.agent, at, _spots(chart), site)}" if at is not None else ""
        return f"{record.outcome.reason}: {row.agent} was to {row.action} {_goal(row, chart, site)}".rstrip() + over
    return record.outcome.reason


def _goal(row: "ActionRow", chart: Chart, site: Site) -> str:
    """Return where an action was to go, by the name of the place if it has one."""
    match = _AT.fullmatch(row.detail)
    if match is None:
        return row.detail
    return _named(row.agent, Point(float(match[1]), float(match[2])), _spots(chart), site)


def _spots(chart: Chart) -> dict[str, Point]:
    return {mark.name: mark.at for mark in chart.marks if mark.kind in ("base", "port", "place")}


def _without_home(spots: Mapping[str, Point], agent: str, site: Site) -> dict[str, Point]:
    home = site.agents[agent].home if agent in site.agents else ""
    return {name: at for name, at in spots.items() if name != home}


def _span(points: Sequence[Point]) -> float:
    if not points:
        return 0.0
    first = points[0]
    return max(math.dist(_xyz(first), _xyz(point)) for point in points)


def _xyz(point: Point) -> tuple[float, float, float]:
    return point.east_m, point.north_m, point.up_m


def _visited(way: Iterable[Track], spots: Mapping[str, Point]) -> tuple[str, ...]:
    """Return the named places that a machine passed over, in order of the first time; its start is none."""
    first: dict[str, float] = {}
    offset = 0.0
    for track in way:
        for index in range(1, len(track.points)):
            a, b = track.points[index - 1], track.points[index]
            for name, spot in spots.items():
                if name not in first and _near(a, b, spot) <= OVER_M:
                    first[name] = offset + index + _share(a, b, spot)
        offset += len(track.points)
    return tuple(sorted(first, key=lambda name: first[name]))


def _share(a: Point, b: Point, spot: Point) -> float:
    dx, dy = b.east_m - a.east_m, b.north_m - a.north_m
    length = dx * dx + dy * dy
    if length == 0.0:
        return 0.0
    return min(1.0, max(0.0, ((spot.east_m - a.east_m) * dx + (spot.north_m - a.north_m) * dy) / length))


def _near(a: Point, b: Point, spot: Point) -> float:
    """Return the least distance from the line between two points to a spot, seen from above."""
    t = _share(a, b, spot)
    east, north = a.east_m + t * (b.east_m - a.east_m), a.north_m + t * (b.north_m - a.north_m)
    return math.hypot(spot.east_m - east, spot.north_m - north)


def over_first(flight: RehearsedFlight, agent: str, place: str) -> int | None:
    """Return when a machine was over a named place for the first time (microseconds), None = never."""
    spot = _spots(flight.chart).get(place) if flight.chart is not None else None
    if spot is None or flight.chart is None:
        return None
    for track in flight.chart.tracks:
        if track.agent != agent:
            continue
        for index in range(1, len(track.points)):
            a, b = track.points[index - 1], track.points[index]
            if _near(a, b, spot) <= OVER_M:
                start, end = track.times[index - 1], track.times[index]
                return round(start + _share(a, b, spot) * (end - start))
    return None


def _landings(
    agent: str, way: Sequence[Track], landings: Iterable["ActionRow"], spots: Mapping[str, Point], site: Site
) -> tuple[str, ...]:
    found = []
    for row in landings:
        if row.agent == agent and row.outcome == "succeeded" and row.end is not None:
            at = _at(way, row.end)
            if at is not None:
                found.append(_named(agent, at, spots, site))
    return tuple(found)


def _at(way: Sequence[Track], time: int) -> Point | None:
    """Return where an agent was at an instant: between the two points around it."""
    times = [(t, p) for track in way for t, p in zip(track.times, track.points, strict=True)]
    before = [one for one in times if one[0] <= time]
    after = [one for one in times if one[0] > time]
    if not before or not after:
        return before[-1][1] if before else after[0][1] if after else None
    (t0, a), (t1, b) = before[-1], after[0]
    part = (time - t0) / (t1 - t0)
    return Point(a.east_m + part * (b.east_m - a.east_m), a.north_m + part * (b.north_m - a.north_m))


def _named(agent: str, at: Point, spots: Mapping[str, Point], site: Site) -> str:
    """Return a point on the ground in words."""
    home = site.agents[agent].home if agent in site.agents else ""
    ranked = sorted((math.hypot(at.east_m - p.east_m, at.north_m - p.north_m), name) for name, p in spots.items())
    if ranked and ranked[0][0] <= AT_M:
        return "home" if ranked[0][1] == home else ranked[0][1]
    return f"{at.east_m:.0f} E {at.north_m:.0f} N"


def _stand(agent: str, way: Sequence[Track], log: "RunLog", spots: Mapping[str, Point], site: Site) -> str:
    record = log.state.agents[agent]
    if record.landed == "airborne":
        return "in the air"
    points = [point for track in way for point in track.points]
    if not points:
        return "home"
    return _named(agent, points[-1], spots, site)


def of_flight(flight: RehearsedFlight) -> list[Shortfall]:
    """Return what was wrong in a flight, whatever had been asked for."""
    found = []
    if flight.status != "SUCCEEDED":
        why = f": {flight.code} {flight.reason}".rstrip(": ")
        what = "could not be started" if flight.status == "REFUSED" else f"ended {flight.status}"
        found.append(Shortfall("not_succeeded", f"in the dry run the task {what}{why}", _where_failed(flight)))
    if flight.crashes:
        found.append(Shortfall("crash", f"in the dry run machines collided ({flight.crashes} times)"))
    for agent, where in flight.stands.items():
        if where == "in the air":
            found.append(
                Shortfall("not_landed", f"{agent} is still in the air at the end", help="land it or ReturnHome")
            )
    found += [
        Shortfall("moved_unasked", f"{agent} moved, and is in no role of the task") for agent in flight.moved_unasked
    ]
    return found


def _where_failed(flight: RehearsedFlight) -> str:
    """Return the JSON path of the innermost step of the task that failed; those inside a called subtree are its call."""
    failed = [step.path for step in flight.steps if step.status == "failure" and step.path.startswith("steps/steps[")]
    found = max((_WRITTEN.match(path.removeprefix("steps/")) for path in failed), key=_length, default=None)
    return f"$.{found[0]}" if found is not None else ""


def _length(match: "re.Match[str] | None") -> int:
    return len(match[0]) if match is not None else 0


def from_diagnostic(path: str, found: Diagnostic) -> Shortfall:
    """Return a problem of the checker as a shortfall."""
    unknown = found.about.name if isinstance(found.about, UnknownName) else ""
    return Shortfall(found.code, found.message, path, found.help, found.severity, unknown=unknown)


def facts(flight: RehearsedFlight) -> dict[str, Any]:
    """Return the plain facts of a flight, for JSON."""
    import msgspec

    hidden = ("breach", "short", "drawing", "steps", "timeline", "chart", "lines")
    return {k: v for k, v in msgspec.to_builtins(flight).items() if k not in hidden}
