"""Reads test files (`formiga_test: 1`): every problem located, all of them at once.

formiga_test: 1
task: pick_up.yaml
cases:
  - name: the picker is ready
    params: {target: north_field, user: picker_1}
    answers: [{ask: loaded, answer: loaded, after: 5 s}]
    expect: {status: succeeded, end_state: {drone: at_port}}
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from formiga_bt.base.clock import Micros, micros
from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.base.packaged import folder
from formiga_bt.lang.keyed import Keys, check_version, read_keys, read_root, text_of
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.request.profiles import load_profile, profile_file, unknown_profile
from formiga_bt.lang.request.requested import with_requested
from formiga_bt.lang.scenario import own_tasks, site_at
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.clock import in_zone, read_now
from formiga_bt.lang.scenario.entries import START, ScenarioOrder
from formiga_bt.lang.scenario.requests import read_params, written_params
from formiga_bt.lang.scenario.results import read_results
from formiga_bt.lang.text.document import Mapping_, Scalar
from formiga_bt.lang.text.reading import Problems, did_you_mean, shorten
from formiga_bt.rehearsal.cases.agents import CaseAgents
from formiga_bt.rehearsal.cases.cases import Case, CaseFile
from formiga_bt.rehearsal.cases.during import read_befalls
from formiga_bt.rehearsal.cases.expecting import read_expect
from formiga_bt.rehearsal.cases.options import CASE, FILE
from formiga_bt.rehearsal.cases.rules import read_rules

DEMO_SITE = "demo-site.yaml"


@dataclass(frozen=True, slots=True)
class LoadedCases:
    """What became of a test file; `cases` is None if there is any error."""

    cases: CaseFile | None
    diagnostics: list[Diagnostic]
    sources: Mapping[str, str] = field(default_factory=dict)


def load_cases(
    path: Path,
    *,
    catalogue: Catalogue | None = None,
    actions: Sequence[Path] = (),
    library: Sequence[Path] | None = None,
) -> LoadedCases:
    """Read and check a test file, its task and its site.

    Args:
        path: of the file.
        catalogue: agent types and actions; None = those of its site.
        actions: catalogue files that are added to those of its site.
        library: the folders where tasks and sites are looked up that are not beside the file; None = the packaged trees.
    """
    problems = Problems()
    text = text_of(path, problems)
    if text is None:
        return LoadedCases(None, problems.found)
    folders = (path.parent, *((folder("trees"),) if library is None else library))
    return load_cases_text(text, str(path), catalogue=catalogue, actions=actions, folders=folders)


def load_cases_text(
    text: str, file: str, *, catalogue: Catalogue | None = None, actions: Sequence[Path] = (), folders: Sequence[Path]
) -> LoadedCases:
    """Read the text of a test file; `file` is its name in marks, `folders` where its task and site are looked up."""
    reader = _Reader(file, text, (catalogue, actions), folders)
    found = reader.read()
    errors = reader.problems.has_errors()
    return LoadedCases(None if errors else found, in_order(reader.problems.found), reader.sources)


class _Reader:
    """Reads one test file."""

    def __init__(
        self, file: str, text: str, known: tuple[Catalogue | None, Sequence[Path]], folders: Sequence[Path]
    ) -> None:
        self.problems = Problems()
        self.sources = {file: text}
        self._file = file
        self._text = text
        self._known = known
        self._catalogue = known[0] or Catalogue()
        self._folders = folders
        self._now: Micros | None = None
        self._own: Path | None = None
        """The folder of the site's own tasks."""

    def read(self) -> CaseFile | None:
        """Return what the file says, as far as it can be read."""
        text, file, begin = self._text, self._file, "formiga_test: 1"
        keys = read_root(text, file, FILE, self.problems, what="test", owner="a test file", begin=begin)
        if keys is None:
            return None
        check_version(keys, "formiga_test", "these tests need")
        site = self._site(keys)
        site = in_zone(keys, site) if site is not None else None
        task = self._task(keys, site) if site is not None else None
        if site is None or task is None:
            return None
        self._now = read_now(keys, site)
        with self.problems.within(task.name):
            cases = self._cases(keys, task, site)
        _, *requested = with_requested(task, lambda path: self._load(path, site), site)
        return CaseFile(self._file, task, site, self._catalogue, tuple(cases), tuple(requested))

    def _site(self, keys: Keys) -> Site | None:
        at = keys.text("site")
        if "site" in keys and at is None:
            return None
        name = at.text if at is not None else DEMO_SITE
        path = self._look_up(at, name, "site file", "*site*.yaml")
        if path is None:
            return None
        self._own = own_tasks(path)
        world = site_at(path, *self._known)
        self.problems.extend(world.diagnostics)
        self.sources.update(world.sources)
        self._catalogue = world.catalogue
        return world.site

    def _task(self, keys: Keys, site: Site) -> Task | None:
        at = keys.text("task")
        path = self._look_up(at, at.text, "task file", "*.yaml") if at is not None else None
        return self._load(path, site) if path is not None else None

    def _load(self, path: Path, site: Site) -> Task | None:
        """Return a task of the site, or None if it has errors, which were reported."""
        loaded = load_task(path, catalogue=self._catalogue, site=site)
        self.problems.extend(problem for problem in loaded.diagnostics if problem.severity == "error")
        self.sources.update(loaded.sources)
        return loaded.task

    def _look_up(self, at: Scalar | None, name: str, what: str, pattern: str) -> Path | None:
        beside, *library = self._folders
        folders = [beside, *([self._own] if self._own is not None else []), *library]
        path = next((place / name for place in folders if name and _is_file(place / name)), None)
        if path is None:
            mark = at.mark if at is not None else Mark(self._file, 1, 1)
            files = {p.name for folder_ in folders for p in folder_.glob(pattern)}
            known = sorted(file for file in files if not file.endswith(".test.yaml"))
            text = f"no {what} '{shorten(name)}'{did_you_mean(name, known)}"
            help_ = "a path relative to this file, a file of the site's trees/, or one that ships with formiga"
            self.problems.add("E008", mark, text, help_)
        return path

    def _cases(self, keys: Keys, task: Task, site: Site) -> list[Case]:
        found: list[Case] = []
        for mapping in keys.mappings("cases", "case", such_as=""):
            case = self._case(mapping, task, site)
            if case is not None and any(case.name == other.name for other in found):
                self.problems.add("E018", case.mark, f"there is a case '{shorten(case.name)}' already")
            if case is not None:
                found.append(case)
        return found

    def _case(self, mapping: Mapping_, task: Task, site: Site) -> Case | None:
        keys = read_keys(mapping, CASE, self.problems, "a case")
        name = keys.text("name")
        with self.problems.within(shorten(name.text) if name is not None else "case"):
            now = read_now(keys, site, self._now) or self._now
            at = START if now is None else now
            book = Book(self.problems, self.sources, keys, self._catalogue, site, self._folders, at)
            agents = CaseAgents(book, task).read()
            params = self._params(book, task, keys, mapping.mark)
            answers, goals = read_rules(book, task)
            befalls = read_befalls(book, task)
            faults = sorted(befalls.faults, key=lambda fault: fault.at)
            orders = sorted([*befalls.orders, *_abort(book, task)], key=lambda order: order.at)
            results = read_results(book)
            expect = read_expect(book, task, goals)
        if name is None or expect is None:
            return None
        return Case(
            name.text, name.mark, params, tuple(agents), expect, answers, goals, tuple(faults), tuple(orders),
            tuple(befalls.during), results, now, keys.number("limit"),
        )  # fmt: skip

    def _params(self, book: Book, task: Task, keys: Keys, mark: Mark) -> dict[str, Any]:
        written, whole = written_params(book, task, keys, mark)
        at = keys.text("profile")
        if at is not None:
            path = profile_file(at.text, self._folders[:1])
            if path is None:
                self.problems.add("E010", at.mark, unknown_profile(at.text, self._folders[:1]))
                return {}
            loaded = load_profile(path)
            self.problems.extend(loaded.diagnostics)
            self.sources.update(loaded.sources)
            if loaded.profile is not None:
                written = loaded.profile.filled(task, written, mark)
        return read_params(book, task, written, mark, whole=whole)


def _abort(book: Book, task: Task) -> list[ScenarioOrder]:
    if "abort_at" not in book.keys:
        return []
    return [ScenarioOrder(micros(book.keys.number("abort_at")), "abort", task.name, "task")]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
