"""What an assistant's tasks are judged against: a site, a catalogue, and the folders whose files they may read.

Nothing that an assistant says names a file: imports are found among the shipped libraries and in the site's own folder, tasks
by their names. Whatever leads elsewhere, by `..` or by a link, is refused before it is opened.
"""

import errno
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.packaged import folder
from formiga_bt.lang.compose import compose
from formiga_bt.lang.loader import Loaded, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.request.aliases import names_in
from formiga_bt.lang.text.document import Listing, Mapping_, Scalar, parse

TEXT_NAME: Final = "task.yaml"
"""How messages call the text of an assistant."""
LARGEST: Final = 1_000_000
"""Bytes of a file that is read."""


@dataclass(frozen=True, slots=True)
class ServerFiles:
    """The files that a server was started with: what a process of its own needs to know.

    Args of `formiga mcp`; `site` None means the demo site that ships.
    """

    site: str | None = None
    actions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ServedSite:
    """A site and its tasks, as read when the server started, or the process of a job."""

    where: ServerFiles
    catalogue: Catalogue
    site: Site
    own: Path | None
    """The folder of the site's own tasks; None for the demo site."""
    roots: tuple[Path, ...]
    """Whatever is read lies below one of these."""
    tasks: Mapping[str, Path] = field(default_factory=dict)
    """Files by the names and aliases of their tasks; the site's own come first."""

    def read(self, path: Path) -> str:
        """Return the text of a YAML file of the site's folder or of the library.

        Raises:
            OSError: it lies elsewhere, is hidden, too large, or cannot be read.
        """
        real = path.resolve()
        inside = next((real.relative_to(root) for root in self.roots if real.is_relative_to(root)), None)
        hidden = inside is None or any(part.startswith(".") for part in inside.parts)
        if hidden or real.suffix not in (".yaml", ".yml") or not real.is_file():
            raise FileNotFoundError(errno.ENOENT, "no such file")
        if real.stat().st_size > LARGEST:
            raise OSError(errno.EFBIG, "the file is larger than 1 MB")
        return real.read_text(encoding="utf-8")

    def load(self, text: str, name: str = TEXT_NAME, beside: Path | None = None) -> Loaded:
        """Check the text of a task as an assistant wrote it, or one that is there already.

        Args:
            text: YAML.
            name: how messages call it.
            beside: the folder of a task that is there; None = as if it lay among the site's own.
        """
        leads_out = _outward(text, name)
        if leads_out:
            return Loaded(None, leads_out, {name: text})
        return load_task_text(
            text, name, catalogue=self.catalogue, site=self.site, folder_=beside or self.own, read=self.read
        )

    def load_named(self, task: str) -> Loaded:
        """Check a task of the site or of the library by its name.

        Raises:
            UnusableFile: there is none.
        """
        return self.load_file(self.file_of(task))

    def load_file(self, path: Path) -> Loaded:
        """Check the task of a file of the site's folder or of the library.

        Raises:
            OSError: it lies elsewhere, is hidden, too large, or cannot be read.
        """
        return self.load(self.read(path), str(path), path.parent)

    def file_of(self, task: str) -> Path:
        """Return the file of a task.

        Raises:
            UnusableFile: there is none of that name.
        """
        if task in self.tasks:
            return self.tasks[task]
        from formiga_bt.lang.text.reading import did_you_mean

        raise UnusableFile(f"there is no task '{task[:60]}'{did_you_mean(task, self.tasks)}", help="list_tasks has all")


def ground_of(where: ServerFiles) -> ServedSite:
    """Read site, catalogue and the names of tasks.

    Raises:
        UnusableFile: a file has errors.
    """
    path = Path(where.site) if where.site is not None else folder("trees") / "demo-site.yaml"
    found = compose(path, [Path(one) for one in where.actions])
    catalogue, site = found.catalogue, found.site
    wrong = [d for d in found.diagnostics if d.severity == "error"]
    if site is None or wrong:
        said = f": {wrong[0].code}: {wrong[0].message}" if wrong else ""
        raise UnusableFile(f"{path} or the catalogue has errors{said}", help=f"formiga check {path}")
    shipped = folder("trees").resolve()
    beside = path.resolve().parent if where.site is not None else None
    own = (beside / "trees" if (beside / "trees").is_dir() else beside) if beside is not None else None
    roots = (*([beside] if beside is not None else []), shipped)
    ground = ServedSite(where, catalogue, site, own, roots)
    folders = [*([beside, own] if beside is not None and own is not None else []), shipped, shipped / "cookbook"]
    return ServedSite(where, catalogue, site, own, roots, _named(folders, ground.read))


def _named(folders: Sequence[Path], read: Callable[[Path], str]) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for one in dict.fromkeys(folders):
        for path in sorted((*one.glob("*.yaml"), *one.glob("*.yml"))):
            if path.suffixes[-2:-1] == [".test"]:
                continue
            try:
                text = read(path)
            except (OSError, UnicodeDecodeError):
                continue
            if any(line.startswith("task:") for line in text.splitlines()):
                for name in names_in(text):
                    found.setdefault(name, path)
    return found


def _outward(text: str, name: str) -> list[Diagnostic]:
    """Return a problem for each import that leads out of the folders that may be read, whether it exists or not."""
    node, _ = parse(text, name)
    entry = node.get("imports") if isinstance(node, Mapping_) else None
    items = entry.value.items if entry is not None and isinstance(entry.value, Listing) else ()
    said = [entry.value] if entry is not None and isinstance(entry.value, Scalar) else []
    return [
        Diagnostic(
            "E008", _mark(at), "this import leads out of the site's folder", "name a library, as lib/flying.yaml"
        )
        for at in (*items, *said)
        if isinstance(at, Scalar) and (".." in Path(at.text).parts or Path(at.text).is_absolute())
    ]


def _mark(at: Scalar) -> Mark:
    return at.mark
