"""Task files to checked models: the door of `lang`.

`load_task` reads a file and all it imports, checks everything, and returns a `model.Task`, or None with every problem
located. Called by `formiga check`, the engine's front, the simulator and tests. `load_catalogue` and `load_site` are
re-exported, so that a caller needs this module only.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

from msgspec import Struct, field
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.base.packaged import folder
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.body import Body
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.checks.whole import check_task
from formiga_bt.lang.covered import covered_by_task
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.files import Shelf, Unit, read_file
from formiga_bt.lang.flow import Flow, NamedValue
from formiga_bt.lang.model import Catalogue, Role, Site, Step, Subtree, Task
from formiga_bt.lang.params import read_params
from formiga_bt.lang.records import ABORT
from formiga_bt.lang.request.aliases import TASK_NAME, read_task_aliases
from formiga_bt.lang.request.neighbours import Neighbours
from formiga_bt.lang.site import load_site
from formiga_bt.lang.site.envelope import check_task as check_tightens
from formiga_bt.lang.site.envelope import read_envelope
from formiga_bt.lang.steps.retries import read_bound
from formiga_bt.lang.steps.roles import read_roles, read_vars
from formiga_bt.lang.steps.step import read_steps
from formiga_bt.lang.subtrees import Subtrees
from formiga_bt.lang.text.document import Entry, Node
from formiga_bt.lang.text.reading import Problems, read_flag, read_text, read_word, shorten, why_unreadable
from formiga_bt.lang.types import not_held
from formiga_bt.lang.walk import size
from formiga_bt.lang.world import World, agent_types_of
from formiga_bt.lang.written import saves, writes

__all__ = ["Loaded", "bundle_hash", "load_catalogue", "load_library_text", "load_site", "load_task", "load_task_text"]

_MOST_STEPS: Final = 20_000
_SECTIONS: Final = ("steps", "on_failure", "on_abort", "finally")


class Loaded(Struct, frozen=True):
    """What became of a task file."""

    task: Task | None
    """None if there is any error."""
    diagnostics: list[Diagnostic]
    """All problems, in file order."""
    sources: Mapping[str, str] = field(default_factory=dict)
    """Text by file name, for `diagnostics.render`."""


def load_task(
    path: Path,
    *,
    catalogue: Catalogue,
    site: Site | None = None,
    library: Sequence[Path] | None = None,
) -> Loaded:
    """Read and check a task file.

    Args:
        path: of the file; its folder is where imports are looked up first.
        catalogue: the agent types and actions that the task may use.
        site: the site it is to run on; without one, checks that need a site are silent.
        library: the folders where imports are looked up after the libraries of the site; None = the packaged trees.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        problem = Diagnostic("E008", Mark(str(path), 1, 1), f"the file cannot be read: {why_unreadable(error)}")
        return Loaded(None, [problem])
    except UnicodeDecodeError:
        return Loaded(
            None, [Diagnostic("E001", Mark(str(path), 1, 1), "the file is not UTF-8 text", "save it as UTF-8")]
        )
    return load_task_text(text, str(path), catalogue=catalogue, site=site, library=library, folder_=path.parent)


def load_task_text(
    text: str,
    file: str,
    *,
    catalogue: Catalogue,
    site: Site | None = None,
    library: Sequence[Path] | None = None,
    folder_: Path | None = None,
    read: Callable[[Path], str] = read_file,
    watch: Callable[[Mark, Scope], None] | None = None,
    others: Mapping[str, str] | None = None,
    labels: Mapping[int, str] | None = None,
    libraries: Sequence[Path] | None = None,
) -> Loaded:
    """Read and check a task's text.

    Args:
        text: of the file.
        file: its name in marks.
        catalogue: see `load_task`; so are `site` and `library`.
        site: see there.
        library: see there.
        folder_: where imports are looked up first.
        read: gives the text of an import.
        watch: is told what is visible at each step.
        others: texts of tasks that it may request, by name, besides those of its folder and of the library.
        labels: how messages call its lines, if not by number.
        libraries: the folders of the site's own libraries; None = as the catalogue says.
    """
    problems = Problems()
    own = catalogue.libraries if libraries is None else libraries
    shelf = Shelf((folder("trees"),) if library is None else library, problems, read, own)
    unit = shelf.open_text(text, file, folder_, library=False, labels=labels)
    neighbours = Neighbours(folder_, shelf.library, read, others, own)
    world = World(catalogue, site, watch, neighbours)
    task = _TaskReader(world, problems, shelf, unit).read() if unit.root is not None else None
    found = in_order(problems.found)
    if any(d.severity == "error" for d in found):
        task = None
    return Loaded(task, found, dict(shelf.sources))


def load_library_text(
    text: str,
    file: str,
    *,
    catalogue: Catalogue,
    site: Site | None = None,
    library: Sequence[Path] | None = None,
    folder_: Path | None = None,
    read: Callable[[Path], str] = read_file,
    watch: Callable[[Mark, Scope], None] | None = None,
) -> Loaded:
    """Check the text of a library of subtrees by itself, as each task that imports it would; arguments as for a task."""
    problems = Problems()
    shelf = Shelf((folder("trees"),) if library is None else library, problems, read, catalogue.libraries)
    unit = shelf.open_text(text, file, folder_, library=True)
    world = World(catalogue, site, watch, Neighbours(folder_, shelf.library, read, own=shelf.own))
    subtrees = Subtrees(world, problems)
    for one in shelf.units.values():
        subtrees.world_of(one)
        subtrees.read_all(one)
    for at, imported in unit.imports:
        if imported.file not in unit.called:
            problems.unused(at.mark, "import", at.text)
    return Loaded(None, in_order(problems.found), dict(shelf.sources))


def texts_of_bundle(sources: Mapping[str, str], file: str) -> list[str]:
    """Return a task's text, and its imports in the order of reading."""
    return [sources[file], *(text for name, text in sources.items() if name != file)]


def bundle_hash(sources: Mapping[str, str], file: str, catalogue: Catalogue) -> str:
    """Return the SHA-256 (hex) of a task's text, its imports in the order of reading, and the catalogue."""
    digest = hashlib.sha256()
    for text in (*texts_of_bundle(sources, file), catalogue.digest):
        data = text.encode("utf-8", "surrogatepass")
        digest.update(str(len(data)).encode() + b":" + data)
    return digest.hexdigest()


class _TaskReader:
    """Reads the keys of one task file into a `Task`."""

    def __init__(self, world: World, problems: Problems, shelf: Shelf, unit: Unit) -> None:
        self.problems = problems
        self.shelf = shelf
        self.unit = unit
        self.subtrees = Subtrees(world, problems)
        self.world = self.subtrees.world_of(unit)
        self.body = Body(self.world, problems, lambda at: self.subtrees.resolve(unit, at))

    def read(self) -> Task | None:
        """Return the task, or None if it has no readable name."""
        for unit in self.shelf.units.values():
            self.subtrees.read_all(unit)
        name = self._name()
        with self.problems.within(name or "task"):
            parts = self._read_parts()
            task = self._task(name, parts)
            if "steps" in self.unit.keys:
                self._report_unused()
            self._check_requests(name)
            if not self.body.dropped and not self.subtrees.dropped and name and "steps" in self.unit.keys:
                self._check(task)
        return task if name else None

    def _check(self, task: Task) -> None:
        """Run the checks of the whole task, unless its calls multiply beyond what can be run."""
        known: dict[Mark, int] = {}
        steps = sum(size(part, known) for part in (task.steps, task.on_failure, task.on_abort, task.finally_))
        most = max((steps, *known.values()))
        if most > _MOST_STEPS:
            what = f"with all calls written out this has {most} steps"
            self.problems.add("E003", task.mark, what, f"at most {_MOST_STEPS}; use a loop, or call less deep")
        else:
            check_task(task, self.world.catalogue, self.problems, self.world.site)

    def _check_requests(self, name: str) -> None:
        """Report E051 for a task that comes back to itself by what it requests."""
        others = self.world.others
        through = others.through(name) if others is not None and name else []
        if others is None or not through:
            return
        first = next(one for one in others.asked if one in through)
        way = f" through {' and '.join(through[:-1])}" if through[:-1] else ""
        self.problems.add("E051", others.asked[first].mark, f"{name} requests itself{way}", "tasks cannot be recursive")

    def _name(self) -> str:
        entry = self.unit.keys.get("task")
        at = read_text(entry.value, self.problems, "task") if entry is not None else None
        if at is None or TASK_NAME.fullmatch(at.text):
            return at.text if at is not None else ""
        self.problems.add(
            "E008", at.mark, f"a task's name is CamelCase, this is '{shorten(at.text)}'", "such as: PickUp"
        )
        return ""

    def _read_parts(self) -> dict[str, Any]:
        keys, body = self.unit.keys, self.body
        parts: dict[str, Any] = {}
        params = read_params(keys["params"].value, self.world, self.problems) if "params" in keys else {}
        for param in params.values():
            named = NamedValue(not_held(param.type), param.mark, "param")
            body.define(param.name, named, param.optional and param.default is None)
        body.agents = agent_types_of(params)
        parts["params"] = params
        roles_node = keys["agents"].value if "agents" in keys else None
        before = len(self.problems.found)
        parts["vars"] = read_vars(body, keys["vars"].value) if "vars" in keys else {}
        with self.problems.within("agents"):
            roles = read_roles(body, roles_node) if roles_node is not None else {}
        if self.problems.has_errors(before):
            for entry in [keys[key] for key in ("vars", "agents") if key in keys]:
                body.count(entry.value)
        if "envelope" in keys:
            parts["envelope"] = self._envelope(keys["envelope"].value, roles)
            body.tightened = parts["envelope"]
        for key in ("timeout", "expires", "cleanup_timeout"):
            if key in keys:
                parts[key] = read_bound(body, keys[key].value, key)
        parts.update(self._sections(keys))
        parts["roles"] = roles
        return parts

    def _envelope(self, node: Node, roles: Mapping[str, Role]) -> dict[str, float]:
        """Read what the task tightens; nothing may be looser than its machines' types, or the site, have it."""
        limits = read_envelope(node, self.problems)
        known = self.world.catalogue.types
        names = dict.fromkeys(name for role in roles.values() for name in role.types if name in known)
        machines = [known[name] for name in names if not known[name].human]
        site = self.world.site
        check_tightens(limits, machines, site.envelope if site is not None else {}, self.problems)
        top = limits.get("max_height")
        if top is not None and site is not None and machines and top.value < min(site.layers_m, default=0.0):
            lowest = format_quantity("distance", min(site.layers_m))
            what = f"max_height {top.shown} is below the lowest layer of the site, {lowest}"
            self.problems.add("E061", top.mark, what, "drones cross in the site's layers; raise max_height")
        return {limit.key: limit.value for limit in limits.values()}

    def _sections(self, keys: Mapping[str, Entry]) -> dict[str, tuple[Step, ...]]:
        """Read the four lists of steps: the cleanup sections know that anything may or may not have run."""
        body = self.body
        for section in _SECTIONS:
            if section in keys:
                node = keys[section].value
                body.later.update({at.text: at.mark for at in saves(node)})
                body.lengths = {name: n for name, n in body.lengths.items() if name not in writes(node)}
        found: dict[str, tuple[Step, ...]] = {}
        start = body.flow.copy()
        ends: list[Flow] = []
        for section in _SECTIONS:
            if section not in keys:
                continue
            saved = {name: named for end in ends for name, named in end.saved.items()}
            taken = ends[0].taken if section.startswith("on_") and ends else frozenset(saved)
            released = {name: mark for end in ends for name, mark in end.released.items()}
            body.flow = Flow(saved, start.sure, taken, released=released)
            with self.problems.within(section), self._seeing(section, found):
                steps = read_steps(body, keys[section].value, section, section)
            ends.append(body.flow)
            found["finally_" if section == "finally" else section] = steps
        return found

    def _seeing(self, section: str, read: Mapping[str, tuple[Step, ...]]) -> AbstractContextManager[None]:
        """Make visible what a section sees besides the names of the task."""
        if section == "on_failure":
            return self.body.with_error(read.get("steps", ()))
        return self.body.with_names({"abort": ABORT} if section == "on_abort" else {})

    def _task(self, name: str, parts: dict[str, Any]) -> Task:
        keys = self.unit.keys
        ordered = self.body.needs
        roles = {one: replace(role, actions=tuple(ordered.get(one, ()))) for one, role in parts.pop("roles").items()}
        mark = keys["task"].key.mark if "task" in keys else Mark(self.unit.file, 1, 1)
        task = Task(
            name,
            mark,
            parts.pop("steps", ()),
            aliases=read_task_aliases(keys["aliases"], name, self.problems) if "aliases" in keys else (),
            version=self._plain("version"),
            description=self._plain("description"),
            **self._options(),
            **parts,
            roles=roles,
            records=self.world.records,
            subtrees=self._visible_subtrees(),
            bundle=bundle_hash(self.shelf.sources, self.unit.file, self.world.catalogue),
            files=tuple(self.shelf.sources),
            requests={one: others.path(one) for one in others.asked}
            if (others := self.world.others) is not None
            else {},
        )
        texts = texts_of_bundle(self.shelf.sources, self.unit.file)
        return replace(task, covered=covered_by_task(task, texts, self.world.catalogue))

    def _options(self) -> dict[str, Any]:
        keys = self.unit.keys
        options: dict[str, Any] = {"preemptible": True}
        if "priority" in keys:
            options["priority"] = read_word(
                keys["priority"].value, self.problems, "priority", ("low", "medium", "high")
            )
            options["priority"] = options["priority"] or "medium"
            options["preemptible"] = options["priority"] != "high"
        if "if_preempted" in keys:
            word = read_word(keys["if_preempted"].value, self.problems, "if_preempted", ("restart", "fail"))
            options["if_preempted"] = word or "restart"
        if "preemptible" in keys:
            options["preemptible"] = read_flag(keys["preemptible"].value, self.problems, "preemptible")
        return options

    def _plain(self, key: str) -> str:
        entry = self.unit.keys.get(key)
        at = read_text(entry.value, self.problems, key) if entry is not None else None
        return at.text if at is not None else ""

    def _visible_subtrees(self) -> dict[str, Subtree]:
        found: dict[str, Subtree] = {}
        for unit in (self.unit, *(unit for _, unit in self.unit.imports)):
            for name in unit.own:
                callee = self.subtrees.callee(unit, name)
                if callee is not None:
                    found.setdefault(name, callee.subtree)
        return found

    def _report_unused(self) -> None:
        body, unit = self.body, self.unit
        for entry in unit.root.entries if unit.root is not None else ():
            if entry.key.text not in unit.keys:  # it is unknown, and refused
                body.count(entry.value)
        body.report_unread()
        for name, named in body.names.items():
            if name not in body.used:
                self.problems.unused(named.mark, named.origin, name)
        words = body.used | self.subtrees.words
        for name, entry in unit.own.items():
            if (unit.file, name) not in self.subtrees.called and name not in words:
                self.problems.unused(entry.key.mark, "subtree", name)
        for one in self.shelf.units.values():
            for at, imported in one.imports:
                if imported.file not in one.called and words.isdisjoint(imported.own):
                    self.problems.unused(at.mark, "import", at.text)
