"""New and changed tasks for an engine that runs: checked here with the engine's own catalogue and site, kept, then served.

What a caller sends is texts, nothing else: what they mean is read from them here, and imports come from the bundle itself or
from what ships with formiga_bt. Loading starts nothing, and on a site in mode real what is loaded flies only once approved.
"""

import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.base.errors import JournalError, SiteError
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import Input, Serve
from formiga_bt.engine.kernel.library import Bundles, newest_of
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.loader import Loaded, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.safety.drafted import Drafted, merged, said_in
from formiga_bt.services.kept import drafted
from formiga_bt.services.kept.bundles import BundleStore, Stored
from formiga_bt.services.kept.drafted import known_below, who_drafted
from formiga_bt.services.members import with_members
from formiga_bt.services.not_served import NotServed
from formiga_bt.services.refused import Refused
from formiga_bt.services.replies import shown
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import LibraryList, LibraryTask, TaskLoaded, VersionFact

MOST_FILES: Final = 100
"""In one bundle."""
MOST_VERSIONS: Final = 1000
"""Versions that one engine keeps, until it is started anew."""


class Loading:
    """Takes bundles, and tells what is served.

    Args:
        ask: hands an input to the engine and waits for its reply; raises `Refused`.
        view: the engine's read-only copy.
        site, catalogue: what tasks are checked against.
        bundles: the tasks that the engine serves; filled here.
        store: where bundles are kept.
    """

    def __init__(
        self,
        ask: Callable[[Input], object],
        view: EngineView,
        site: Site,
        catalogue: Catalogue,
        bundles: Bundles,
        store: BundleStore,
    ) -> None:
        self._ask = ask
        self._view = view
        self._site = site
        self._catalogue = catalogue
        self._bundles = bundles
        self._store = store
        self._lock = threading.Lock()
        self._runtime = store.path.parent
        self._beside = self._runtime.parent.parent
        self._texts = texts_of(bundles.values())
        self._mended: set[str] = set()
        """Tasks that were loaded since the start: whatever file of theirs was refused then, they are served now."""
        self.closed_for: Callable[[], str] = str
        """Tells why nothing is taken any more, or empty."""
        self.keep: Callable[[Task, str, Mapping[str, str]], None] = lambda *_: None
        """Keeps the files of a task in the journal; raises `JournalError`."""

    @property
    def is_real(self) -> bool:
        """Return whether it is an engine in mode real."""
        return self._site.mode == "real"

    def first(self) -> list[Serve]:
        """Return what the engine is told at its start: which of the tasks that it serves a model wrote.

        Raises:
            SiteError: what the site's folder knows cannot be read.
        """
        known = known_below(self._beside)
        wrote = [(one, who_drafted(one, known, drafted.texts_of(one))) for one in self._bundles.values()]
        return [Serve(task.name, task.bundle, "", who) for task, who in wrote if who is not None]

    def load(
        self, file: str, texts: Mapping[str, str], by: str, unix_millis: int, told: Drafted | None = None
    ) -> TaskLoaded:
        """Check a bundle, and serve it to new requests. One that is served already changes nothing.

        Args:
            file: which of the texts is the task.
            texts: by path below the site's folder.
            by: who loads it.
            unix_millis: when.
            told: a model wrote it, as the caller's own folder knows. It is believed, and kept.

        Raises:
            Refused: the bundle is no such thing, has errors, or cannot be kept.
        """
        _check_paths(file, texts)
        with self._lock:
            if self.closed_for():
                raise Refused(
                    "closed", f"nothing is loaded: the engine is {self.closed_for()}", "formiga up starts it again"
                )
            try:
                stored, is_new = self._store.keep(file, texts, by=by, unix_millis=unix_millis)
            except SiteError as error:
                raise Refused("not_kept", str(error)) from error
            loaded = read_stored(stored, self._site_now(), self._catalogue, self._texts)
            if loaded.task is None:
                if is_new:
                    self._store.drop(stored)
                raise _bad(file, loaded, stored)
            try:
                wrote = self._wrote(loaded, told, unix_millis)
                self.keep(loaded.task, file, loaded.sources)
            except (SiteError, JournalError) as error:
                raise Refused("not_kept", str(error)) from error
            given = Serve(loaded.task.name, loaded.task.bundle, by, wrote)
            return self._serve(loaded.task, stored, given, _warnings(loaded, stored), is_new=is_new)

    def _site_now(self) -> Site:
        with self._view.reading() as state:
            return with_members(self._site, dict(state.members))

    def _wrote(self, loaded: Loaded, told: Drafted | None, unix_millis: int) -> Drafted | None:
        """Return who had a model write a task; what comes in with it is written down, so that a bare copy is known too."""
        assert loaded.task is not None
        said = merged((told, *map(said_in, loaded.sources.values())))
        if said is not None:
            drafted.note(self._runtime, [loaded.task], said, unix_millis=unix_millis)
        return merged((who_drafted(loaded.task, known_below(self._beside), ()), said))

    def _serve(self, task: Task, stored: Stored, given: Serve, warnings: list[str], *, is_new: bool) -> TaskLoaded:
        before = self._bundles.get(task.name)
        if before is not None and before.bundle == task.bundle:
            if is_new:
                self._store.drop(stored)
            with self._view.reading() as state:
                is_news = given.drafted is not None and merged(
                    (state.drafted.get(task.bundle), given.drafted)
                ) != state.drafted.get(task.bundle)
            if is_news:
                self._ask(given)
            return self._said(task, "same", f"{task.name} is served as it is", warnings)
        if self._bundles.count >= MOST_VERSIONS:
            raise Refused(
                "too_many_versions",
                f"{MOST_VERSIONS} versions of tasks were served since the engine was started",
                "start it anew: formiga down --drain, then formiga up",
            )
        if self._bundles.version(task.name, task.bundle) is None:  # an old one again keeps its marks
            self._bundles.add(task)
        self._ask(given)
        self._bundles.serve(task)
        self._mended.add(task.name)
        self._texts[task.name] = stored.text()
        with suppress(SiteError):  # it is served; only the next start would not know of it
            self._store.serve(task.name, stored)
        self._view.catch_up()
        if before is None:
            return self._said(task, "new", f"{task.name} is served now", warnings)
        with self._view.reading() as state:
            running = _running(state, task.name, task.bundle)
        keep = f"; {', '.join(running)} {'goes' if len(running) == 1 else 'go'} on with the old one" if running else ""
        n = self._number(task)
        return self._said(task, "changed", f"{task.name} is served in version {n}: new requests get it{keep}", warnings)

    def _number(self, task: Task) -> int:
        with self._view.reading() as state:
            newest = newest_of(state, task.name)
        return newest.n if newest is not None else 1

    def _said(self, task: Task, what: str, text: str, warnings: list[str]) -> TaskLoaded:
        return TaskLoaded(
            task=task.name, bundle=task.bundle, version=self._number(task), what=what, text=text, warnings=tuple(warnings),  # type: ignore[arg-type]
        )  # fmt: skip

    def library(self, refused: Iterable[NotServed] = ()) -> LibraryList:
        """Return the tasks that can be requested, with their versions, and which of the refused files are so still."""
        with self._view.reading() as state:
            tasks = tuple(self._library_task(state, self._bundles[name]) for name in sorted(self._bundles))
        still = tuple(one.text for one in refused if self._mended.isdisjoint(one.names))
        return LibraryList(tasks, still)

    def _library_task(self, state: EngineState, task: Task) -> LibraryTask:
        known = [(one.n, one.bundle) for one in state.library.get(task.name, ())] or [(1, task.bundle)]
        return shown.library_task(
            task, tuple(VersionFact(n, bundle, _with(state, task.name, bundle)) for n, bundle in known)
        )


def _with(state: EngineState, name: str, bundle: str) -> tuple[str, ...]:
    return tuple(
        t.id for t in state.tasks.values() if t.section != "done" and (t.name, t.request.bundle) == (name, bundle)
    )


def _running(state: EngineState, name: str, newest: str) -> list[str]:
    tasks = state.tasks.values()
    return [
        t.id for t in tasks if t.section != "done" and t.name == name and t.request.bundle not in (newest, "system")
    ]


# -- reading -----------------------------------------------------------------------------------------------------------
def read_stored(stored: Stored, site: Site, catalogue: Catalogue, others: Mapping[str, str]) -> Loaded:
    """Read and check a bundle; `others`: the texts of tasks that it may request, by name."""
    library = folder("trees").resolve()

    def read(path: Path) -> str:
        if path.resolve().is_relative_to(library):
            return path.read_text(encoding="utf-8")
        return stored.read(path)

    beside = Path(site.file).parent
    libraries = [stored.folder / one.relative_to(beside) for one in catalogue.libraries]
    return load_task_text(
        stored.text(), stored.bundle.file, catalogue=catalogue, site=site,
        folder_=stored.task_file.parent, read=read, others=others, libraries=libraries,
    )  # fmt: skip


def texts_of(tasks: Iterable[Task]) -> dict[str, str]:
    """Return the texts of tasks by name, as far as their files can be read."""
    found = {}
    for task in tasks:
        with suppress(OSError, UnicodeDecodeError):
            found[task.name] = Path(task.mark.file).read_text(encoding="utf-8")
    return found


def served_again(
    store: BundleStore, tasks: Mapping[str, Task], site: Site, catalogue: Catalogue
) -> tuple[dict[str, Task], list[str]]:
    """Return what a new start of the engine serves besides its task files, and what people should know of it, in sentences.

    A task that has a file is served as the file is now; what was loaded under its name is forgotten.
    """
    found: dict[str, Task] = {}
    told: list[str] = []
    texts = texts_of(tasks.values())
    for name, stored in store.served().items():
        loaded = read_stored(stored, site, catalogue, texts)
        task, mine = loaded.task, tasks.get(name)
        if mine is not None:
            if task is None or task.bundle != mine.bundle:
                told.append(
                    f"{name} is served as {mine.mark.file} has it now, which is not what was loaded{_when(stored)}"
                )
            with suppress(SiteError):
                store.serve(name, None)
        elif task is None:
            told.append(f"{name} was loaded{_when(stored)} and is not served again: {_first(loaded)}")
        else:
            found[name] = task
            texts[name] = stored.text()
            told.append(f"{name} is served again as it was loaded{_when(stored)}; to forget it: rm {stored.path}")
    return found, told


def _when(stored: Stored) -> str:
    if not stored.bundle.unix_millis:
        return ""
    by = f" by {stored.bundle.by}" if stored.bundle.by else ""
    return f" on {datetime.fromtimestamp(stored.bundle.unix_millis / 1000).astimezone():%Y-%m-%d %H:%M}{by}"


def _first(loaded: Loaded) -> str:
    first = next((one for one in loaded.diagnostics if one.severity == "error"), None)
    return f"{first.mark}: {first.code}: {first.message}" if first is not None else "it is no task"


# -- what is refused ---------------------------------------------------------------------------------------------------
def _check_paths(file: str, texts: Mapping[str, str]) -> None:
    if file not in texts:
        raise Refused(
            "bad_bundle", f"the bundle has no text of {file!r}, its task", "texts: {file: ..., and its imports}"
        )
    if len(texts) > MOST_FILES:
        raise Refused("bad_bundle", f"the bundle has {len(texts)} files; at most {MOST_FILES}")
    bad = next((name for name in texts if not _is_plain(name)), None)
    if bad is not None:
        raise Refused(
            "bad_bundle",
            f"{bad[:100]!r} is no path of a YAML file below the site's folder",
            "such as trees/look.yaml: no .., nothing that begins with a dot, nothing absolute",
        )


def _is_plain(name: str) -> bool:
    parts = name.split("/")
    return (
        PurePosixPath(name).suffix in (".yaml", ".yml")
        and len(name) <= 200
        and len(parts) <= 10
        and name.isprintable()
        and "\\" not in name
        and all(part and not part.startswith(".") and part == part.strip() for part in parts)
    )


def _bad(file: str, loaded: Loaded, stored: Stored) -> Refused:
    errors = [one for one in loaded.diagnostics if one.severity == "error"]
    many = f"{len(errors)} error{'' if len(errors) == 1 else 's'}"
    return Refused(
        "bad_task", f"{file} has {many}; it is not served", f"formiga check {file}", _rendered(errors, loaded, stored)
    )


def _warnings(loaded: Loaded, stored: Stored) -> list[str]:
    return _rendered([one for one in loaded.diagnostics if one.severity != "error"], loaded, stored)


def _rendered(found: Iterable[Diagnostic], loaded: Loaded, stored: Stored) -> list[str]:
    return [render(one, loaded.sources).replace(f"{stored.folder}/", "") for one in found]
