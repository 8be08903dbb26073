"""Journals of missions that were flown on the demo site in virtual time, in a folder as `formiga up` leaves it."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from msgspec import Struct

from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.journal.records import SITE_FILES
from formiga_bt.journal.store import Journal
from formiga_bt.journal.writer import Writer
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.scenario import Scenario, ScenarioTask
from formiga_bt.lang.scenario.entries import Priority
from formiga_bt.rehearsal.cases.mocks import Mocks
from formiga_bt.rehearsal.cases.reading import load_cases_text
from formiga_bt.rehearsal.simulation import VirtualRun
from formiga_bt.show.history.folded import FoldedSource
from formiga_bt.show.history.ledger import ALL, Ledger
from formiga_bt.show.replay.machine import TimeMachine

WALL = 1_700_000_000_000_000
SITE = "rovaniemi"

GOOD = """\
  - name: a load
    params: {target: north_field, user: picker_1}
    answers: [{ask: 1, answer: not_yet, after: 7 s}, {ask: 2, answer: loaded, after: 5 s}]
    expect: {}
"""
BLOCKED = """\
  - name: the way is blocked
    params: {target: north_field, user: picker_1}
    agents: {hwd_2: {battery: 40 %}}
    answers: [{do: drone.GoTo, nth: 2, fail: blocked, after: 2 s}]
    expect: {}
"""
ABORTED = """\
  - name: an abort on the way
    params: {target: north_field, user: picker_1}
    abort_at: 30 s
    expect: {}
"""


class Flown(Struct, frozen=True):
    """A folder with a journal, and what a ledger has that saw every step as it came."""

    folder: Path
    ledger: Ledger
    steps: Sequence[EngineStep]

    @property
    def where(self) -> Path:
        """Return the journal."""
        return self.folder / ".formiga" / SITE / "journal.db"

    def machine(self) -> TimeMachine:
        """Return the time machine on it."""
        return TimeMachine(self.where, SITE)

    def live(self, machine: TimeMachine) -> FoldedSource:
        """Return the site as a running engine would have shown it at the end."""
        from formiga_bt.show.replay.source import KeptTasks

        return FoldedSource(self.ledger, machine.files.site, KeptTasks(machine.files), machine.files.catalogue)


@cache
def catalogue() -> tuple[Catalogue, dict[str, str]]:
    """Return the catalogue that ships, and its texts."""
    found, problems, texts = load_catalogue(files("actions"))
    assert not problems
    return found, dict(texts)


def fly(
    into: Path,
    case: str,
    *,
    task: str = "pick_up.yaml",
    again: int = 1,
    later: Sequence[tuple[float, Priority]] = (),
    snapshot_steps: int = 40,
) -> Flown:
    """Fly a case of `formiga test`, with its faults and answers, and keep a journal of it.

    Args:
        into: the folder of the site.
        case: an item of `cases`.
        task: the task's file.
        again: it is requested so often, 300 s apart.
        later: when it is requested again, in seconds, and with which priority; then the first one has a low one.
        snapshot_steps: between two snapshots.
    """
    the_catalogue, texts = catalogue()
    read = load_cases_text(
        f"formiga_test: 1\ntask: {task}\ncases:\n{case}", "flown.test.yaml", catalogue=the_catalogue,
        folders=(folder("trees"),),
    )  # fmt: skip
    assert read.cases is not None, [str(one) for one in read.diagnostics]
    cases, given = read.cases, read.cases.cases[0]
    requests = tuple(ScenarioTask(n * 300_000_000, cases.task.name, given.params) for n in range(again))
    if later:
        times: list[tuple[float, Priority]] = [(0.0, "low"), *later]
        requests = tuple(
            ScenarioTask(round(at * 1e6), cases.task.name, given.params, priority) for at, priority in times
        )
    run = VirtualRun(
        Scenario("flown", cases.site, the_catalogue, {cases.task.name: cases.task}, given.agents, requests, given.faults,
                 given.orders)
    )  # fmt: skip
    world = run.rehearsal
    Mocks(given, cases.task.name, run, _roles(run, cases.task.name)).install()
    flown = Flown(into, Ledger(ALL), [])
    flown.where.parent.mkdir(parents=True)
    with Journal(flown.where, SITE, durability="normal") as journal:
        journal.take()
        state = world.engine.state
        writer = Writer(
            journal, lambda: state, wall=lambda: WALL, clock=lambda: 0.0, snapshot_steps=snapshot_steps
        )  # fmt: skip
        writer.begin()
        for step in world.steps:
            flown.ledger.feed(step)
        sources = {path: text for path, text in read.sources.items() if not path.endswith(".test.yaml")}
        site = next(path for path in sources if path.endswith("demo-site.yaml"))
        journal.keep_bundle(SITE_FILES, "", site, {**texts, site: sources[site]})
        journal.keep_bundle(cases.task.name, cases.task.bundle, cases.task.mark.file, sources)

        def keep(step: EngineStep) -> None:
            flown.ledger.feed(step)
            flown.steps.append(step)  # type: ignore[attr-defined]
            assert writer.keep([step]).durable

        world.driver.listeners.append(keep)
        assert run.run(4 * 3600.0)
        writer.end()
    run.close()
    return flown


def _roles(run: VirtualRun, name: str):  # type: ignore[no-untyped-def]
    return lambda: next((t.agents.roles for t in run.rehearsal.engine.state.tasks.values() if t.name == name), {})
