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

from formiga_bt.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.lang.document import Entry, parse
from formiga_bt.lang.loader import load_site
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.reading import (
    Problems,
    did_you_mean,
    fix_word,
    quoted_list,
    read_keys,
    read_mapping,
    read_number,
    read_text,
    shorten,
)
from formiga_bt.lang.scenario.agents import read_agents
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import (
    FaultKind,
    OrderWord,
    Scenario,
    ScenarioAgent,
    ScenarioFault,
    ScenarioOrder,
    ScenarioTask,
)
from formiga_bt.lang.scenario.faults import read_faults
from formiga_bt.lang.scenario.options import FASTEST, FAULTS, ORDERS, SCENARIO, WIND
from formiga_bt.lang.scenario.orders import read_orders
from formiga_bt.lang.scenario.requests import Requests
from formiga_bt.lang.synonyms import surely
from formiga_bt.packaged import folder

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
    "ScenarioTask",
    "load_scenario",
    "load_scenario_text",
    "own_tasks",
]

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


@dataclass(frozen=True, slots=True)
class LoadedScenario:
    """What became of a scenario file; `scenario` is None if there is any error."""

    scenario: Scenario | None
    diagnostics: list[Diagnostic]
    sources: Mapping[str, str] = field(default_factory=dict)


def load_scenario(path: Path, *, catalogue: Catalogue, library: Sequence[Path] | None = None) -> LoadedScenario:
    """Read and check a scenario file, its site and its tasks.

    Args:
        path: of the file.
        catalogue: agent types and actions.
        library: the folders where sites and tasks are looked up that are not beside the file; None = the packaged trees.
    """
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return LoadedScenario(None, [Diagnostic("E008", Mark(file, 1, 1), f"the file cannot be read: {error}")])
    return load_scenario_text(text, file, catalogue=catalogue, folders=(path.parent, *_library(library)))


def load_scenario_text(
    text: str, file: str, *, catalogue: Catalogue, folders: Sequence[Path] | None = None
) -> LoadedScenario:
    """Read the text of a scenario; `file` is its name in marks, `folders` where its site and tasks are looked up."""
    problems = Problems()
    sources = {file: text}
    node, found = parse(text, file)
    problems.extend(found)
    if node is None and not found:
        problems.add("E008", Mark(file, 1, 1), "the file is empty", "begin with: scenario: a_name")
    root = read_mapping(node, problems, "scenario") if node is not None else None
    scenario = None
    if root is not None:
        keys = read_keys(root, SCENARIO, problems, "a scenario")
        scenario = _read(problems, sources, keys, catalogue, folders or _library(None), file)
    return LoadedScenario(None if problems.has_errors() else scenario, in_order(problems.found), sources)


def _library(library: Sequence[Path] | None) -> tuple[Path, ...]:
    return (folder("trees"),) if library is None else tuple(library)


def _read(
    problems: Problems,
    sources: dict[str, str],
    keys: dict[str, Entry],
    catalogue: Catalogue,
    folders: Sequence[Path],
    file: str,
) -> Scenario | None:
    """Build the scenario; what is wrong was reported."""
    site, where = _site(problems, sources, keys, catalogue, folders)
    name, speed = _name(problems, keys), _speed(problems, keys)
    if site is None:
        return None  # nothing else can be read without places and agents
    book = Book(problems, sources, keys, catalogue, site, folders)
    seed, wind = book.whole(keys, "seed", 0, least=0), _wind(book)
    agents = read_agents(book)
    asked = Requests(book, own_tasks(where))
    requests = asked.read()
    faults = read_faults(book)
    orders = read_orders(book, asked.tasks)
    return Scenario(
        name,
        site,
        catalogue,
        {one: task for one, task in asked.tasks.items() if task is not None},
        tuple(agents),
        tuple(sorted(requests, key=lambda request: request.at)),
        tuple(sorted(faults, key=lambda fault: fault.at)),
        tuple(sorted(orders, key=lambda order: order.at)),
        wind,
        speed,
        seed,
        file,
    )


def _name(problems: Problems, keys: Mapping[str, Entry]) -> str:
    at = read_text(keys["scenario"].value, problems, "scenario") if "scenario" in keys else None
    if at is not None and not _NAME.fullmatch(at.text):
        help_ = "a letter, then letters, digits, - and _"
        problems.add("E008", at.mark, f"'{shorten(at.text)}' cannot be a scenario's name", help_)
    return at.text if at is not None else ""


def _speed(problems: Problems, keys: Mapping[str, Entry]) -> float:
    if "speed" not in keys:
        return 1.0
    node = keys["speed"].value
    speed = read_number(node, problems, "speed")
    if speed is not None and not 0.1 <= speed <= FASTEST:
        problems.add("E062", node.mark, f"'speed' must lie between 0.1 and {FASTEST:g}")
    return speed if speed is not None else 1.0


def _wind(book: Book) -> tuple[float, float]:
    entry = book.keys.get("wind")
    mapping = book.mapping(entry.value, "wind") if entry is not None else None
    if mapping is None:
        return 0.0, 0.0
    keys = read_keys(mapping, WIND, book.problems, "the wind")
    return book.quantity(keys, "east", "speed", 0.0), book.quantity(keys, "north", "speed", 0.0)


def _site(
    problems: Problems,
    sources: dict[str, str],
    keys: Mapping[str, Entry],
    catalogue: Catalogue,
    folders: Sequence[Path],
) -> tuple[Site | None, Path | None]:
    """Return the site, and its file."""
    at = read_text(keys["site"].value, problems, "site") if "site" in keys else None
    if at is None:
        return None, None
    path = next((place / at.text for place in folders if at.text and _is_file(place / at.text)), None)
    if path is None:
        known = sorted({p.name for place in folders for p in place.glob("*site*.yaml")})
        what = f"no site file '{shorten(at.text)}'{did_you_mean(at.text, known)}"
        help_ = f"sites: {quoted_list(known)}" if known else "a path relative to this file"
        problems.add("E008", at.mark, what, help_, fix_word(at, surely(at.text, known)))
        return None, None
    site, found, sources = load_site(path, catalogue)
    problems.extend(found)
    sources.update(sources)
    return site, path


def own_tasks(site_file: Path | None) -> Path | None:
    """Return the folder of a site's own tasks, as `formiga up` finds it; None: it has none."""
    own = site_file.parent / "trees" if site_file is not None else None
    return own if own is not None and own.is_dir() else None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
