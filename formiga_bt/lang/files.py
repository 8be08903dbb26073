"""Files of a task: the task itself and what it imports, found, read once and parsed.

An import is looked up in the importing file's folder, then in the libraries of the site, then in what ships (the packaged
trees). `Shelf` keeps what was read, finds circles, and remembers every text for diagnostics and for the hash of the bundle.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct, field

from formiga_bt.base.diagnostics import Fix, Mark
from formiga_bt.lang.keyed import read_keys
from formiga_bt.lang.kinds import LIBRARY, TASK, Option
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.text.document import Entry, Mapping_, Scalar, parse_file
from formiga_bt.lang.text.reading import (
    Problems,
    did_you_mean,
    read_mapping,
    read_name,
    read_text,
    read_words,
    shorten,
    why_unreadable,
)
from formiga_bt.lang.text.synonyms import nearest

LANGUAGE_VERSION = 1


class Unit(Struct):
    """One file: its keys, the subtrees it defines, and the files it imports."""

    file: str
    folder: Path | None
    keys: dict[str, Entry] = field(default_factory=dict)
    root: Mapping_ | None = None
    own: dict[str, Entry] = field(default_factory=dict)
    imports: list[tuple[Scalar, "Unit"]] = field(default_factory=list)
    called: set[str] = field(default_factory=set)
    """Files of which a subtree was called from here."""

    def find(self, name: str) -> "Unit | None":
        """Return the unit that defines the subtree `name` as seen from here."""
        if name in self.own:
            return self
        return next((unit for _, unit in self.imports if name in unit.own), None)

    def visible(self) -> list[str]:
        """Return the names of the subtrees that this file may call."""
        return [*self.own, *(name for _, unit in self.imports for name in unit.own)]


def read_file(path: Path) -> str:
    """Return the text of a file."""
    return path.read_text(encoding="utf-8")


class Shelf:
    """Every file read for one task.

    Args:
        library: the folders of what ships, where imports are looked up last.
        problems: where to report.
        read: gives the text of an import; an editor has files that are not saved yet.
        own: the folders of the site's own libraries, where they are looked up before.
    """

    def __init__(
        self,
        library: Sequence[Path],
        problems: Problems,
        read: Callable[[Path], str] = read_file,
        own: Sequence[Path] = (),
    ) -> None:
        self.problems = problems
        self._read = read
        self.sources: dict[str, str] = {}
        self.units: dict[str, Unit] = {}
        self.library = tuple(library)
        self.own = tuple(own)
        self._labels: dict[str, Path] = {}
        self._open: list[str] = []

    def open_text(
        self, text: str, file: str, folder: Path | None, *, library: bool, labels: Mapping[int, str] | None = None
    ) -> Unit:
        """Parse a file's text and everything it imports; problems are reported."""
        unit = Unit(file, folder)
        self.sources[file] = text
        self.units[file] = unit
        node, found = parse_file(text, file, labels)
        self.problems.extend(found)
        if node is None:
            if not found:
                self.problems.add("E008", Mark(file, 1, 1), "the file is empty", "begin with: formiga: 1")
            return unit
        unit.root = read_mapping(node, self.problems, "file")
        if unit.root is None:
            return unit
        for key, what in (("formiga_site", "a site"), ("scenario", "a scenario"), ("actions", "a catalogue")):
            if unit.root.get(key) is not None and unit.root.get("task") is None and not library:
                mark = unit.root.entries[0].key.mark
                self.problems.add("E008", mark, f"this is {what}, not a task", "a task begins with: formiga: 1")
                unit.root = None
                return unit
        options: tuple[Option, ...] = LIBRARY if library else TASK
        if not self._version_fits(unit.root):
            return unit
        known = tuple(option for option in options if option.name != "formiga")
        rest = Mapping_(tuple(e for e in unit.root.entries if e.key.text.lower() != "formiga"), unit.root.mark)
        unit.keys = read_keys(rest, known, self.problems, "a library" if library else "a task")
        self._read_own(unit)
        self._open.append(file)
        self._read_imports(unit)
        self._open.pop()
        return unit

    def _version_fits(self, root: Mapping_) -> bool:
        entry = root.get("formiga")
        meant = next((e.key for e in root.entries if e.key.text.lower() == "formiga"), None)
        if entry is None and meant is not None:
            what = f"'{meant.text}' is not a key; did you mean 'formiga'?"
            self.problems.add("E007", meant.mark, what, "keys are written in small letters", Fix(meant.mark, "formiga"))
            return True
        if entry is None:
            self.problems.add(
                "E007",
                Mark(root.mark.file, root.mark.line, root.mark.col),
                "the language version is missing",
                f"begin with: formiga: {LANGUAGE_VERSION}",
                _first_line(root),
            )
            return True
        at = read_text(entry.value, self.problems, "formiga")
        if at is None or at.text == str(LANGUAGE_VERSION):
            return True
        if at.text.isascii() and at.text.isdigit() and int(at.text[:9]) > LANGUAGE_VERSION:
            what = f"this file needs formiga {shorten(at.text)}, this compiler knows {LANGUAGE_VERSION}"
            self.problems.add("E007", at.mark, what, "use a newer formiga")
            return False
        self.problems.add(
            "E007", at.mark, f"'{shorten(at.text)}' is not a language version", f"write formiga: {LANGUAGE_VERSION}"
        )
        return True

    def _read_own(self, unit: Unit) -> None:
        entry = unit.keys.get("subtrees")
        mapping = read_mapping(entry.value, self.problems, "subtrees") if entry is not None else None
        for one in mapping.entries if mapping is not None else ():
            if read_name(one.key, self.problems, "subtrees") is not None and is_free(one.key, self.problems):
                unit.own[one.key.text] = one

    def _read_imports(self, unit: Unit) -> None:
        entry = unit.keys.get("imports")
        for at in read_words(entry.value, self.problems, "imports") if entry is not None else ():
            imported = self._open_import(unit, at)
            if imported is None:
                continue
            for name in imported.own:
                first = unit.find(name)
                if first is not None and first is not imported:
                    what = f"subtree '{name}' of {at.text} is defined in {first.file} too"
                    self.problems.add("E018", at.mark, what, "rename one of them")
            if any(other is imported for _, other in unit.imports):
                self.problems.add("E018", at.mark, f"'{at.text}' is imported twice", "remove one")
                continue
            unit.imports.append((at, imported))

    def _open_import(self, unit: Unit, at: Scalar) -> Unit | None:
        located = self._located(at.text, unit.folder)
        if not located:
            self._report_missing(unit, at)
            return None
        path, *others = located
        file = self.label(path)
        self._report_hidden(at, path, others)
        if file in self._open:
            circle = [Path(name).name for name in [*self._open[self._open.index(file) :], file]]
            self.problems.add("E051", at.mark, f"imports go in a circle: {' -> '.join(circle)}", "remove one of them")
            return None
        if file in self.units:
            return self.units[file]
        try:
            text = self._read(path)
        except (OSError, UnicodeDecodeError) as error:
            self.problems.add("E008", at.mark, f"'{at.text}' cannot be read: {why_unreadable(error)}")
            return None
        with self.problems.outermost():
            return self.open_text(text, file, path.parent, library=True)

    def label(self, path: Path) -> str:
        """Return how messages call a file: one of the library by its place in it (`trees/lib/flying.yaml`)."""
        for place in self.library:
            if path.is_relative_to(place):
                short = (Path(place.name) / path.relative_to(place)).as_posix()
                return short if self._labels.setdefault(short, path) == path else str(path)
        return str(path) if self._labels.setdefault(str(path), path) == path else str(path.absolute())

    def _report_missing(self, unit: Unit, at: Scalar) -> None:
        known = importable(unit.folder, self.own, self.library)
        meant = nearest(at.text, known)
        help_ = f"libraries: {', '.join(known)}" if known and not meant else "a path relative to this file"
        self.problems.add(
            "E008", at.mark, f"no file '{shorten(at.text)}' to import{did_you_mean(at.text, known)}", help_
        )

    def _report_hidden(self, at: Scalar, path: Path, others: Iterable[Path]) -> None:
        """Warn of an import whose word means other files too, which say something else: nobody sees which one counts."""
        for other in others:
            try:
                differs = self._read(other) != self._read(path)
            except (OSError, UnicodeDecodeError):
                continue
            if differs:
                ships = any(other.is_relative_to(place) for place in self.library)
                what = f"'{at.text}' means {path} here, and hides {'the one that ships' if ships else other}"
                self.problems.add("W180", at.mark, what, "give one of them another name")
                return

    def locate(self, name: str, folder: Path | None) -> Path | None:
        """Return where an import lies, or None."""
        return next(iter(self._located(name, folder)), None)

    def _located(self, name: str, folder: Path | None) -> list[Path]:
        """Return all the files that a word of an import could mean; the first one counts."""
        if not name or "\0" in name or len(name) > 200 or Path(name).is_absolute():
            return []
        places = (*([folder] if folder is not None else []), *self.own, *self.library)
        return [path for place in places if self._is_there(path := place / name)]

    def _is_there(self, path: Path) -> bool:
        try:
            if path.is_file():
                return True
            if self._read is not read_file:  # of texts that lie on no disk
                self._read(path)
                return True
        except (OSError, ValueError):
            pass
        return False


def importable(folder: Path | None, own: Iterable[Path], library: Iterable[Path]) -> list[str]:
    """Return the words by which libraries can be imported from a folder: those in a `lib/`, and all of the site's own."""
    below = [*([folder] if folder is not None else []), *library]
    found = {path.relative_to(place) for place in below for path in (place / "lib").glob("*.yaml")}
    found |= {path.relative_to(place) for place in own for path in place.rglob("*.yaml")}
    return sorted(path.as_posix() for path in found)


def _first_line(root: Mapping_) -> Fix | None:
    """Return the fix that puts the version before the first key of a file in block style."""
    key = root.entries[0].key.mark if root.entries else root.mark
    if (key.line, key.col) != (root.mark.line, 1):
        return None
    return Fix(Mark(key.file, key.line, 1, key.line, 1), f"formiga: {LANGUAGE_VERSION}\n")
