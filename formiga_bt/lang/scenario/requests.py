"""Reads the tasks of a scenario: when, which, with which values. Tasks are looked up by name and checked."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from formiga_bt.base.clock import micros
from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Param, Task
from formiga_bt.lang.request.aliases import by_alias, degrees_of, names_in
from formiga_bt.lang.request.binding import half_a_place
from formiga_bt.lang.request.requested import with_requested
from formiga_bt.lang.request.value_files import entries_of, read_params_from
from formiga_bt.lang.scenario.book import Book
from formiga_bt.lang.scenario.entries import Priority, ScenarioTask
from formiga_bt.lang.scenario.options import TASK
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, plain, quoted_list, read_mapping, shorten
from formiga_bt.lang.text.synonyms import surely


class RequestReader:
    """Reads the tasks of one scenario; `tasks` are those it names and those they request, by name (None: one with errors).

    Args:
        book: the scenario.
        own: the folder of the site's own tasks, which is searched with all below it.
    """

    def __init__(self, book: Book, own: Path | None = None) -> None:
        self.book = book
        self._own = own
        self.problems = book.problems
        self.tasks: dict[str, Task | None] = {}
        self._files: dict[str, Path] | None = None
        self._asked: dict[str, Scalar] = {}
        """Where the scenario names them first."""
        self._names: dict[str, str] = {}
        """Aliases of tasks -> their names."""

    def read(self) -> list[ScenarioTask]:
        """Read all of them."""
        found = []
        for mapping in self.book.keys.mappings("tasks", "task"):
            keys = read_keys(mapping, TASK, self.problems, "a task")
            name, at, priority = keys.name("task"), micros(keys.number("at")), keys.word("priority")
            task = self._task(name) if name is not None else None
            if name is None or task is None:
                continue
            with self.problems.within(task.name):
                written, whole = written_params(self.book, task, keys, name.mark)
                params = read_params(self.book, task, written, name.mark, whole=whole)
            wanted: dict[str, Priority] = {"low": "low", "medium": "medium", "high": "high"}
            texts = plain(written) if written is not None else {}
            wait, expires = (micros(keys.number(key)) if key in keys else None for key in ("wait", "expires"))
            found.append(ScenarioTask(at, task.name, params, wanted.get(priority), texts, wait, expires))
        for own, name in self._asked.items():
            self._add_requested(self.tasks[own], name)
        self._add_of_rules()
        return found

    def _add_of_rules(self) -> None:
        """Add what the standing rules of the site request."""
        for rule in self.book.site.rules.values():
            if rule.task not in self.tasks and rule.file:
                at = Scalar(rule.task, rule.mark)
                self.tasks[rule.task] = task = self._load(Path(rule.file), at)
                self._add_requested(task, at)

    def _add_requested(self, task: Task | None, name: Scalar) -> None:
        """Add what a task requests; of two with one name the scenario's own counts."""
        for one in with_requested(task, lambda path: self._load(path, name))[1:] if task is not None else ():
            self.tasks.setdefault(one.name, one)

    def _task(self, name: Scalar) -> Task | None:
        files = self._task_files()
        own = self._names.get(name.text, name.text)
        if own in self.tasks:
            return self.tasks[own]
        if name.text not in files:
            what = f"no task is called '{shorten(name.text)}'{did_you_mean(name.text, files)}"
            meant = surely(name.text, files)
            self.problems.add("E010", name.mark, what, f"tasks: {quoted_list(sorted(files))}", fix_word(name, meant))
            return None
        self._asked[own] = name
        self.tasks[own] = self._load(files[name.text], name, name.text)
        return self.tasks[own]

    def _load(self, path: Path, name: Scalar, called: str = "") -> Task | None:
        """Return the task of a file, or None if it has errors, which are reported; `name` is where the scenario asks for it."""
        loaded = load_task(path, catalogue=self.book.catalogue, site=self.book.site)
        errors = [problem for problem in loaded.diagnostics if problem.severity == "error"]
        if errors and errors[0] not in self.problems.found:
            who = called or f"a task that {name.text} requests"
            self.problems.add("E010", name.mark, f"{who} has errors ({path})", "fix the task first")
            self.problems.extend(errors)
            self.book.sources.update(loaded.sources)
        return loaded.task

    def _task_files(self) -> dict[str, Path]:
        """Return the task files beside the scenario, of the site and of the library, by their tasks' names.

        Of two with one name the first counts.
        """
        if self._files is None:
            self._files = {}
            others: list[tuple[str, str, Path]] = []
            beside, *library = self.book.folders
            own = sorted(self._own.rglob("*.yaml")) if self._own is not None else []
            below = (p for place in library for p in sorted(place.glob("*.yaml")))
            for path in (*sorted(beside.glob("*.yaml")), *own, *below):
                if path.name.endswith(".test.yaml"):
                    continue  # it names its task too
                try:
                    names = names_in(path.read_text(encoding="utf-8"))
                except (OSError, UnicodeDecodeError):
                    continue
                for name in names[:1]:
                    self._files.setdefault(name, path)
                others += [(alias, names[0], path) for alias in names[1:]]
            for alias, name, path in others:
                if alias not in self._files:
                    self._files[alias], self._names[alias] = path, name
        return self._files


def written_params(book: Book, task: Task, keys: Keys, mark: Mark) -> tuple[Mapping_ | None, bool]:
    """Return what is written under `params` with what the files of `params_from` say, and whether all of it could be read.

    Args:
        book: of the file in which they are written.
        task: whose parameters.
        keys: of the mapping in which they stand.
        mark: of that mapping.
    """
    mapping = read_mapping(keys["params"].value, book.problems, "params") if "params" in keys else None
    if "params_from" not in keys:
        return mapping, True
    at, before = keys["params_from"].value, len(book.problems.found)
    files = read_params_from(at, Path(at.mark.file).parent, book.problems)
    book.sources.update({one.file: one.text for one in files})
    more = entries_of(files, by_alias(task.params), book.problems)
    entries = (*(mapping.entries if mapping is not None else ()), *more)
    return Mapping_(entries, mapping.mark if mapping else mark), not book.problems.has_errors(before)


def read_params(book: Book, task: Task, mapping: Mapping_ | None, mark: Mark, *, whole: bool = True) -> dict[str, Any]:
    """Return the runtime values of a task's parameters, by their names; what is wrong was reported.

    Args:
        book: of the file in which they are written.
        task: whose parameters.
        mapping: as they are written, if any are.
        mark: where one is missing.
        whole: whether that is all that is given; else nobody knows what is missing.
    """
    by_name = by_alias(task.params)
    values: dict[str, Any] = {}
    given: dict[str, str] = {}
    for one in _with_places(book, task, mapping.entries, by_name, given) if mapping is not None else ():
        param = by_name.get(one.key.text)
        if param is None:
            meant = surely(one.key.text, by_name)
            what = f"{task.name} has no parameter '{shorten(one.key.text)}'{did_you_mean(one.key.text, by_name)}"
            help_ = f"parameters: {quoted_list(task.params) or 'none'}"
            book.problems.add("E010", one.key.mark, what, help_, fix_word(one.key, meant))
            given[meant] = one.key.text
            continue
        if param.name in given:
            first = given[param.name]
            what = f"'{one.key.text}' and '{first}' are the same parameter"
            what = what if first != one.key.text else f"'{first}' is given twice"
            book.problems.add("E018", one.key.mark, what, "remove one")
            continue
        given[param.name] = one.key.text
        value = book.value(one.value, param)
        if value is not None:
            values[param.name] = value
    for param in task.params.values():
        if whole and param.name not in given and param.default is None and not param.optional:
            what = f"{task.name} needs the parameter '{param.name}' ({param.type})"
            book.problems.add("E051", mark, what, f"params: {{{param.name}: ...}}")
    return values


def _with_places(
    book: Book, task: Task, entries: Sequence[Entry], by_name: dict[str, Param], given: dict[str, str]
) -> list[Entry]:
    """Return the entries with one place instead of its latitude and longitude, where these are given apart.

    Its name, such as `lat and lng`, is added to `by_name`; half a place is reported and counts as given.
    """
    by_key = {entry.key.text: entry for entry in entries}
    places: dict[str, list[Entry]] = {}
    for one in degrees_of(task.params, list(by_key)):
        lat, lng = one.names
        at = by_key[lat]
        key = Scalar(f"{lat} and {lng}", at.key.mark)
        if lng:
            pair = (Entry(Scalar("lat", at.key.mark), at.value), Entry(Scalar("lng", at.key.mark), by_key[lng].value))
            by_name[key.text] = one.param
            places[lat], places[lng] = [Entry(key, Mapping_(pair, at.value.mark))], []
        else:
            said = half_a_place(lat, one.param)
            book.problems.add("E051", at.key.mark, said.message, said.help)
            places[lat] = []
            given[one.param.name] = lat
    return [found for entry in entries for found in places.get(entry.key.text, [entry])]
