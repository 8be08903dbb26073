"""What verbs read from files: task files, the catalogue they are checked against, the site.

Called by `check`, `show` and whatever runs a task. The loader is imported when the first file is read, not before.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Diagnostic, errors_first, in_order, render
from formiga_bt.base.errors import TreeError
from formiga_bt.base.errors import UnusableFile as UnusableFile
from formiga_bt.base.near_site import SITE_FILE, site_near
from formiga_bt.base.packaged import folder

if TYPE_CHECKING:
    from formiga_bt.lang.model import Catalogue, Site, Task


class CheckWorld(Struct, frozen=True):
    """What task files are checked against, and what is wrong with it."""

    catalogue: "Catalogue"
    site: "Site | None" = None
    diagnostics: tuple[Diagnostic, ...] = ()
    sources: Mapping[str, str] = field(default_factory=dict)
    actions: tuple[Path, ...] = ()
    """The catalogue files."""


class ReadFile(Struct, frozen=True):
    """One task file as read: `task` is None when it has errors, or when it is a library of subtrees."""

    path: Path
    task: "Task | None"
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, str]


class FoundFiles(Struct, frozen=True):
    """The task files that paths mean, and the YAML files of folders that were passed over."""

    tasks: list[Path]
    others: list[Path]

    @property
    def note(self) -> str:
        """Return a text that names what was passed over, or an empty one."""
        if not self.others:
            return ""
        names = ", ".join(str(path) for path in self.others[:NAMED])
        more = f" and {len(self.others) - NAMED} more" if len(self.others) > NAMED else ""
        one = len(self.others) == 1
        return f"{len(self.others)} {'file is no task' if one else 'files are no tasks'}: {names}{more}"


NAMED = 5
"""So many files that are passed over are named."""


def task_files(paths: Iterable[Path]) -> list[Path]:
    """Return the task files of `find_tasks`.

    Raises:
        UnusableFile: a path does not exist, or a folder holds no task file.
    """
    return find_tasks(paths).tasks


def find_tasks(paths: Iterable[Path], *, may_be_empty: bool = False) -> FoundFiles:
    """Return the files, with each folder replaced by the task files below it.

    In a folder, what is no task is passed over: libraries of subtrees (they are checked where they are imported), sites,
    pipes. So are `*.test.yaml`, which are not even named.

    Raises:
        UnusableFile: a path does not exist, or a folder holds no task file (unless it `may_be_empty`).
    """
    found: list[Path] = []
    others: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(readable(path))
            continue
        below = sorted(
            p
            for p in path.rglob("*.y*ml")
            if p.suffix in (".yaml", ".yml") and not p.is_dir() and p.suffixes[-2:-1] != [".test"]
        )
        tasks = [p for p in below if _is_task(p)]
        if not tasks and not may_be_empty:
            left = FoundFiles([], below).note
            raise UnusableFile(f"no task file (*.yaml, *.yml) below {path}" + (f"; {left}" if left else ""))
        found += tasks
        others += [p for p in below if p not in tasks]
    return FoundFiles(list(dict.fromkeys(found)), list(dict.fromkeys(others)))


def _is_task(path: Path) -> bool:
    """Return whether a file of a folder says that it is a task; one that cannot be read is left to the loader.

    What is no regular file (a pipe would make us wait for ever) is none.
    """
    if path.exists() and not path.is_file():
        return False
    try:
        return any(line.startswith("task:") for line in path.read_text(encoding="utf-8").splitlines())
    except (OSError, UnicodeDecodeError):
        return True


def readable(path: Path) -> Path:
    """Return `path` if it can be opened.

    Raises:
        UnusableFile: it cannot, or is a pipe, a device or a socket.
    """
    _no_pipe(path)
    try:
        with path.open("rb"):
            return path
    except OSError as error:
        raise UnusableFile(f"cannot read {path}: {error.strerror or error}") from error


def _no_pipe(path: Path) -> None:
    """Refuse a pipe, a device, a socket: reading one may never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise UnusableFile(f"cannot read {path}: it is no regular file")


def read_world(
    actions: Sequence[Path] = (), site: Path | None = None, *, near: Path | None = Path(SITE_FILE)
) -> CheckWorld:
    """Read a site, if any, and the catalogues that it uses (`lang.compose`).

    A site called `demo` where there is no such file is the demo site that ships. Without a site the catalogues are those of
    the site that is `near`, if there is one: a task is checked against the types and libraries that it will find there.

    Args:
        actions: catalogue files, or names of those that ship, added to those of the site.
        site: the site file.
        near: the site file whose catalogues count where no site is named, such as `site.yaml` of the present folder.

    Raises:
        UnusableFile: a file cannot be opened.
    """
    from formiga_bt.lang.compose import compose

    added = added_catalogues(actions)
    if site is not None:
        found = compose(readable(site_file(site)), added)
        return CheckWorld(found.catalogue, found.site, found.diagnostics, found.sources, found.files)
    found = compose(near if near is not None and near.is_file() else None, added)
    mine = {str(path) for path in found.files}
    problems = tuple(one for one in found.diagnostics if one.mark.file in mine)
    sources = {name: text for name, text in found.sources.items() if name in mine}
    return CheckWorld(found.catalogue, None, problems, sources, found.files)


def site_of(file: Path, command: str) -> "Site":
    """Read a site; what is wrong with it is printed.

    Args:
        file: its file.
        command: how its file is named to the verb that reads it.

    Raises:
        UnusableFile: it is not there.
        TreeError: it, or its catalogue, has errors.
    """
    if not file.exists():
        raise UnusableFile(f"there is no {file}", help=f"name the site's file: {command}")
    world = read_world([], file)
    errors = [one for one in world.diagnostics if one.severity == "error"]
    if errors or world.site is None:
        import typer  # checking files does without it

        typer.echo("\n\n".join(rendered(errors, world.sources)), err=True)
        raise TreeError("the site or its catalogue has errors")
    return world.site


def near(file: Path) -> Path:
    """Return the site file that a file belongs to, else the one of the present folder, whether it is there or not."""
    return site_near(file.parent) or Path(SITE_FILE)


def added_catalogues(words: Iterable[Path]) -> tuple[Path, ...]:
    """Return the files that `--actions` means: of a catalogue that ships by its name, else of one here.

    Raises:
        UnusableFile: there is none, or it cannot be opened.
    """
    from formiga_bt.lang.shipped import shipped_catalogues
    from formiga_bt.lang.site.catalogues import catalogue_file

    found = []
    for word in words:
        file = word if word.is_file() else catalogue_file(str(word), Path())
        if file is None:
            raise UnusableFile(
                f"there is no catalogue {word}",
                help=f"name a file, such as actions/{word}.yaml, or one that ships: {', '.join(shipped_catalogues())}",
            )
        found.append(readable(file))
    return tuple(found)


def is_demo(site: Path) -> bool:
    """Return whether the name of a site means the demo site that ships."""
    return site == Path("demo") and not site.exists()


def site_file(site: Path) -> Path:
    """Return the file of a site that was named by its path, or as `demo`."""
    return folder("trees") / "demo-site.yaml" if is_demo(site) else site


def shipped_task(path: Path) -> Path:
    """Return the file of a task that ships, if a path is no file here but such a task's name, for example `Circle`."""
    if path.exists() or not path.name.isidentifier() or path.parent != Path():
        return path
    return shipped_tasks().get(path.name, path)


def shipped_tasks() -> dict[str, Path]:
    """Return the files of the tasks that ship, by their names and aliases."""
    from formiga_bt.lang.request.aliases import names_in

    paths = find_tasks([folder("trees")]).tasks
    return {name: path for path in paths for name in names_in(path.read_text(encoding="utf-8"))}


def read_task(path: Path, world: CheckWorld) -> ReadFile:
    """Read and check one task file against `world`."""
    from formiga_bt.lang.loader import load_task

    _no_pipe(path)
    loaded = load_task(path, catalogue=world.catalogue, site=world.site)
    return ReadFile(path, loaded.task, tuple(in_order(loaded.diagnostics)), loaded.sources)


def rendered(diagnostics: Iterable[Diagnostic], sources: Mapping[str, str] | None = None) -> list[str]:
    """Return the text of each diagnostic, of each file the errors first; source lines come from `sources`, else from disk."""
    texts = dict(sources or {})
    lines = []
    for diagnostic in errors_first(diagnostics):
        name = diagnostic.mark.file
        if name not in texts:
            texts[name] = ""
            with suppress(OSError, UnicodeDecodeError):
                texts[name] = Path(name).read_text(encoding="utf-8")
        lines.append(render(diagnostic, texts))
    return lines


def written(text: str, path: Path | None, *, force: bool) -> None:
    """Write what a verb makes to a file, or to stdout if `path` is None.

    Raises:
        UnusableFile: the file cannot be written, or exists and `force` does not say to replace it.
    """
    if path is None:
        print(text, end="")
        return
    try:
        with path.open("w" if force else "x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError as error:
        raise UnusableFile(f"{path} exists; to replace it say --force") from error
    except OSError as error:
        raise UnusableFile(f"cannot write {path}: {error.strerror or error}") from error
