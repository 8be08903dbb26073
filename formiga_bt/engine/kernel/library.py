"""Which tasks an engine serves, in which versions.

A version is a *bundle*: the hash of a task's file, its imports and the catalogue. The state names bundles only; the checked
models lie in `Bundles`, which whoever drives the engine fills before it tells the engine to serve one (`inputs.Serve`).

| who asks for a task by its name | gets |
|---|---|
| a person | the newest version, or the one whose bundle is named |
| a step of a task | the version that was the newest when a person requested the first task of the family |
| a run that begins anew | the version of the run before |
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Serve, Submit
from formiga_bt.engine.kernel.records import TaskRecord, Version
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.model import Task
from formiga_bt.safety.drafted import merged

TYPED: Final = 8
"""So many characters of a bundle are shown."""


class Bundles(Mapping[str, Task]):
    """Checked tasks: as a mapping, by name, those for new requests; and every version that was ever added.

    One thread adds while others read.
    """

    def __init__(self, tasks: Mapping[str, Task] | Iterable[Task] = ()) -> None:
        made = list(tasks.values() if isinstance(tasks, Mapping) else tasks)
        self._kept: dict[tuple[str, str], Task] = {(task.name, task.bundle): task for task in made}
        self._newest: dict[str, Task] = {task.name: task for task in made}

    def __getitem__(self, name: str) -> Task:
        return self._newest[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._newest)

    def __len__(self) -> int:
        return len(self._newest)

    def add(self, task: Task) -> None:
        """Keep a version; nobody gets it before it is served."""
        self._kept[task.name, task.bundle] = task

    def serve(self, task: Task) -> None:
        """Let the mapping hand out this version."""
        self.add(task)
        self._newest = {**self._newest, task.name: task}  # who reads the old one goes on with it

    def version(self, name: str, bundle: str) -> Task | None:
        """Return a version of a task, or None if it was never added."""
        return self._kept.get((name, bundle))

    @property
    def count(self) -> int:
        """Return how many versions of all tasks there are."""
        return len(self._kept)

    def versions(self, name: str) -> Sequence[Task]:
        """Return all versions of a task, in the order in which they were first added."""
        return [task for (one, _), task in list(self._kept.items()) if one == name]


def model_of(models: Mapping[str, Task], task: TaskRecord) -> Task | None:
    """Return the model that a task runs: of its own bundle where `models` keeps versions, else by its name."""
    return models.version(task.name, task.request.bundle) if isinstance(models, Bundles) else models.get(task.name)


def newest_of(state: EngineState, name: str) -> Version | None:
    """Return the newest version of a task of which another was served before; None: there is one only."""
    versions = state.library.get(name, ())
    return versions[-1] if versions and versions[-1].n > 1 else None


class Library:
    """Reads `state.library`; `serve` says what it becomes.

    Args:
        state: of the engine.
        first: the tasks that are served from the start.
        kept: every model that a bundle may name.
    """

    def __init__(self, state: EngineState, first: Mapping[str, Task], kept: Bundles) -> None:
        self._state = state
        self._first = dict(first)
        self._kept = kept

    def names(self) -> list[str]:
        """Return the names that can be requested."""
        return sorted({*self._first, *self._state.library})

    def of(self, task: TaskRecord) -> Task | None:
        """Return the model that a task runs; None for a system task."""
        return self._kept.version(task.name, task.request.bundle)

    def wanted(self, request: Submit) -> Task:
        """Return what a request asks for.

        Raises:
            TaskError: `unknown_task`, or `not_served` for a bundle under which it never was.
        """
        versions = self._versions(request.task)
        if not versions:
            raise TaskError("unknown_task", f"there is no task '{request.task}'; tasks: {', '.join(self.names())}")
        bundle = request.bundle or versions[-1].bundle
        model = self._kept.version(request.task, bundle)
        if model is None or all(one.bundle != bundle for one in versions):
            raise TaskError("not_served", f"{request.task} is not served as {bundle[:TYPED]}")
        return model

    def kept(self, name: str) -> Sequence[Task]:
        """Return every model of a name that was ever added."""
        return self._kept.versions(name)

    def number(self, model: Task) -> int:
        """Return which version of its name a model is, from 1."""
        return next((one.n for one in reversed(self._versions(model.name)) if one.bundle == model.bundle), 1)

    def bundle_for(self, name: str, parent: TaskRecord) -> str:
        """Return the version of a task that another one requests: the newest at the time of the family's first request.

        If there was none then: the oldest that came later. "" = there is none at all.
        """
        versions = self._versions(name)
        then = [one for one in versions if one.order <= parent.request.library]
        return then[-1].bundle if then else versions[0].bundle if versions else ""

    def serve(self, given: Serve, open_: Iterable[str]) -> list[ch.Change]:
        """Return what changes when a version is served to new requests; nothing if it is already.

        Versions that neither a new request nor an open task can ask for any more are forgotten.

        Args:
            given: the version.
            open_: ids of the tasks that have not ended.

        Raises:
            TaskError: `unknown_bundle`: its model was not added first.
        """
        if self._kept.version(given.task, given.bundle) is None:
            raise TaskError("unknown_bundle", f"there is no model of {given.task} {given.bundle[:TYPED]}")
        known = self._state.drafted.get(given.bundle)
        told = merged((known, given.drafted))
        wrote: list[ch.Change] = [ch.DraftedPut(given.bundle, told)] if told is not None and told != known else []
        versions = self._versions(given.task)
        if versions and versions[-1].bundle == given.bundle:
            return wrote
        order = self._state.counters.get("library", 0) + 1
        n = versions[-1].n + 1 if versions else 1
        eldest = min((self._state.tasks[one].request.library for one in open_), default=order)
        still = next((at for at in reversed(range(len(versions))) if versions[at].order <= eldest), 0)
        kept = (*versions[still:], Version(order, n, given.bundle))
        return [*wrote, ch.CounterSet("library", order), ch.LibraryPut(given.task, kept)]

    def _versions(self, name: str) -> tuple[Version, ...]:
        first = self._first.get(name)
        base = (Version(0, 1, first.bundle),) if first is not None else ()
        return self._state.library.get(name) or base
