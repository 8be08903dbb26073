"""Reading of nodes: keys, words, flags and lists, each with a located diagnostic when it is not what was due.

Shared by the readers of task files, catalogues and sites. `Problems` gathers what is wrong, so that a file's errors are
reported all at once. Values with types and units are read by `lang.expressions`, not here.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.diagnostics import About, Diagnostic, Fix, Mark, UnusedName
from formiga_bt.base.units import LIKELY, parse_quantity, too_large
from formiga_bt.lang.text.colons import in_text
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.synonyms import nearest, surely

IDENTIFIER: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")

_SI_UNIT: Final = {"duration": "s", "distance": "m", "speed": "m/s", "percent": "%", "angle": "deg", "mass": "kg"}


def why_unreadable(error: OSError | ValueError) -> str:
    """Return why a file could not be read as text, in words."""
    return (
        (error.strerror or "no such file") if isinstance(error, OSError) else "it is not UTF-8 text: save it as UTF-8"
    )


class Problems:
    """The diagnostics found so far, and the place in the task in words that new ones get."""

    def __init__(self) -> None:
        self.found: list[Diagnostic] = []
        self._within: list[str] = []

    def add(
        self,
        code: str,
        mark: Mark,
        message: str,
        help: str = "",
        fix: Fix | None = None,
        *,
        about: About | None = None,
    ) -> None:
        """Report a problem at `mark`."""
        self.found.append(Diagnostic(code, mark, message, help, " / ".join(self._within), fix, about))

    def unused(self, mark: Mark, kind: str, name: str) -> None:
        """Report W060 for what is declared, such as a `role`, and not used."""
        how = "never used" if kind == "import" else "declared but never used"
        self.add("W060", mark, f"{kind} '{name}' is {how}", "remove it", about=UnusedName(kind, name))

    def extend(self, diagnostics: Iterable[Diagnostic]) -> None:
        """Take over diagnostics of the layers below, saying where in the task they stand."""
        within = " / ".join(self._within)
        self.found.extend(d if d.within else replace(d, within=within) for d in diagnostics)

    def within(self, *labels: str) -> "_Within":
        """Say where in the task the problems of this block stand."""
        return _Within(self._within, labels)

    @contextmanager
    def outermost(self, *labels: str) -> Iterator[None]:
        """Like `within`, but for another body, such as that of a subtree read while a task is being read."""
        saved, self._within = self._within, list(labels)
        try:
            yield
        finally:
            self._within = saved

    def has_errors(self, since: int = 0) -> bool:
        """Return whether any error was reported (after the first `since` diagnostics)."""
        return any(d.severity == "error" for d in self.found[since:])


class _Within:
    """Labels for as long as a block lasts. Every step has some, so this is no generator."""

    __slots__ = ("_labels", "_within")

    def __init__(self, within: list[str], labels: tuple[str, ...]) -> None:
        self._within = within
        self._labels = labels

    def __enter__(self) -> None:
        self._within.extend(self._labels)

    def __exit__(self, *_: object) -> None:
        del self._within[len(self._within) - len(self._labels) :]


def quoted_list(names: Iterable[str]) -> str:
    """Return names as people list them: `a, b, c`."""
    return ", ".join(names)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" when a known name is near, else ""."""
    meant = nearest(word, known)
    return f"; did you mean '{meant}'?" if meant else ""


def fix_word(at: Scalar, meant: str) -> Fix | None:
    """Return the fix that writes `meant` instead of the scalar, or None when nothing is meant."""
    return Fix(at.mark, meant) if meant else None


def what_is(node: Node) -> str:
    """Return what a node is, in words."""
    if isinstance(node, Mapping_):
        return "a mapping"
    if isinstance(node, Listing):
        return "a list"
    return f"the text '{shorten(node.text)}'" if node.text else "empty"


def shorten(text: str, most: int = 40) -> str:
    """Return the text cut to `most` characters, for messages."""
    flat = " ".join(text.split())
    return flat if len(flat) <= most else flat[: most - 3] + "..."


def is_empty(node: Node) -> bool:
    """Return whether a node is the empty plain scalar (a key with nothing after it)."""
    return isinstance(node, Scalar) and not node.text and not node.quoted


def read_mapping(node: Node, problems: Problems, what: str) -> Mapping_ | None:
    """Return the node if it is a mapping; else report E008."""
    if isinstance(node, Mapping_):
        return node
    missing, mended = in_text(node.text) if isinstance(node, Scalar) and not node.quoted else ("", "")
    said = f"'{what}' must be a mapping (key: value), this is {what_is(node)}"
    problems.add("E008", node.mark, f"{said}; {missing}" if missing else said, f"write: {mended}" if missing else "")
    return None


def read_listing(node: Node, problems: Problems, what: str) -> Sequence[Node] | None:
    """Return the items if the node is a list; else report E008."""
    if isinstance(node, Listing):
        return node.items
    fix = None
    if isinstance(node, Scalar) and IDENTIFIER.match(node.text):
        fix = Fix(node.mark, f"[{node.text}]")
    help_ = (
        f"write [{node.text}]"
        if fix is not None and isinstance(node, Scalar)
        else "write one item per line, each after '- '"
    )
    problems.add("E008", node.mark, f"'{what}' must be a list, this is {what_is(node)}", help_, fix)
    return None


def read_text(node: Node, problems: Problems, what: str) -> Scalar | None:
    """Return the node if it is a scalar; else report E008."""
    if isinstance(node, Scalar):
        return node
    problems.add("E008", node.mark, f"'{what}' must be text, this is {what_is(node)}")
    return None


def read_word(node: Node, problems: Problems, what: str, choices: Sequence[str]) -> str:
    """Return the word if it is one of `choices`; else report E008 and return ""."""
    scalar = read_text(node, problems, what)
    if scalar is None or scalar.text in choices:
        return scalar.text if scalar is not None else ""
    meant = surely(scalar.text, choices)
    problems.add(
        "E008",
        scalar.mark,
        f"'{what}' cannot be '{shorten(scalar.text)}'{did_you_mean(scalar.text, choices)}",
        f"one of {quoted_list(choices)}",
        fix_word(scalar, meant),
    )
    return ""


def read_flag(node: Node, problems: Problems, what: str) -> bool:
    """Return a true/false option; anything else is E008 (and counts as false)."""
    scalar = read_text(node, problems, what)
    if scalar is None or scalar.text in ("true", "false"):
        return scalar is not None and scalar.text == "true"
    meant = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(scalar.text.lower(), scalar.text.lower())
    fix = fix_word(scalar, meant) if meant in ("true", "false") else None
    problems.add(
        "E008", scalar.mark, f"'{what}' must be true or false, this is {what_is(scalar)}", "write true or false", fix
    )
    return False


def read_words(node: Node, problems: Problems, what: str) -> list[Scalar]:
    """Return the scalars of a list of words; E008 for anything else."""
    items = read_listing(node, problems, what)
    found = [read_text(item, problems, what) for item in items or ()]
    return [item for item in found if item is not None]


def read_name(node: Node, problems: Problems, what: str) -> Scalar | None:
    """Return a scalar that is an identifier; else report E008."""
    scalar = read_text(node, problems, what)
    if scalar is None or IDENTIFIER.match(scalar.text):
        return scalar
    message = f"'{shorten(scalar.text)}' cannot be a name" if scalar.text else f"'{what}' needs a name"
    problems.add("E008", scalar.mark, message, "a letter, then letters, digits and _")
    return None


def read_quantity(node: Node, problems: Problems, what: str, kind: str) -> float | None:
    """Return a literal with unit in SI (percent 0..100), of the given type; E017 or E008 otherwise."""
    scalar = read_text(node, problems, what)
    if scalar is None:
        return None
    found = parse_quantity(scalar.text)
    if found is not None and found[0] == kind:
        return float(found[1])
    if too_large(scalar.text, kind):
        problems.add("E013", scalar.mark, f"{shorten(scalar.text)} is too large", "at most 2**53 in SI units")
        return None
    try:
        float(scalar.text)
    except ValueError:
        problems.add(
            "E008" if found is None else "E017", scalar.mark, f"'{what}' must be a {kind}, this is {what_is(scalar)}"
        )
        return None
    unit = _SI_UNIT.get(kind, "")
    single = len(LIKELY.get(kind, ())) == 1
    problems.add(
        "E017",
        scalar.mark,
        f"'{what}' needs a unit: {scalar.text} {unit}?",
        f"write {scalar.text} {unit}",
        Fix(scalar.mark, f"{scalar.text} {unit}") if single else None,
    )
    return None


def read_number(node: Node, problems: Problems, what: str) -> float | None:
    """Return a plain number; E008 otherwise."""
    scalar = read_text(node, problems, what)
    if scalar is None:
        return None
    try:
        value = float(scalar.text)
    except ValueError:
        value = float("nan")
    if value == value and abs(value) != float("inf"):
        return value
    problems.add("E008", scalar.mark, f"'{what}' must be a number, this is {what_is(scalar)}")
    return None


def plain(node: Node) -> Any:
    """Return a node as dicts, lists and texts: settings that another layer reads."""
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, Listing):
        return [plain(item) for item in node.items]
    return {entry.key.text: plain(entry.value) for entry in node.entries}
