"""Judges a run of `killing` by what its agents noted of themselves, and by the journal that its engines left.

The agents' books say which goals their bodies began and how each ended. A *leg* is a goal of a machine without the number of
its attempt; it is flown twice if it is begun again after it succeeded. What a task has to fly is what the same task flies in a
rehearsal, where nobody dies.
"""

import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from statistics import median
from typing import Final

from msgspec import Struct

from agents_sim.goalbook import GoalNote, read_books
from agents_sim.ledger import judge as tell_referee
from agents_sim.referee import Referee
from formiga_bt.cli.inputs import read_task, read_world, shipped_tasks
from formiga_bt.engine.goals.gatekeeper import TTL_BEATS
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import GoalEventInput
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.past import Past
from formiga_bt.journal.store import Journal
from formiga_bt.lang.request.binding import bind_params
from formiga_bt.rehearsal.rehearsal import Rehearsal
from tests.e2e.killing import SITE, WORK, Accepted, Death, fleet

PEOPLE: Final = ("Confirm", "MiniFinder")
ENDS: Final = {"Tidy": "CANCELED"}
"""How a task has to end; others: SUCCEEDED."""


class Finding(Struct, frozen=True):
    """What came of a run."""

    accepted: int
    right: int
    begun_twice: list[str]
    """Ids of goals that a body began more than once."""
    flown_twice: list[str]
    asked_twice: list[str]
    wrong: list[str]
    """All else that is not as it should be, in sentences."""
    back_s: dict[str, list[float]]
    """Kind of death -> from each to the end of what the next engine asks."""
    expired: list[str] = []
    """Tasks with a step that failed `goal_expired`, as it should: its order had not left, and the engine was away for longer
    than an order lives."""

    @property
    def is_good(self) -> bool:
        """Return whether everything is as it should be."""
        return not (self.begun_twice or self.flown_twice or self.asked_twice or self.wrong)

    def text(self) -> str:
        """Return it for people."""
        lines = [f"{self.right} of {self.accepted} tasks ended right"]
        for name in ("begun_twice", "flown_twice", "asked_twice", "wrong"):
            lines += [f"{name.replace('_', ' ')}: {what}" for what in getattr(self, name)]
        return "\n".join(lines)


def judge(folder: Path, accepted: Mapping[str, Accepted], deaths: Sequence[Death], held: Sequence[str]) -> Finding:
    """Judge a run whose engine has ended.

    Args:
        folder: the site's.
        accepted: what the engine said yes to.
        deaths: of its engines, in order.
        held: tasks that came back HELD, which none should.
    """
    notes = list(read_books(folder / "sim"))
    wrong = [f"{task} came back HELD after a short outage" for task in held]
    with Journal(folder / f".formiga/{SITE}/journal.db", SITE, read_only=True) as journal:
        state = Past(journal).state()
        back, away_s = _back(journal, deaths)
        late = _expired(journal) if away_s > TTL_BEATS else []
    stats = subprocess.run(
        [sys.executable, "-m", "formiga_bt", "journal", "stats"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if stats.returncode:
        wrong.append(f"formiga journal stats: {stats.stdout}{stats.stderr}")
    lost = [f"{task} was accepted and is not in the journal" for task in accepted if task not in state.tasks]
    bad = {task: why for task in state.tasks if (why := _bad_end(folder, task, state, accepted, notes))}
    expired = [task for task in bad if _is_late(task, state.tasks[task].outcome.code, late)]
    bad = {task: why for task, why in bad.items() if task not in expired}
    verdict = Referee()
    crashes = verdict.verdict(tell_referee(folder / "sim", verdict)).crashes
    wrong += [*lost, *bad.values(), *(f"crash: {crash}" for crash in crashes)]
    mine = [task for task in state.tasks if not state.tasks[task].system.agent]
    begun = Counter((note.agent, note.goal) for note in notes if note.state == "begun")
    return Finding(
        accepted=len({*mine, *accepted}),
        right=len([task for task in mine if task not in bad]),
        begun_twice=[goal for (_, goal), n in begun.items() if n > 1],
        flown_twice=_flown_twice(notes),
        asked_twice=_asked_twice(notes),
        wrong=wrong,
        back_s=back,
        expired=expired,
    )


def leg_of(goal: str) -> str:
    """Return a goal's id without the numbers of attempts (`@2`) and of orders that the gate let wait (`+3`)."""
    return re.sub(r"[@+]\d+", "", goal)


def _flown_twice(notes: Sequence[GoalNote]) -> list[str]:
    done: set[tuple[str, str]] = set()
    found = []
    for note in notes:
        leg = note.agent, leg_of(note.goal)
        if note.state == "begun" and note.action not in PEOPLE and leg in done:
            found.append(note.goal)
        if note.state == "succeeded":
            done.add(leg)
    return found


def _asked_twice(notes: Sequence[GoalNote]) -> list[str]:
    """Return questions put to a person who had answered them, or still had them open.

    Asking whether a place is clear is a new question each time: an answer is good for a minute. Two at once are not.
    """
    answered: set[tuple[str, str]] = set()
    open_: dict[tuple[str, str], str] = {}
    found = []
    for note in notes:
        what = leg_of(note.goal) if not note.goal.startswith("clear/") else re.sub(r"/\d+~", "~", note.goal)
        key = note.agent, what
        if note.state == "begun" and note.action == "Confirm":
            if key in open_ or key in answered:
                found.append(note.goal)
            open_[key] = note.goal
        elif note.state != "begun":
            open_.pop(key, None)
            if note.state == "succeeded" and not note.goal.startswith("clear/"):
                answered.add(key)
    return found


def _bad_end(
    folder: Path, task_id: str, state: EngineState, accepted: Mapping[str, Accepted], notes: Sequence[GoalNote]
) -> str:
    """Return what is wrong with how a task ended; "" if nothing is."""
    task = state.tasks[task_id]
    if task.system.agent:
        return f"{task_id}: a machine had to be brought home: {task.outcome.reason}"
    ends = {ENDS.get(task.name, "SUCCEEDED")}
    asked = accepted.get(task_id)
    if task.name in ENDS and (asked is None or asked.aborted is not True):
        ends.add("SUCCEEDED")  # nobody knows whether its abort was heard
    if task.status not in ends:
        return f"{task_id} ended {task.status} {task.outcome.code}: {task.outcome.reason}"
    flown = {
        _place(leg_of(note.goal))
        for note in notes
        if note.state == "succeeded" and note.goal.startswith(f"{task_id}/") and "~" not in note.goal
    }
    if task.name in ENDS:
        begun = [leg for leg in flown if leg.startswith("on_abort/")]
        return (
            "" if begun or task.status == "SUCCEEDED" else f"{task_id} did not fly what on_abort says: {sorted(flown)}"
        )
    ought = _ought(folder, task.name)
    if flown != ought:
        return f"{task_id} flew {sorted(flown)}, and it ought to fly {sorted(ought)}"
    return ""


def _place(goal: str) -> str:
    """Return `<section>/<path>` of a goal `<task>/<run>/<section>/<path>`."""
    return goal.split("/", 2)[2]


@cache
def _ought(folder: Path, name: str) -> frozenset[str]:
    """Return the legs that a task flies when nobody dies."""
    world = read_world([folder / "actions.yaml"], folder / "site.yaml")
    assert world.site is not None
    own = {"Tidy": folder / "trees" / "tidy.yaml", "Asked": folder / "trees" / "asked.yaml"}
    task = read_task({**shipped_tasks(), **own}[name], world).task
    assert task is not None
    values, problems, _ = bind_params(task, next(params for one, params in WORK if one == name), world.site)
    assert not problems, problems
    flight = Rehearsal(world.site, world.catalogue, [task], fleet(world))
    flight.run_for(2)
    flight.submit(name, values)
    assert flight.run_until_ended(limit_s=7200.0)
    found = set()
    for step in flight.steps:
        given = step.input
        if isinstance(given, GoalEventInput) and given.event.state == "succeeded" and "~" not in given.event.goal_id:
            found.add(_place(leg_of(given.event.goal_id)))
    flight.close()
    return frozenset(found)


def _expired(journal: Journal) -> list[str]:
    """Return the goals that had not left when an engine died, and were too old for the next one."""
    return [
        change.goal.id
        for kept in journal.read()
        for change in kept.step.changes
        if isinstance(change, ch.GoalPut) and change.goal.code == "goal_expired"
    ]


def _is_late(task: str, code: str, late: Sequence[str]) -> bool:
    """Return whether a task ended as it did because of a goal that was too old."""
    mine = [goal for goal in late if goal.startswith(f"{task}/")]
    return bool(mine) and (code == "goal_expired" or any("/on_abort/" in goal for goal in mine))


def _back(journal: Journal, deaths: Sequence[Death]) -> tuple[dict[str, list[float]], float]:
    """Return how long it took from each death until the next engine had asked all, and the longest outage.

    An engine that died before it had asked all is not told of.
    """
    ends, away_s = [], 0.0
    for kept in journal.read():
        for change in kept.step.changes:
            if not isinstance(change, ch.ResumePut):
                continue
            if change.resume is None or change.resume.phase == "watching":
                ends.append(kept.wall)
            else:
                away_s = max(away_s, change.resume.outage_us / 1e6)
    found: dict[str, list[float]] = defaultdict(list)
    for i, death in enumerate(deaths):
        until = deaths[i + 1].wall_us if i + 1 < len(deaths) else 1 << 62
        first = next((end for end in ends if death.wall_us < end < until), None)
        if first is not None:
            found[death.point].append(round((first - death.wall_us) / 1e6, 2))
    return dict(found), away_s


def middle(times: Sequence[float]) -> str:
    """Return the median in words."""
    return f"{median(times):.1f} s" if times else "-"
