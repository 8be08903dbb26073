"""The other tasks that a task may request: those of its folder, then those that ship with formiga_bt (or of the library).

Only what a caller must know is read of them: their params, and whom they request themselves. What else is wrong with them,
their own check tells.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.files import Shelf, Unit
from formiga_bt.lang.model import Param, Role, Some
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import Problems


class Neighbours:
    """The tasks that may be requested, found by name.

    Args:
        folder: of the task that requests; None = it is in none.
        library: further folders of tasks, and of what they import.
        read: gives the text of a file.
        texts: tasks by name that are given as texts, before those in folders.
        own: the folders of the site's own libraries.
    """

    def __init__(
        self,
        folder: Path | None,
        library: Sequence[Path],
        read: Callable[[Path], str],
        texts: Mapping[str, str] | None = None,
        own: Sequence[Path] = (),
    ) -> None:
        self._folders = (*([folder] if folder is not None else []), *library)
        self._library = library
        self._own = own
        self._read = read
        self._texts = dict(texts or {})
        self._paths: dict[str, Path] | None = None
        self._units: dict[str, tuple[Shelf, Unit]] = {}
        self.asked: dict[str, Scalar] = {}
        """What the task requests: where it does so first."""

    def names(self) -> list[str]:
        """Return the names of all that may be requested."""
        return sorted({*self._texts, *self._found()})

    def called(self, alias: str) -> str:
        """Return the name of the task that has this alias, "" = none has."""
        for name in self.names():
            unit = self._unit(name)
            entry = unit[1].keys.get("aliases") if unit is not None else None
            words = entry.value.items if entry is not None and isinstance(entry.value, Listing) else ()
            if any(isinstance(word, Scalar) and word.text == alias for word in words):
                return name
        return ""

    def path(self, name: str) -> str:
        """Return the file of a task; "" = it is given as a text."""
        return "" if name in self._texts else str(self._found()[name])

    def params(self, name: str, read: Callable[[Unit, Node], dict[str, Param]]) -> dict[str, Param] | None:
        """Return the params of a task, read by `read` as its file sees them; None if there is none of that name."""
        unit = self._unit(name)
        if unit is None:
            return None
        entry: Entry | None = unit[1].keys.get("params")
        return read(unit[1], entry.value) if entry is not None else {}

    def mark(self, name: str) -> Mark | None:
        """Return where a task is named; None if there is none of that name."""
        unit = self._unit(name)
        entry = unit[1].keys.get("task") if unit is not None else None
        return entry.value.mark if entry is not None else None

    def roles(self, name: str) -> tuple[Role, ...]:
        """Return what a task is granted before its first step, as far as its text says it: types and counts."""
        unit = self._unit(name)
        entry = unit[1].keys.get("agents") if unit is not None else None
        entries = entry.value.entries if entry is not None and isinstance(entry.value, Mapping_) else ()
        return tuple(_role(one.key, one.value) for one in entries if isinstance(one.value, Mapping_))

    def through(self, name: str) -> list[str]:
        """Return the tasks by which the requests of this task come back to `name`; empty if they do not."""
        way: dict[str, str] = dict.fromkeys(self.asked, "")
        queue = list(self.asked)
        while queue:
            one = queue.pop(0)
            if one == name:
                chain = []
                while one := way[one]:
                    chain.append(one)
                return [*reversed(chain), name]
            for other in self._requests(one):
                if other not in way:
                    way[other] = one
                    queue.append(other)
        return []

    def _requests(self, name: str) -> list[str]:
        found = self._unit(name)
        roots = [unit.root for unit in found[0].units.values() if unit.root is not None] if found is not None else []
        return [at for root in roots for at in _requested(root)]

    def _found(self) -> dict[str, Path]:
        if self._paths is None:
            self._paths = {}
            for folder in self._folders:
                for path in sorted((*folder.glob("*.yaml"), *folder.glob("*.yml"))):
                    name = self._name(path)
                    if name:
                        self._paths.setdefault(name, path)
        return self._paths

    def _name(self, path: Path) -> str:
        if not path.is_file() or path.suffixes[-2:-1] == [".test"]:
            return ""
        try:
            lines = self._read(path).splitlines()
        except (OSError, UnicodeDecodeError):
            return ""
        line = next((line for line in lines if line.startswith("task:")), "")
        return line.removeprefix("task:").partition("#")[0].strip()

    def _unit(self, name: str) -> tuple[Shelf, Unit] | None:
        if name not in self._units:
            path = self._found().get(name)
            if name not in self._texts and path is None:
                return None
            shelf = Shelf(self._library, Problems(), self._read, self._own)
            text = self._texts[name] if name in self._texts or path is None else self._read(path)
            file, folder = (name, None) if name in self._texts or path is None else (str(path), path.parent)
            self._units[name] = shelf, shelf.open_text(text, file, folder, library=False)
        return self._units[name]


def _role(key: Scalar, value: Mapping_) -> Role:
    of, any_of, count = value.get("type"), value.get("any_of"), value.get("count")
    words = any_of.value.items if any_of is not None and isinstance(any_of.value, Listing) else ()
    words = (of.value,) if of is not None else words
    types = tuple(word.text for word in words if isinstance(word, Scalar))
    number = count.value.text if count is not None and isinstance(count.value, Scalar) else ""
    least = int(number) if number.isdecimal() else None
    return Role(key.text, types, key.mark, count=least, open=Some() if count is not None and least is None else None)


def _requested(node: Node) -> Iterator[str]:
    if isinstance(node, Listing):
        for item in node.items:
            yield from _requested(item)
    elif isinstance(node, Mapping_):
        for entry in node.entries:
            if entry.key.text == "request" and isinstance(entry.value, Scalar):
                yield entry.value.text
            yield from _requested(entry.value)
