"""Scenario files (`scenario: NAME`): a fleet, tasks at their times, and what goes wrong, for `sim`, demos and tests.

    scenario: bad-day
    site: demo-site.yaml              # beside this file, else one that ships with formiga
    speed: 10
    seed: 1
    agents: [{id: hwd_1, type: hwd, at: p5, battery: 90 %}, {id: picker_1, at: camp, person: {answers: [...]}}]
    tasks: [{at: 0 s, task: PickUp, params: {target: camp, user: picker_1}, priority: medium}]
    faults: [{at: 40 s, agent: hwd_1, kind: freeze, for: 10 s}]
    orders: [{at: 60 s, order: hold, target: hwd_1, by: watcher_1}, {at: 90 s, lockdown: return}]

Every problem is located and named at once. A scenario names tasks, not their files: they are looked up by name beside the
scenario, then in the library; what they request is played too. Times count from the instant at which all agents are there.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, in_order
from formiga_bt.base.packaged import folder
from formiga_bt.lang.compose import Composed, compose
from formiga_bt.lang.keyed import Keys, read_root, text_of
from formiga_bt.lang.loader import load_site
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.scenario.agents import read_agents
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.clock import in_zone, read_now
from formiga_bt.lang.scenario.entries import (
    FaultKind,
    OrderWord,
    Scenario,
    ScenarioAgent,
    ScenarioFault,
    ScenarioOrder,
    ScenarioResult,
    ScenarioTask,
)
from formiga_bt.lang.scenario.faults import read_faults
from formiga_bt.lang.scenario.forms import with_forms
from formiga_bt.lang.scenario.options import FAULTS, ORDERS, SCENARIO, WIND
from formiga_bt.lang.scenario.orders import read_orders
from formiga_bt.lang.scenario.requests import RequestReader
from formiga_bt.lang.scenario.results import read_results
from formiga_bt.lang.text.reading import Problems, did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import surely

__all__ = [
    "FAULTS",
    "ORDERS",
    "FaultKind",
    "LoadedScenario",
    "OrderWord",
    "Scenario",
    "ScenarioAgent",
    "ScenarioFault",
    "ScenarioOrder",
    "ScenarioResult",
    "ScenarioTask",
    "load_scenario",
    "load_scenario_text",
    "own_tasks",
    "site_at",
]

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@dataclass(frozen=True, slots=True)
class LoadedScenario:
    """What became of a scenario file; `scenario` is None if there is any error."""

    scenario: Scenario | None
    diagnostics: list[Diagnostic]
    sources: Mapping[str, str] = field(default_factory=dict)


def load_scenario(
    path: Path,
    *,
    catalogue: Catalogue | None = None,
    actions: Sequence[Path] = (),
    library: Sequence[Path] | None = None,
) -> LoadedScenario:
    """Read and check a scenario file, its site and its tasks.

    Args:
        path: of the file.
        catalogue: agent types and actions; None = those of its site.
        actions: catalogue files that are added to those of its site.
        library: the folders where sites and tasks are looked up that are not beside the file; None = the packaged trees.
    """
    problems = Problems()
    text = text_of(path, problems)
    if text is None:
        return LoadedScenario(None, problems.found)
    folders = (path.parent, *_library(library))
    return load_scenario_text(text, str(path), catalogue=catalogue, actions=actions, folders=folders)


def load_scenario_text(
    text: str,
    file: str,
    *,
    catalogue: Catalogue | None = None,
    actions: Sequence[Path] = (),
    folders: Sequence[Path] | None = None,
) -> LoadedScenario:
    """Read the text of a scenario; `file` is its name in marks, `folders` where its site and tasks are looked up."""
    problems = Problems()
    sources = {file: text}
    keys = read_root(text, file, SCENARIO, problems, what="scenario", owner="a scenario", begin="scenario: a_name")
    scenario: Scenario | None = None
    if keys is not None:
        scenario = _read(problems, sources, keys, (catalogue, actions), folders or _library(None), file)
    return LoadedScenario(None if problems.has_errors() else scenario, in_order(problems.found), sources)


def _library(library: Sequence[Path] | None) -> tuple[Path, ...]:
    return (folder("trees"),) if library is None else tuple(library)


def _read(
    problems: Problems,
    sources: dict[str, str],
    keys: Keys,
    known: tuple[Catalogue | None, Sequence[Path]],
    folders: Sequence[Path],
    file: str,
) -> Scenario | None:
    """Build the scenario; what is wrong was reported. `known`: its catalogue, or what is added to that of its site."""
    where = _site_file(problems, keys, folders)
    name, speed = _name(keys), keys.number("speed")
    if where is None:
        return None  # nothing else can be read without places and agents
    world = site_at(where, *known)
    problems.extend(world.diagnostics)
    sources.update(world.sources)
    site, catalogue = world.site, world.catalogue
    if site is None:
        return None
    site = in_zone(keys, site)
    now = read_now(keys, site)
    book = Book(problems, sources, keys, catalogue, site, folders, now)
    seed, wind = keys.whole("seed"), keys.inside("wind", WIND, "the wind")
    agents = read_agents(book)
    asked = RequestReader(book, own_tasks(where))
    requests = asked.read()
    faults = read_faults(book)
    orders = read_orders(book, asked.tasks)
    results = read_results(book)
    return Scenario(
        name,
        site,
        catalogue,
        {one: task for one, task in asked.tasks.items() if task is not None},
        with_forms(book, agents, filter(None, asked.tasks.values())),
        tuple(sorted(requests, key=lambda request: request.at)),
        tuple(sorted(faults, key=lambda fault: fault.at)),
        tuple(sorted(orders, key=lambda order: order.at)),
        results,
        (wind.number("east"), wind.number("north")),
        speed,
        seed,
        file,
        now,
    )


def _name(keys: Keys) -> str:
    at = keys.text("scenario")
    if at is not None and not _NAME.fullmatch(at.text):
        keys.wrong(
            "scenario",
            "E008",
            f"'{shorten(at.text)}' cannot be a scenario's name",
            "a letter, then letters, digits, - and _",
        )
    return at.text if at is not None else ""


def site_at(path: Path, catalogue: Catalogue | None, actions: Sequence[Path]) -> Composed:
    """Return the site of a file with a catalogue; None = with those that it uses, and `actions`."""
    if catalogue is None:
        return compose(path, actions)
    site, found, sources = load_site(path, catalogue)
    return Composed(catalogue, site, (), tuple(found), sources)


def _site_file(problems: Problems, keys: Keys, folders: Sequence[Path]) -> Path | None:
    """Return the file of the site, or None (reported)."""
    at = keys.text("site")
    if at is None:
        return None
    path = next((place / at.text for place in folders if at.text and _is_file(place / at.text)), None)
    if path is None:
        known = sorted({p.name for place in folders for p in place.glob("*site*.yaml")})
        what = f"no site file '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        help_ = f"sites: {quoted_list(known)}" if known else "a path relative to this file"
        problems.add("E008", at.mark, what, help_, fix_word(at, surely(at.text, known)))
    return path


def own_tasks(site_file: Path | None) -> Path | None:
    """Return the folder of a site's own tasks, as `formiga up` finds it; None: it has none."""
    own = site_file.parent / "trees" if site_file is not None else None
    return own if own is not None and own.is_dir() else None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
