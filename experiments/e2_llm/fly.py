"""Flies a checked task on a simulated site in virtual time and returns what the simulator saw."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct

from agents_sim.motion import MotionKind, Segment
from agents_sim.referee import Referee
from agents_sim.world import SimFleet
from experiments.e2_llm.flown import Asked, Done, Fix, Flown, Machine
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place
from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.engine.kernel.records import Question
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.rehearsal.rehearsal import START, Rehearsal, fleet_of, simulated
from formiga_bt.show.history.runlog import RunLog

LIMIT_S = 6 * 3600.0
NO = (
    "no", "not_yet", "negative", "deny", "denied", "reject", "rejected", "refuse", "wait", "not_ready", "not_safe", "unsafe",
    "not_loaded", "not_clear", "not_confirmed", "not_found", "abort", "cancel", "stop", "stay", "hold", "false", "No", "NO",
)  # fmt: skip
"""The words for no that options are searched for, in this order."""
REST_S = 900.0
"""So long machines may come to rest after the task is over (the engine brings stray ones home)."""


_CLEAR = {"match": "refuse", "options": ["clear"]}
"""Whether people stand clear of a machine is not what the task asks: they do, also where they deny or are silent."""


class Scene(Struct, frozen=True, kw_only=True):
    """Who answers what, and how machines stand at the start."""

    name: str = "yes"
    answers: dict[str, tuple[str, ...]] = {}
    """Person -> the answers in order, the last again and again; whoever is not named agrees."""
    silent: tuple[str, ...] = ()
    """These never answer a question of a task."""
    deny: tuple[str, ...] = ()
    """These say no, in whatever words the question offers (`NO`)."""
    walks: dict[str, tuple[str, ...]] = {}
    """Person -> the places that they walk to, one after another."""
    parked: dict[str, str] = {}
    """Machine -> the place where it stands instead of its port."""
    people: dict[str, str] = {}
    """Person -> the place where they stand."""
    battery: dict[str, float] = {}


class World(Struct, frozen=True):
    """A site and the catalogue."""

    site: Site
    catalogue: Catalogue


def world_of(name: str = "demo-site") -> World:
    """Return a site that ships, with the catalogue that ships."""
    catalogue, problems, _ = load_catalogue(sorted(files("actions")))
    site, more, _ = load_site(folder("trees") / f"{name}.yaml")
    if problems or site is None:
        raise ValueError(f"{name} cannot be read: {[*problems, *more]}")
    return World(site, catalogue)


def place_of(world: World, name: str) -> tuple[float, float]:
    """Return a place, a port or the base of a site in metres east and north."""
    if name == "base":
        return (0.0, 0.0)
    site = world.site
    where = site.places[name] if name in site.places else site.ports[name].at
    return (where.east_m, where.north_m)


class Tape(Referee):
    """A referee that keeps every motion."""

    def __init__(self) -> None:
        super().__init__()
        self.motions: dict[str, list[Segment]] = {}

    def moved(self, agent: str, segment: Segment, kind: MotionKind) -> None:
        """Keep it, and look for crashes."""
        super().moved(agent, segment, kind)
        kept = self.motions.setdefault(agent, [])
        while kept and kept[-1].t0 >= segment.t0:
            kept.pop()
        kept.append(segment)

    def way(self, agent: str, zero: int, until: int) -> tuple[Fix, ...]:
        """Return the way of an agent from `zero` on as fixes, in seconds since then."""
        found: list[Fix] = []
        kept = self.motions.get(agent, [])
        for i, one in enumerate(kept):
            cut = min(kept[i + 1].t0 if i + 1 < len(kept) else until, until)
            for at in dict.fromkeys((one.t0, min(one.t1, cut), cut)):
                if at >= zero and (not found or (at - zero) / 1e6 >= found[-1].at_s):
                    where = one.at(at)
                    fix = Fix((at - zero) / 1e6, where.east_m, where.north_m, where.up_m)
                    if not found or found[-1] != fix:
                        found.append(fix)
        if not found and kept:
            where = kept[-1].p1
            found.append(Fix(0.0, where.east_m, where.north_m, where.up_m))
        return tuple(found)


class _Questions:
    """Keeps every question that a task put to people, and what was answered."""

    def __init__(self) -> None:
        self.seen: dict[str, tuple[Question, int | None]] = {}

    def take(self, step: EngineStep) -> None:
        """Take what a step changed."""
        for change in step.changes:
            if isinstance(change, ch.QuestionPut) and change.question.kind == "ask":
                known = self.seen.get(change.question.id)
                told = known[1] if known is not None else None
                if change.question.reply is not None and told is None:
                    told = step.at
                self.seen[change.question.id] = (change.question, told)

    def rows(self, task: str, zero: int) -> tuple[Asked, ...]:
        """Return those of a task in order."""
        found = [
            Asked(
                at_s=(question.asked_at - zero) / 1e6,
                people=question.asked,
                text=question.text,
                options=question.options,
                answer=str(question.reply["answer"]) if question.reply is not None else "",
                answered_s=(told - zero) / 1e6 if told is not None else None,
            )
            for question, told in self.seen.values()
            if question.task == task
        ]
        return tuple(sorted(found, key=lambda one: one.at_s))


def checked(text: str, world: World, library: Sequence[Path] | None = None) -> tuple[Task | None, list[str]]:
    """Return the task of a text, or None, and what the checker says of errors."""
    loaded = load_task_text(text, "task.yaml", catalogue=world.catalogue, site=world.site, library=library)
    return loaded.task, [str(one) for one in loaded.diagnostics if one.severity == "error"]


def fly(
    text: str,
    values: Mapping[str, str],
    world: World,
    scene: Scene | None = None,
    library: Sequence[Path] | None = None,
) -> Flown:
    """Fly a task's text with values as on the command line.

    What cannot start (errors of the checker, of a value, of the engine) is `REFUSED`, with the reason.
    """
    task, errors = checked(text, world, library)
    if task is None:
        return Flown(status="REFUSED", code="check", reason="; ".join(errors[:5]))
    bound, problems, _ = bind_params(task, dict(values), world.site, START)
    if problems:
        return Flown(status="REFUSED", code="params", reason="; ".join(one.message for one in problems))
    return _flown(task, bound, world, scene or Scene())


def _flown(task: Task, values: Mapping[str, Any], world: World, scene: Scene) -> Flown:
    tape, questions, log = Tape(), _Questions(), RunLog()
    rehearsal = Rehearsal(simulated(world.site), world.catalogue, [task], ())
    fleet = SimFleet(rehearsal.scheduler, rehearsal.hub, recorder=tape)
    specs = specs_of(world, scene)
    try:
        for spec in specs:
            fleet.add(spec)
        rehearsal.run_for(1.0)
        zero = rehearsal.now
        try:
            task_id = rehearsal.submit(task.name, values)
        except TaskError as error:
            return Flown(status="REFUSED", code=error.code, reason=str(error))
        in_time = rehearsal.run_until_ended(task_id, limit_s=LIMIT_S)
        ended = rehearsal.now
        rehearsal.run_until(lambda: not fleet.flying(), REST_S)
        rehearsal.run_for(2.0)
        for step in rehearsal.steps:
            log.feed(step)
            questions.take(step)
        record = log.state.tasks[task_id]
        homes = {agent.id: place_of(world, agent.home) for agent in world.site.agents.values() if agent.home}
        return Flown(
            status=record.status if in_time else "UNFINISHED",
            code=record.outcome.code,
            reason=record.outcome.reason,
            end_s=(ended - zero) / 1e6,
            machines={
                one.id: Machine(id=one.id, type=one.type, home=homes[one.id], way=tape.way(one.id, zero, rehearsal.now))
                for one in specs
                if one.id in homes
            },
            people={one.id: one.type for one in specs if one.id not in homes},
            asked=questions.rows(task_id, zero),
            done=tuple(
                Done(
                    agent=row.agent,
                    action=row.action,
                    start_s=(row.start - zero) / 1e6,
                    end_s=None if row.end is None else (row.end - zero) / 1e6,
                    state=row.state,
                )
                for row in log.actions
            ),
            notices=tuple(line.text for line in log.lines),
            crashes=len(tape.verdict(rehearsal.now).crashes),
            places={name: (at.east_m, at.north_m) for name, at in world.site.places.items()},
        )
    finally:
        fleet.close()
        rehearsal.close()


def specs_of(world: World, scene: Scene) -> list[Any]:
    """Return the agents of a scene."""
    import msgspec

    scripts: dict[str, list[dict[str, Any]]] = {
        who: [_CLEAR, {"match": "*", "options": list(said)}] for who, said in scene.answers.items()
    }
    for who in scene.deny:
        scripts[who] = [_CLEAR, *({"match": "*", "options": [word]} for word in NO)]
    for who in scene.silent:
        scripts[who] = [_CLEAR, {"match": "*", "never": True}]
    specs = []
    for spec in fleet_of(world.site, world.catalogue, scripts=scripts):
        moved = scene.parked.get(spec.id) or scene.people.get(spec.id)
        if moved is not None:
            spec = msgspec.structs.replace(spec, at=Place(*place_of(world, moved)))
        if spec.id in scene.walks:
            way = [Place(*place_of(world, name)) for name in scene.walks[spec.id]]
            spec = msgspec.structs.replace(spec, walk=way)
        if spec.id in scene.battery:
            spec = msgspec.structs.replace(spec, battery=scene.battery[spec.id])
        specs.append(spec)
    return specs
