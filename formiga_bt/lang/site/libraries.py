"""The libraries that a site names: `libraries: [trees/lib]`. Folders of its own subtrees, below the folder of the site file.

Called by the reader of sites, which reports what is wrong, and by `lang.compose`: its catalogue says where they are.
"""

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from formiga_bt.lang.site.catalogues import named
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems, shorten

_KEY = "libraries"


def library_folders(text: str, file: str) -> tuple[Path, ...]:
    """Return the folders that the text of a site names as libraries, in order; what it cannot name is left out."""
    words = named(text, file, _KEY) if _KEY in text else None
    return tuple(dict.fromkeys(Path(file).parent / word for word in words or () if not fault_of(word)))


def fault_of(word: str) -> str:
    """Return why a word names no folder below that of the site file, or ""."""
    parts = PurePosixPath(word).parts
    if not parts or len(word) > 200 or not word.isprintable():
        return "is no folder"
    if word.startswith("/") or ".." in parts or "\\" in word:
        return "lies outside of the site's folder"
    return "is hidden" if any(part.startswith(".") for part in parts) else ""


def check_libraries(items: Iterable[Scalar], file: str, problems: Problems, *, on_disk: bool) -> None:
    """Report what a site names under `libraries:` and cannot, or (`on_disk`) is not there."""
    seen: set[Path] = set()
    for at in items:
        path = Path(file).parent / at.text
        fault = fault_of(at.text) or ("" if not on_disk or path.is_dir() else "is no folder")
        if fault:
            help_ = "a folder below that of this file, such as trees/lib"
            problems.add("E008", at.mark, f"the library '{shorten(at.text)}' {fault}", help_)
        elif path in seen:
            problems.add("E018", at.mark, f"the library '{shorten(at.text)}' is named twice", "remove one")
        seen.add(path)
