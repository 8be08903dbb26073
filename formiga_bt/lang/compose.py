"""A site and the catalogues that it uses, read together: what each command, the editor and the engine begin with.

Which catalogues they are is said in `lang.site.catalogues`. Called with the file of a site, or with none.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from formiga_bt.base.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.files import read_file
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.site import load_site_text
from formiga_bt.lang.site.catalogues import catalogue_files
from formiga_bt.lang.site.libraries import library_folders
from formiga_bt.lang.text.reading import why_unreadable


class Composed(Struct, frozen=True):
    """A site and its catalogues."""

    catalogue: Catalogue
    site: Site | None
    """None: none was named, or it has errors."""
    files: tuple[Path, ...]
    """The catalogue files, in order."""
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, str]
    """Text by file name."""


def compose(
    site: Path | None, more: Sequence[Path] = (), *, read: Callable[[Path], str] = read_file, text: str | None = None
) -> Composed:
    """Read a site and the catalogues that it uses.

    Args:
        site: the site file; None = no site: what ships and shares no name with what is added.
        more: catalogue files, or names of those that ship, besides those that the site names.
        read: gives the text of a file.
        text: of the site file, if it is known already.
    """
    problems: list[Diagnostic] = []
    try:
        text = read(site) if site is not None and text is None else text
    except (OSError, UnicodeDecodeError) as error:
        problems.append(Diagnostic("E008", Mark(str(site), 1, 1), f"the file cannot be read: {why_unreadable(error)}"))
    files = catalogue_files(text or "", str(site), more)
    libraries = library_folders(text or "", str(site))
    catalogue, found, sources = load_catalogue(files, read=read, libraries=libraries)
    problems += found
    the_site: Site | None = None
    if site is not None and text is not None:
        the_site, wrong, own = load_site_text(text, str(site), catalogue, read=read)
        problems += wrong
        sources = {**sources, **own}
    return Composed(catalogue, the_site, files, tuple(in_order(problems)), sources)
