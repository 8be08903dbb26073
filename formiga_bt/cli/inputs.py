"""What verbs read from files: task files, the catalogue they are checked against, the site.

Called by `check`, `show` and whatever runs a task. The loader is imported when the first file is read, not before.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from formiga_bt.diagnostics import Diagnostic, in_order, render
from formiga_bt.errors import FormigaError
from formiga_bt.packaged import files as packaged_files

if TYPE_CHECKING:
    from formiga_bt.lang.model import Catalogue, Site, Task


class UnusableFile(FormigaError):  # noqa: N818 - it names what is wrong
    """A file named on the command line cannot be read (exit code 2)."""


@dataclass(frozen=True, slots=True)
class World:
    """What task files are checked against, and what is wrong with it."""

    catalogue: "Catalogue"
    site: "Site | None" = None
    diagnostics: tuple[Diagnostic, ...] = ()
    sources: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Read:
    """One task file as read: `task` is None when it has errors, or when it is a library of subtrees."""

    path: Path
    task: "Task | None"
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, str]


def task_files(paths: Iterable[Path]) -> list[Path]:
    """Return the files, with each folder replaced by the task files below it.

    In a folder, libraries of subtrees and `*.test.yaml` are passed over: a library is checked where it is imported.

    Raises:
        UnusableFile: a path does not exist, or a folder holds no task file.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.rglob("*.yaml") if not p.name.endswith(".test.yaml") and _is_task(p))
            if not inside:
                raise UnusableFile(f"no task file (*.yaml) below {path}")
            found += inside
        else:
            found.append(readable(path))
    return list(dict.fromkeys(found))


def _is_task(path: Path) -> bool:
    """Return whether a file of a folder says that it is a task; one that cannot be read is left to the loader."""
    try:
        return any(line.startswith("task:") for line in path.read_text(encoding="utf-8").splitlines())
    except (OSError, UnicodeDecodeError):
        return True


def readable(path: Path) -> Path:
    """Return `path` if it can be opened.

    Raises:
        UnusableFile: it cannot.
    """
    try:
        with path.open("rb"):
            return path
    except OSError as error:
        raise UnusableFile(f"cannot read {path}: {error.strerror or error}") from error


def read_world(actions: Sequence[Path] = (), site: Path | None = None) -> World:
    """Read the catalogue (default: the one that ships with formiga_bt) and the site, if any.

    Raises:
        UnusableFile: a file cannot be opened.
    """
    from formiga_bt.lang.loader import load_catalogue, load_site

    files = [readable(path) for path in actions] if actions else packaged_files("actions")
    if not files:
        raise UnusableFile("this installation has no action catalogue; name yours with --actions FILE")
    catalogue, diagnostics, sources = load_catalogue(files)
    if site is None:
        return World(catalogue, None, tuple(diagnostics), dict(sources))
    the_site, more, site_sources = load_site(readable(site), catalogue)
    return World(catalogue, the_site, (*diagnostics, *more), {**sources, **site_sources})


def read_task(path: Path, world: World) -> Read:
    """Read and check one task file against `world`."""
    from formiga_bt.lang.loader import load_task

    loaded = load_task(path, catalogue=world.catalogue, site=world.site)
    return Read(path, loaded.task, tuple(in_order(loaded.diagnostics)), loaded.sources)


def rendered(diagnostics: Iterable[Diagnostic], sources: Mapping[str, str] | None = None) -> list[str]:
    """Return the text of each diagnostic; source lines come from `sources`, else from the files on disk."""
    texts = dict(sources or {})
    lines = []
    for diagnostic in diagnostics:
        name = diagnostic.mark.file
        if name not in texts:
            texts[name] = ""
            with suppress(OSError, UnicodeDecodeError):
                texts[name] = Path(name).read_text(encoding="utf-8")
        lines.append(render(diagnostic, texts))
    return lines
