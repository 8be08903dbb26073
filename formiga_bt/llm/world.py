"""What a draft is made for: the catalogue, the site, the libraries and the tasks that the site has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.packaged import folder
from formiga_bt.lang.model import Catalogue, Site


@dataclass(frozen=True, slots=True)
class RequestWorld:
    """Where a request is to be flown."""

    catalogue: Catalogue
    site: Site
    library: tuple[Path, ...] = ()
    """Folders where imports are looked up; () = the packaged trees."""
    tasks: Mapping[str, str] = field(default_factory=dict)
    """File name -> text: the site's own tasks, which serve as examples."""

    @property
    def folders(self) -> Sequence[Path] | None:
        """Return `library` as the loader takes it."""
        return self.library or None


def world_of(site: Path | None = None, actions: Sequence[Path] = ()) -> RequestWorld:
    """Read a world from files.

    Args:
        site: the site file; None = the demo site that ships.
        actions: catalogue files that are added to those of the site.

    Raises:
        UnusableFile: a file has errors.
    """
    from formiga_bt.lang.compose import compose

    path = site or folder("trees") / "demo-site.yaml"
    found = compose(path, actions)
    wrong = [d for d in found.diagnostics if d.severity == "error"]
    if found.site is None or wrong:
        said = f": {wrong[0].code}: {wrong[0].message}" if wrong else ""
        raise UnusableFile(f"{path} or the catalogue has errors{said}", help=f"formiga check {path}")
    return RequestWorld(found.catalogue, found.site, (), _tasks_beside(path) if site is not None else {})


def _tasks_beside(site: Path) -> dict[str, str]:
    found = {}
    for path in sorted((site.parent / "trees").glob("*.yaml")):
        if not path.name.endswith(".test.yaml") and path.is_file():
            text = path.read_text(encoding="utf-8", errors="replace")
            if any(line.startswith("task:") for line in text.splitlines()):
                found[path.name] = text
    return found
