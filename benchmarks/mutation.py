"""How many faults of task files does the checker find? Writes docs/mutation.md.

python benchmarks/mutation.py [--jobs N] [--only FILE] [--dry] [--known FILE]

All of it takes about two hours of one core. `--known FILE` keeps what came of the runs, which the checks do not
change, so that a check can be tried in a minute.

Every single fault of `tests/mutation/operators.py` is made in the ten missions and in lib/flying.yaml. A mutated file that
cannot be read to its end (a name that nothing has, a unit that does not fit) has no meaning; it
counts as worse.
Any other one is run, also where the checker refuses it, through the scenarios of `tests/mutation/scenarios.py`; it is worse if
any scenario ends otherwise, with other positions, or with another trace than the original: other goals, fields, times (to a
second), questions or notices.
"""

import argparse
import hashlib
import json
import multiprocessing
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

import yaml

from benchmarks import mistakes
from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.changes import QuestionPut
from formiga_bt.engine.kernel.inputs import NotifyPeople, SendGoal
from formiga_bt.lang import loader
from formiga_bt.lang.files import Shelf, read_file
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.scenario import Scenario, ScenarioTask
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.world import World
from formiga_bt.rehearsal.cases.cases import CaseFile
from formiga_bt.rehearsal.cases.mocks import Mocks
from formiga_bt.rehearsal.cases.reading import load_cases_text
from formiga_bt.rehearsal.rehearsal import patience
from formiga_bt.rehearsal.simulation import VirtualRun
from tests.mutation.operators import OPERATORS, Fault, faults
from tests.mutation.scenarios import COOKBOOK, HOSTS, LIBRARY_HOSTS, MISSIONS, test_file

ROOT: Final = Path(__file__).parents[1]
TREES: Final = folder("trees")
OWN: Final = ROOT / "tests" / "mutation"
LIBRARY: Final = "lib/flying.yaml"
LIMIT_S: Final = 6 * 3600.0

PAGE: Final = """\
# Faults that the checker finds

Written by `python benchmarks/mutation.py`; do not edit. The faults are those of `tests/mutation/operators.py`, at every place
where one can be made in the ten missions and in `lib/flying.yaml`; the scenarios are those of `tests/mutation/scenarios.py`,
{scenarios} for each mission. A file that cannot be read to its end (a name that nothing has, a unit that does not fit) counts
as worse. Any other one is run, also if the checker refuses it, and is worse if any scenario ends otherwise or leaves
another trace than the original: goals and their fields, seconds, questions, notices, where machines stand. `found` are
those that the checker refuses or warns about.

| | faults | found | share |
|---|---:|---:|---:|
| worse in some scenario | {worse} |
| of these, cannot be read to the end | {unread} |
| of these, would run | {run} |
| the same in all scenarios | {same} |

## Trees that no check was tuned on

The checks were written while looking at the faults above that slipped through, so that figure says too how well they fit
those. None was fitted to faults of these trees of the [cookbook](cookbook.md), which only had to pass without a warning:
the same faults with scenarios made in the same way, in
{trees}.

| | faults | found | share |
|---|---:|---:|---:|
| worse in some scenario | {other_worse} |
| of these, cannot be read to the end | {other_unread} |
| of these, would run | {other_run} |
| the same in all scenarios | {other_same} |

Of all {all_worse} faults of both tables that are worse, {all_share} are found.

## By kind of fault

Of the ten missions and the library again.

| kind | faults | worse | found | share | would run | found | the same | found |
|---|---:|---:|---:|---:|---:|---:|---:|---:|
{rows}

## What slips through

Faults that are worse in some scenario, named here, and of which the checker says nothing. Most are other tasks, not wrong ones:
another height, another order, a question fewer; no rule tells them from what an author may want.

{slips}
"""

KNOWN: Final[dict[str, str]] = {}
"""Digest of a host and a mutated file -> the first scenario that is worse."""

Verdict = Literal["meaningless", "worse", "same"]
Trace = tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class Found:
    """What became of one fault."""

    file: str
    operator: str
    where: str
    what: str
    verdict: Verdict
    codes: tuple[str, ...]
    """What the checker says, errors first."""
    scenario: str = ""
    """The first one that is worse."""

    @property
    def is_caught(self) -> bool:
        """Return whether the checker refuses it or warns."""
        return bool(self.codes)


# --- files -------------------------------------------------------------------------------------------------------


def plain(data: Any) -> Any:
    """Turn the texts of a file into whole numbers and flags where they are written so."""
    match data:
        case dict():
            return {key: plain(value) for key, value in data.items()}
        case list():
            return [plain(value) for value in data]
        case str() if re.fullmatch(r"-?\d+", data):
            return int(data)
        case "true" | "false":
            return data == "true"
    return data


def path_of(file: str) -> Path:
    """Return where a mission's file is."""
    return OWN / file if (OWN / file).exists() else TREES / file


@lru_cache(maxsize=32)
def original(file: str) -> Any:
    """Return a file as data."""
    return plain(yaml.load(path_of(file).read_text(encoding="utf-8"), yaml.BaseLoader))  # texts only


def text_of(data: Any) -> str:
    """Write data as a file."""
    return str(yaml.safe_dump(data, sort_keys=False, width=10_000, allow_unicode=True))


@lru_cache(maxsize=1)
def ground() -> tuple[Site, Catalogue]:
    """Return the site and the catalogue of all scenarios."""
    catalogue = loader.load_catalogue([folder("actions") / "base.yaml"])[0]
    site = loader.load_site(TREES / "demo-site.yaml", catalogue)[0]
    assert site is not None
    return site, catalogue


def reading(library: str | None) -> Any:
    """Return a reader of imports that has another text for the library."""
    if library is None:
        return read_file
    return lambda path: library if path.name == Path(LIBRARY).name else read_file(path)


# --- checking ----------------------------------------------------------------------------------------------------


def check(text: str, file: str, library: str | None = None) -> list[Diagnostic]:
    """Return what the checker says of a task on the site."""
    site, catalogue = ground()
    loaded = loader.load_task_text(
        text, file, catalogue=catalogue, site=site, folder_=path_of(file).parent, read=reading(library)
    )
    return loaded.diagnostics


def check_library(text: str) -> list[Diagnostic]:
    """Return what the checker says of the library by itself."""
    site, catalogue = ground()
    return loader.load_library_text(text, LIBRARY, catalogue=catalogue, site=site, folder_=TREES / "lib").diagnostics


def forced(text: str, file: str, library: str | None = None) -> Task | None:
    """Return a task without the checks of the whole task; None if it cannot be read to its end."""
    site, catalogue = ground()
    problems = Problems()
    shelf = Shelf((TREES,), problems, reading(library))
    unit = shelf.open_text(text, file, path_of(file).parent, library=False)
    if unit.root is None:
        return None
    reader = loader._TaskReader(World(catalogue, site, None), problems, shelf, unit)
    reader._check = lambda task: None  # type: ignore[method-assign]  # noqa: ARG005
    task = reader.read()
    return None if problems.has_errors() else task


# --- running -----------------------------------------------------------------------------------------------------


@lru_cache(maxsize=32)
def cases_of(mission_file: str) -> CaseFile:
    """Return the scenarios of a mission."""
    mission = next(one for one in (*MISSIONS, *HOSTS, *COOKBOOK) if one.file == mission_file)
    text = test_file(mission)
    folders = (OWN, TREES)
    loaded = load_cases_text(text, "scenarios", catalogue=ground()[1], folders=folders)
    assert loaded.cases is not None, loaded.diagnostics
    return loaded.cases


def trace_of(cases: CaseFile, index: int, task: Task) -> Trace:
    """Run one scenario and return its end and its trace."""
    case = cases.cases[index]
    scenario = Scenario(
        "mutation", cases.site, cases.catalogue, {task.name: task}, case.agents,
        (ScenarioTask(0, task.name, case.params, wait=patience(task)),), case.faults, case.orders, file="scenarios",
    )  # fmt: skip
    run = VirtualRun(scenario)
    mocks = Mocks(case, task.name, run, dict)
    mocks.install()
    try:
        in_time = run.run(LIMIT_S)
        return _trace(run, in_time)
    except AssertionError as error:
        return ("raised", type(error).__name__)
    finally:
        run.close()


def _trace(run: VirtualRun, in_time: bool) -> Trace:
    state, began = run.rehearsal.engine.state, run.began
    task = state.tasks.get(run.played.task_ids[0]) if run.played.task_ids else None
    if task is None:
        return ("refused", tuple(run.played.refused))
    said: list[Any] = []
    seen: set[str] = set()
    for step in run.steps:
        second = round((step.at - began) / 1e6)
        for effect in step.effects:
            if isinstance(effect, SendGoal) and effect.goal_id not in seen:
                seen.add(effect.goal_id)
                said.append((second, effect.agent, effect.action, repr(sorted(effect.fields.items()))))
            elif isinstance(effect, NotifyPeople):
                said.append((second, effect.text))
        said += [(second, c.question.text) for c in step.changes if isinstance(c, QuestionPut)]
    ended = round(((task.times.ended_at or run.rehearsal.now) - began) / 1e6)
    machines = tuple(
        (agent.id, agent.landed, agent.pool, _rounded(agent))
        for agent in state.agents.values()
        if agent.type in ("lwd", "hwd")
    )
    return (task.status if in_time else "no end", task.outcome.code, ended, tuple(said), machines)


def _rounded(agent: Any) -> Any:
    at = agent.position
    return (round(at.east_m), round(at.north_m), round(at.up_m)) if at is not None else None


@lru_cache(maxsize=512)
def expected(file: str, index: int) -> Trace:
    """Return the trace of the original."""
    cases = cases_of(file)
    return trace_of(cases, index, cases.task)


def worse_in(file: str, task: Task, key: str) -> str:
    """Return the name of the first scenario that is worse, "" = none; `key` is of what was found in an earlier run."""
    if key in KNOWN:
        return KNOWN[key]
    KNOWN[key] = found = _worse_in(file, task)
    return found


def _worse_in(file: str, task: Task) -> str:
    cases = cases_of(file)
    for index, case in enumerate(cases.cases):
        if trace_of(cases, index, task) != expected(file, index):
            return case.name
    return ""


# --- one fault ---------------------------------------------------------------------------------------------------


def codes_of(found: list[Diagnostic]) -> tuple[str, ...]:
    """Return the codes, errors first, each once."""
    return tuple(sorted({d.code for d in found}))


def try_task(file: str, fault: Fault) -> Found:
    """Check and run a mission with a fault."""
    text = text_of(fault.data)
    codes = codes_of(check(text, file))
    task = forced(text, file)
    if task is None:
        return Found(file, fault.operator, fault.where, fault.what, "meaningless", codes)
    scenario = worse_in(file, task, digest(file, text))
    return Found(file, fault.operator, fault.where, fault.what, "worse" if scenario else "same", codes, scenario)


def try_library(fault: Fault) -> Found:
    """Check the library with a fault and the missions that call it; run those."""
    text = text_of(fault.data)
    subtree = fault.where.split("/")[1] if "/" in fault.where else ""
    diagnostics = check_library(text)
    hosts = LIBRARY_HOSTS.get(subtree, ())
    verdict: Verdict = "same"
    scenario = ""
    for host in hosts:
        own = text_of(original(host))
        diagnostics += check(own, host, text)
        task = forced(own, host, text)
        if task is None:
            verdict = "meaningless"
            break
        scenario = scenario or worse_in(host, task, digest(host, text))
    if scenario and verdict != "meaningless":
        verdict = "worse"
    return Found(LIBRARY, fault.operator, fault.where, fault.what, verdict, codes_of(diagnostics), scenario)


def digest(host: str, text: str) -> str:
    """Return the key of a mutated file run as, or called by, a mission."""
    return hashlib.sha256(f"{host}\n{text}".encode()).hexdigest()


def try_one(job: tuple[str, int]) -> tuple[Found, dict[str, str]]:
    """Try the fault of a number in a file; return with it what its runs said that was not known."""
    file, number = job
    fault = all_faults(file)[number]
    before = set(KNOWN)
    found = try_library(fault) if file == LIBRARY else try_task(file, fault)
    return found, {key: KNOWN[key] for key in KNOWN.keys() - before}


@lru_cache(maxsize=16)
def all_faults(file: str) -> list[Fault]:
    """Return all faults of a file."""
    return list(faults(original(file)))


def check_originals() -> None:
    """See to it that writing the data again changes nothing: no message, the same traces."""
    for mission in (*MISSIONS, *HOSTS, *COOKBOOK):
        text = text_of(original(mission.file))
        found, task = check(text, mission.file), forced(text, mission.file)
        assert not found, (mission.file, found)
        assert task is not None
        assert not _worse_in(mission.file, task), mission.file


# --- report ------------------------------------------------------------------------------------------------------


def percent(part: int, whole: int) -> str:
    """Write a share."""
    return f"{100 * part / whole:.1f} %" if whole else "-"


def report(found: list[Found], others: list[Found]) -> str:
    """Return the page: of the missions and the library, and of the cookbook."""
    worse = [one for one in found if one.verdict != "same"]
    run = [one for one in found if one.verdict == "worse"]
    every = [one for one in (*found, *others) if one.verdict != "same"]
    return PAGE.format(
        scenarios=len(cases_of(MISSIONS[0].file).cases),
        worse=cells(worse),
        unread=cells([one for one in found if one.verdict == "meaningless"]),
        run=cells(run),
        same=cells([one for one in found if one.verdict == "same"]),
        trees=", ".join(f"`{Path(mission.file).stem}`" for mission in COOKBOOK),
        all_worse=len(every),
        all_share=percent(sum(one.is_caught for one in every), len(every)),
        other_worse=cells([one for one in others if one.verdict != "same"]),
        other_unread=cells([one for one in others if one.verdict == "meaningless"]),
        other_run=cells([one for one in others if one.verdict == "worse"]),
        other_same=cells([one for one in others if one.verdict == "same"]),
        rows="\n".join(row(operator.__name__, found) for operator in OPERATORS),
        slips="\n".join(slips(run)),
    )


def cells(some: list[Found]) -> str:
    """Write how many faults there are, how many of them are found, and the share."""
    caught = sum(one.is_caught for one in some)
    return f"{len(some)} | {caught} | {percent(caught, len(some))}"


def row(operator: str, found: list[Found]) -> str:
    """Return the row of an operator."""
    mine = [one for one in found if one.operator == operator]
    worse = [one for one in mine if one.verdict != "same"]
    run = [one for one in mine if one.verdict == "worse"]
    same = [one for one in mine if one.verdict == "same"]
    caught = sum(one.is_caught for one in worse)
    return (
        f"| `{operator}` | {len(mine)} | {len(worse)} | {caught} | {percent(caught, len(worse))} | {len(run)} | "
        f"{sum(one.is_caught for one in run)} | {len(same)} | {sum(one.is_caught for one in same)} |"
    )


def slips(run: list[Found]) -> Iterator[str]:
    """Iterate over the lines about faults that nothing was said of."""
    missed = [one for one in run if not one.is_caught]
    for operator, count in Counter(one.operator for one in missed).most_common():
        yield f"* `{operator}`, {count}:"
        for one in missed:
            if one.operator == operator:
                yield f"    * {one.file} {one.where}: {one.what} (scenario: {one.scenario})"


def main() -> None:
    """Try all faults, print a summary, write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", help="one file, such as pick_up.yaml")
    parser.add_argument("--dry", action="store_true", help="print the page, do not write it")
    parser.add_argument("--known", type=Path, help="a file that keeps what came of the runs")
    given = parser.parse_args()
    if given.known and given.known.exists():
        KNOWN.update(json.loads(given.known.read_text()))
    check_originals()
    cookbook = {mission.file for mission in COOKBOOK}
    files = [given.only] if given.only else [*(mission.file for mission in MISSIONS), LIBRARY, *sorted(cookbook)]
    jobs = [(file, number) for file in files for number in range(len(all_faults(file)))]
    with multiprocessing.Pool(given.jobs) as pool:
        found = []
        for one, said in pool.imap(try_one, jobs, chunksize=4):
            found.append(one)
            KNOWN.update(said)
            if given.known and said:
                given.known.write_text(json.dumps(KNOWN))
    page = report([one for one in found if one.file not in cookbook], [one for one in found if one.file in cookbook])
    if given.dry or given.only:
        print(page)
    else:
        written = ROOT / "docs" / "mutation.md"
        by_hand = written.read_text(encoding="utf-8").partition(mistakes.MARK)[1:]
        written.write_text(page.rstrip("\n") + "\n\n" + "".join(by_hand), encoding="utf-8")
        print("\n".join(line for line in page.split("\n") if line.startswith("| ") and "`" not in line))


if __name__ == "__main__":
    main()
