"""How often does the checker refuse a task that is good? Draws tasks, runs them without the checker's word, then asks it.

python benchmarks/false_alarms.py [--tasks N] [--seed S] [--change] [--rich] [--keep FOLDER]
python benchmarks/false_alarms.py --checked [--tasks N] [--seed S] [--dry]

The tasks are those of tests/property/sound.py: well-typed, of every kind of step. Each is read without the checks of the whole
task and run in each of `SCENARIOS`. It is good if it succeeds on every calm day and leaves no machine in the air, and if it
ends, when something goes wrong, SUCCEEDED or with a code that this leads to (`MAY_END`). Of the good ones it counts those with
an error (refused) and those with a warning, by code; their files are kept. With `--change` each has one fault of
tests/mutation/operators.py: what the checker refuses of those that are good all the same is to be looked at. With `--rich` the
tasks are those of tests/property/sound_rich.py, of more of the language. With `--checked` these are only checked, and what is
said of them is counted and written to docs/mutation.md.
"""

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import Any, Final

import yaml

from benchmarks.mistakes import GOOD_MARK
from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import SendGoal
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.tasks.requests import WAIT_US
from formiga_bt.lang import loader
from formiga_bt.lang.files import Shelf, read_file
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.scenario import Scenario, ScenarioTask
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.world import World
from formiga_bt.rehearsal.cases.cases import CaseFile
from formiga_bt.rehearsal.cases.mocks import Mocks
from formiga_bt.rehearsal.cases.reading import load_cases_text
from formiga_bt.rehearsal.rehearsal import patience
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.show.why.front import explain
from tests.mutation.operators import OPERATORS, other_count
from tests.property.sound import CHILD, good_task
from tests.property.sound_rich import rich_task

PAGE: Final = Path(__file__).parents[1] / "docs" / "mutation.md"
PART: Final = """\
{mark}
## Good tasks that the checker blames

Of {number} good tasks, drawn from seed {seed} on, {said}.
`python benchmarks/false_alarms.py --checked --tasks 2000` writes this part. The tasks (`tests/property/sound_rich.py`) have
races, forms, retries of some failures, loops over lists that grow, records, failures that carry values, resources, rates,
windows of the day, targets that move, and each older kind of step.
That they are good is seen when some of them are run (`--rich` without `--checked`).
"""
LIMIT_S: Final = 8 * 3600.0
DRONES: Final = ("lwd_1", "lwd_2", "lwd_3", "hwd_1", "hwd_2")
TARGET: Final = {"east": "120 m", "north": "-60 m"}

OTHER: Final = """\
formiga: 1
task: Other
imports: [lib/flying.yaml]
params: {target: place}
agents: {drone: {type: lwd}}
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: 100 m}
  - wait: 2 min
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
"""What else flies in the scenario `traffic`."""


def _all(kind: str, at: str, **more: Any) -> list[dict[str, Any]]:
    return [{"at": at, "agent": drone, "kind": kind, **more} for drone in DRONES]


def _goals(action: str, nth: int, **what: Any) -> list[dict[str, Any]]:
    return [{"do": f"{drone}.{action}", "nth": nth, **what} for drone in DRONES]


NO: Final = [{"ask": text, "answer": "no"} for text in ("begin", "Seen", "Enough")] + [
    {"ask": "Loaded", "answer": "later"}
]
SCENARIOS: Final[Mapping[str, Mapping[str, Any]]] = {
    "ok": {},
    "elsewhere": {"params": {"target": "south_field"}},
    "at home": {"params": {"target": {"east": "0 m", "north": "20 m"}}},
    "traffic": {},
    "slow": {"faults": _all("slow", "0 s", delay="1.5 s")},
    "wind": {"faults": [{"at": "20 s", "kind": "wind", "east": "3 m/s", "north": "-2 m/s"}]},
    "weak": {"agents": {drone: {"battery": "48 %"} for drone in DRONES}},
    "no": {"answers": [*NO, {"ask": "about to land", "answer": "clear", "after": "20 s"}]},
    "silence": {"answers": [{"ask": text, "never": True} for text in ("begin", "Seen", "Enough", "Loaded")]},
    "later no": {"answers": [{"ask": 2, "answer": "no"}, {"ask": 3, "never": True}]},
    "blocked": {"answers": _goals("GoTo", 2, fail="blocked", after="5 s")},
    "refused": {"answers": _goals("TakeOff", 1, reject="not_now")},
    "lost": {"faults": [{"at": "1 min", "agent": drone, "kind": "kill"} for drone in ("lwd_1", "hwd_1")]},
}
CALM: Final = ("ok", "elsewhere", "at home", "slow", "wind")
"""Scenarios in which a good task succeeds, whatever it is."""
MAY_END: Final[Mapping[str, tuple[str, ...]]] = {
    "traffic": ("no_agent", "leg_busy", "timeout", "envelope.reserve"),
    "weak": ("no_agent", "envelope.reserve", "failed", "no_clearance"),
    "no": ("expect",),
    "silence": ("timeout", "expect"),
    "later no": ("timeout", "expect", "failed", "no_clearance"),
    "blocked": ("failed:blocked", "failed", "requires", "request:failed"),
    "refused": ("rejected", "failed", "request:rejected"),
    "lost": ("agent_lost", "failed", "no_agent", "request:agent_lost", "requires"),
}
"""How a good task may end in the others besides SUCCEEDED. `requires`: a `finally` could not bring the machine home.
`no_clearance` of a weak one: its charge leaves no time for people's answer. `envelope.reserve` in traffic: it waited too long.
"""
BLOCKED: Final = ("leg_busy", "spot_busy", "request:leg_busy", "request:spot_busy")
"""How a task may end that came where a quarantined machine may be, or where one stands that was left there."""
NOBODYS: Final = "in the air, and nobody answers for it"


@dataclass(frozen=True, slots=True)
class Ended:
    """How a run ended."""

    status: str
    code: str
    reason: str
    aloft: bool = False
    """The engine had to bring a machine home: at the end, as the task did not, or after it failed."""
    blocked: bool = False
    """What it ended by, or waits for, is a machine that no task moves: quarantined, or parked away from its port."""
    nobodys: str = ""
    """A machine in the air with no task, no order and no quarantine."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What became of a drawn task."""

    seed: int
    text: str
    changed: str
    """What was changed in it, "" = nothing."""
    found: tuple[Diagnostic, ...]
    why_not: str
    """Why it is not good; "" = it is."""

    @property
    def errors(self) -> list[str]:
        """Return the codes of its errors."""
        return sorted({one.code for one in self.found if one.severity == "error"})

    @property
    def warnings(self) -> list[str]:
        """Return the codes of its warnings."""
        return sorted({one.code for one in self.found if one.severity != "error"})


@lru_cache(maxsize=1)
def ground() -> tuple[Site, Catalogue]:
    """Return the site and the catalogue of all runs."""
    catalogue = loader.load_catalogue([folder("actions") / "base.yaml"])[0]
    site = loader.load_site(folder("trees") / "demo-site.yaml", catalogue)[0]
    assert site is not None
    return site, catalogue


def check(text: str, name: str = "good.yaml") -> list[Diagnostic]:
    """Return what the checker says of a task."""
    site, catalogue = ground()
    return loader.load_task_text(text, name, catalogue=catalogue, site=site, others={"Look": CHILD}).diagnostics


def unchecked(text: str) -> tuple[Task | None, list[Diagnostic]]:
    """Return a task without the checks of the whole task, and what was found while it was read."""
    site, catalogue = ground()
    problems = Problems()
    shelf = Shelf((folder("trees"),), problems, read_file)
    unit = shelf.open_text(text, "good.yaml", None, library=False)
    world = World(catalogue, site, None, Neighbours(None, shelf.library, read_file, {"Look": CHILD}))
    reader = loader._TaskReader(world, problems, shelf, unit)
    reader._check = lambda task: None  # type: ignore[method-assign]  # noqa: ARG005
    return reader.read(), problems.found


@lru_cache(maxsize=1)
def cases() -> CaseFile:
    """Return the scenarios, read with a task that has the params and questions of all."""
    site, catalogue = ground()
    del site
    carrier = {
        "formiga": 1, "task": "Good", "params": {"target": "place"}, "agents": {"watcher": {"type": "watcher"}},
        "steps": [{"ask": "At ${target}?", "of": ["watcher"], "options": ["yes", "no", "later"], "timeout": "1 min"}],
    }  # fmt: skip
    told = [{"name": name, "params": {"target": TARGET}, "expect": {}, **case} for name, case in SCENARIOS.items()]
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "good.yaml").write_text(json.dumps(carrier))
        text = json.dumps({"formiga_test": 1, "task": "good.yaml", "cases": told}, indent=1)
        loaded = load_cases_text(text, "scenarios", catalogue=catalogue, folders=(Path(place), folder("trees")))
    assert loaded.cases is not None, loaded.diagnostics
    return loaded.cases


@lru_cache(maxsize=1)
def others() -> Mapping[str, Task]:
    """Return the tasks that run beside, or are requested."""
    site, catalogue = ground()
    found = {}
    for name, text in (("Look", CHILD), ("Other", OTHER)):
        task = loader.load_task_text(text, f"{name}.yaml", catalogue=catalogue, site=site).task
        assert task is not None
        found[name] = task
    return found


def run(task: Task, index: int, limit_s: float = LIMIT_S) -> Ended:
    """Run a task in a scenario, for so long at most."""
    case = cases().cases[index]
    requests = [ScenarioTask(0, task.name, case.params, wait=patience(task))]
    if case.name == "traffic":
        requests = [ScenarioTask(at * 10_000_000, "Other", case.params, wait=WAIT_US) for at in (0, 6, 12)] + requests
    scenario = Scenario(
        "false alarms", cases().site, cases().catalogue, {task.name: task, **others()}, case.agents,
        tuple(requests), case.faults, case.orders, file="scenarios",
    )  # fmt: skip
    played = VirtualRun(scenario)
    mocks = Mocks(case, task.name, played, dict)
    mocks.install()
    try:
        in_time = played.run(limit_s)
        record = next((t for t in played.rehearsal.engine.state.tasks.values() if t.name == task.name), None)
        if record is None:
            return Ended("refused", "", str(played.played.refused))
        sent = (effect for step in played.steps for effect in step.effects if isinstance(effect, SendGoal))
        aloft = any("/recover:" in effect.goal_id for effect in sent)
        state = played.rehearsal.engine.state
        away = [one.id for one in state.agents.values() if one.pool in ("QUARANTINED", "PARKED_AWAY")]
        left = (one.id for one in state.agents.values() if is_nobodys(one, state))
        end = Ended(record.status, record.outcome.code, record.outcome.reason, aloft, nobodys=next(left, ""))
        if in_time:
            return replace(end, blocked=any(f"{one} was in the way" in record.outcome.reason for one in away))
        waits = [goal for goal in state.goals.values() if not goal.ended]
        found = explain(state, scenario.tasks, record.id, played.rehearsal.now, catalogue=cases().catalogue)[1]
        why = "; ".join(f"{one.code}: {one.text}" for one in found if one.code != "chosen")
        return replace(end, status="no end", reason=why, blocked=bool(waits) and all(one.text in away for one in waits))
    finally:
        played.close()


def is_nobodys(agent: AgentRecord, state: EngineState) -> bool:
    """Return whether a machine is in the air with no open task, no order and no quarantine."""
    task = state.tasks.get(agent.task)
    held = (task is not None and not task.ended) or agent.id in state.orders or agent.pool == "QUARANTINED"
    return not agent.human and agent.landed != "grounded" and not held


def judge(seed: int, *, change: bool = False, draw: Callable[[int], str] = good_task) -> Judged | None:
    """Draw a task, run it, and ask the checker; None if it cannot be read to its end."""
    text, changed = drawn(seed, change=change, draw=draw)
    task, problems = unchecked(text)
    found = tuple(check(text))
    if task is None or any(one.severity == "error" for one in problems):
        return None
    return Judged(seed, text, changed, found, why_not(task))


def drawn(seed: int, *, change: bool, draw: Callable[[int], str] = good_task) -> tuple[str, str]:
    """Return the task of a seed and what was changed in it."""
    text = draw(seed)
    if not change:
        return text, ""
    data = json.loads(text)
    dice = Random(seed)
    while True:
        operator = dice.choice([one for one in OPERATORS if one is not other_count])  # it knows no ranges
        places = list(operator(data))
        if places:
            path, what, new = dice.choice(places)
            where = "/".join(str(part) for part in path)
            return json.dumps(new, indent=1), f"{operator.__name__} {where}: {what}"


def why_not(task: Task) -> str:
    """Return in which scenario a task shows that it is not good, and how; "" = in none."""
    for index, case in enumerate(cases().cases):
        ended = run(task, index)
        if ended.nobodys:
            return f"{case.name}: {ended.nobodys} is {NOBODYS}"
        if ended.status != "SUCCEEDED" and not _may_end(case.name, ended):
            return f"{case.name}: {ended.status} {ended.code} {ended.reason}"
        if ended.aloft and case.name in CALM:
            return f"{case.name}: it leaves a machine in the air, which the engine brings home"
    return ""


def _may_end(scenario: str, ended: Ended) -> bool:
    if ended.blocked and (ended.status == "no end" or ended.code in BLOCKED):
        return True
    return ended.status != "no end" and ended.code in MAY_END.get(scenario, ())


def report(judged: list[Judged], number: int) -> str:
    """Return the summary of some drawn tasks."""
    good = [one for one in judged if not one.why_not]
    refused = [one for one in good if one.errors]
    warned = [one for one in good if one.warnings and not one.errors]
    by_code = Counter(code for one in good for code in (*one.errors, *one.warnings))
    missed = Counter(one.why_not.partition(" (")[0] for one in judged if one.why_not and not one.errors)
    lines = [
        f"{number} drawn, {len(judged)} can be read to the end, {len(good)} are good in all {len(cases().cases)} scenarios",
        f"of these {len(refused)} refused ({100 * len(refused) / max(1, len(good)):.1f} %), {len(warned)} warned about",
        *(f"  {code}: {count}" for code, count in by_code.most_common()),
        f"not good, but not refused: {missed.total()}",
        *(f"  {count} x {why[:130]}" for why, count in missed.most_common(12)),
        *(f"seed {one.seed}: {one.why_not[:160]}" for one in judged if one.why_not and not one.errors),
    ]
    return "\n".join(lines)


def main() -> int:
    """Judge so many tasks, keep the files to be looked at; return 1 if over 1 % of the good ones is refused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first task")
    parser.add_argument("--change", action="store_true", help="make one fault in each, as benchmarks/mutation.py does")
    parser.add_argument("--rich", action="store_true", help="tasks of more of the language")
    parser.add_argument("--checked", action="store_true", help="only check them, and write what is said to the page")
    parser.add_argument("--dry", action="store_true", help="print that part of the page, do not write it")
    parser.add_argument("--keep", type=Path, default=Path("false_alarms"))
    given = parser.parse_args()
    if given.checked:
        return _checked(given.tasks, given.seed, dry=given.dry)
    judged = []
    for seed in range(given.seed, given.seed + given.tasks):
        one = judge(seed, change=given.change, draw=rich_task if given.rich else good_task)
        if one is not None:
            judged.append(one)
            _keep(given.keep, one)
        if (seed - given.seed) % 50 == 49:
            print(f"{seed - given.seed + 1} of {given.tasks}", flush=True)
    print(report(judged, given.tasks))
    good = [one for one in judged if not one.why_not]
    nobodys = any(NOBODYS in one.why_not for one in judged)
    return int(nobodys or 100 * sum(bool(one.errors) for one in good) > len(good))


def _checked(number: int, start: int, *, dry: bool) -> int:
    """Check so many tasks of more of the language, write what is said of them; return 1 if anything is."""
    told = {
        seed: [one.code for one in found] for seed in range(start, start + number) if (found := check(rich_task(seed)))
    }
    by_code = Counter(code for codes in told.values() for code in sorted(set(codes)))
    which = ", ".join(f"{code} of {count}" for code, count in by_code.most_common())
    said = f"{len(told)} are blamed ({which})" if told else "none is refused, and none warned about"
    part = PART.format(mark=GOOD_MARK, number=f"{number:,}", seed=start, said=said)
    print(part, *(f"seed {seed}: {' '.join(codes)}" for seed, codes in told.items()), sep="\n")
    if not dry:
        PAGE.write_text(
            PAGE.read_text(encoding="utf-8").partition(GOOD_MARK)[0].rstrip("\n") + f"\n\n{part}", encoding="utf-8"
        )
    return int(bool(told))


def _keep(place: Path, one: Judged) -> None:
    if one.errors if one.why_not else not one.found:
        return
    place.mkdir(exist_ok=True)
    head = f"# {one.why_not}\n" if one.why_not else ""
    head += "".join(f"# {d.code} line {d.mark.line}: {d.message}\n" for d in one.found)
    changed = f"# changed: {one.changed}\n" if one.changed else ""
    readable = yaml.safe_dump(json.loads(one.text), sort_keys=False, width=140, allow_unicode=True)
    name = "-".join([str(one.seed), *one.why_not.partition(":")[0].split()])
    (place / f"{name}.yaml").write_text(head + changed + readable, encoding="utf-8")
    print(f"seed {one.seed}: {head.strip()[2:200]} {changed.strip()}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
