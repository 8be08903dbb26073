"""The catalogues that a site names: `actions: [base, ground, actions/mine.yaml]`. One rule says which file a word means.

A word without a folder and without a suffix is a catalogue that ships; all else is a file, relative to the site file.
Called by the reader of sites, which reports what is wrong, and by `lang.compose`, which reads the files.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from formiga_bt.lang.shipped import shipped_catalogues
from formiga_bt.lang.text.document import Listing, Mapping_, Scalar, parse_file
from formiga_bt.lang.text.reading import Problems, did_you_mean, fix_word, quoted_list, shorten
from formiga_bt.lang.text.synonyms import surely

BASE: Final = "base"
"""The catalogue that each site has that does not say `actions: []`."""


def is_name(word: str) -> bool:
    """Return whether a word means a catalogue that ships, and not a file."""
    path = Path(word)
    return bool(word) and not path.suffix and path.name == word


def catalogue_file(word: str, folder: Path) -> Path | None:
    """Return the file that a word means; None = no catalogue of that name ships."""
    return shipped_catalogues().get(word) if is_name(word) else folder / word


def named(text: str, file: str, key: str = "actions") -> list[str] | None:
    """Return the words that the text of a site lists under a key; None = it says nothing of it."""
    root, _ = parse_file(text, file)
    entry = root.get(key) if isinstance(root, Mapping_) else None
    if entry is None or not isinstance(entry.value, Listing):
        return None
    return [item.text for item in entry.value.items if isinstance(item, Scalar)]


def catalogue_files(text: str, file: str, more: Iterable[Path] = ()) -> tuple[Path, ...]:
    """Return the files of the catalogues that a site uses: `base`, those that it names, those that are added.

    Without a site all that ships is known, but for what has a name of what is added.

    What it names and does not exist is left out; the reader of the site reports it.

    Args:
        text: of the site file; "" = there is no site.
        file: its name; where it lies is where files are looked up.
        more: what is added to it, relative to the present folder.
    """
    added = [catalogue_file(str(one), Path()) or one for one in more]
    words = named(text, file) if text else _beside(added)
    own = [catalogue_file(word, Path(file).parent) for word in ([] if words == [] else [BASE, *(words or ())])]
    found: dict[Path, Path] = {}
    for path in (*(one for one in own if one is not None and one.is_file()), *added):
        found.setdefault(path.resolve(), path)
    return tuple(found.values())


def check_named(items: Iterable[Scalar], file: str, problems: Problems, *, on_disk: bool) -> None:
    """Report what a site names under `actions:` and does not ship, or (`on_disk`) is not there."""
    known = shipped_catalogues()
    for at in items:
        path = catalogue_file(at.text, Path(file).parent)
        if path is None:
            what = f"no catalogue '{shorten(at.text)}' ships{did_you_mean(at.text, known)}"
            help_ = f"{quoted_list(known)}; of your own write the file, such as actions/{shorten(at.text)}.yaml"
            problems.add("E008", at.mark, what, help_, fix_word(at, surely(at.text, known)))
        elif on_disk and not _is_file(path):
            what = f"there is no catalogue file '{shorten(at.text)}'"
            problems.add(
                "E008", at.mark, what, f"a path relative to this file, or one that ships: {quoted_list(known)}"
            )


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _beside(added: Iterable[Path]) -> list[str]:
    """Return the catalogues that ship and share no name with those that are added."""
    own = {name for path in added if path.is_file() for name in _names(path)}
    return [word for word, path in shipped_catalogues().items() if word != BASE and not own & _names(path)]


def _names(path: Path) -> set[str]:
    """Return the names of the types and actions of a catalogue; what cannot be read has none."""
    try:
        root, _ = parse_file(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError):
        return set()
    parts = [root.get(key) for key in ("types", "actions")] if isinstance(root, Mapping_) else []
    return {
        one.key.text
        for part in parts
        if part is not None and isinstance(part.value, Mapping_)
        for one in part.value.entries
    }
