"""Typed parts of an expression, the collector of its problems, and the one explanation of "wrong type".

Used by the expression checker and by the reader of YAML values, so that one mistake has one code and one text wherever
it is made.
"""

import difflib
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.diagnostics import About, Diagnostic, Fix, OnGround
from formiga_bt.base.units import LIKELY
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.typing_rules import NUMBERS, QUANTITIES, fits, in_words
from formiga_bt.lang.model import NOT_CONST, Dependency, Env
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.synonyms import is_sure
from formiga_bt.lang.types import ANY, TEXT, Type

Run = Callable[[Env], Any]

_EXAMPLES: Final[Mapping[str, str]] = MappingProxyType(
    {"duration": "15", "distance": "60", "percent": "40", "angle": "90", "speed": "4", "mass": "2"}
)


class Typed(Struct, frozen=True):
    """A checked part of an expression: its type, its code, its columns, and what it reads."""

    type: Type
    run: Run
    start: int
    end: int
    source: str
    reads: tuple[Dependency, ...] = ()
    const: Any = NOT_CONST
    literal: str = ""
    """`number`, `quantity` or `text` if it is a literal as written, with or without a sign."""
    name: str = ""
    """The name, if the part is nothing else."""

    @property
    def is_const(self) -> bool:
        """Return whether the value is known now."""
        return self.const is not NOT_CONST


def constant(value: Any) -> Run:
    """Return code that answers `value`."""
    return lambda _env: value


def never(_env: Env) -> Any:
    """Code of an expression that was refused; a refused tree is never run."""
    raise AssertionError("a refused expression was run")


class ExpressionProblems:
    """Collects the diagnostics of one expression, found at `at.text[offset:]`."""

    def __init__(self, at: Scalar, offset: int) -> None:
        self.found: list[Diagnostic] = []
        self._at = at
        self._offset = offset

    def report(
        self,
        code: str,
        start: int,
        end: int,
        message: str,
        mend: str = "",
        *,
        mended: str | None = None,
        about: About | None = None,
    ) -> None:
        """Add a problem at columns of the expression; `mended` is the text that replaces them."""
        mark = self._at.mark_at(self._offset + start, self._offset + end)
        fix = Fix(mark, mended) if mended is not None and self._at.exact else None
        self.found.append(Diagnostic(code, mark, message, mend, fix=fix, about=about))


def closest(word: str, legal: Iterable[str]) -> str:
    """Return the legal word that is most like `word`, or an empty text."""
    names = list(legal)
    lowered = {name.lower(): name for name in names}
    if word.lower() in lowered:
        return lowered[word.lower()]
    found = difflib.get_close_matches(word, names, 1, 0.6)
    return found[0] if found else ""


def sure_of(word: str, legal: Iterable[str]) -> str | None:
    """Return the legal word that alone can have been meant: what `formiga fix` may write."""
    names = list(legal)
    near = closest(word, names)
    return near if near and is_sure(word, near, names) else None


def did_you_mean(word: str, legal: Iterable[str]) -> str:
    """Return `; did you mean 'x'?` or an empty text."""
    near = closest(word, legal)
    return f"; did you mean '{near}'?" if near else ""


def unit_choices(type_name: str, number: str = "") -> str:
    """Return the likely ways to write a quantity: `15 s or 15 min`."""
    shown = number or _EXAMPLES.get(type_name, "1")
    return " or ".join(f"{shown} {unit}" for unit in LIKELY.get(type_name, ()))


class Mismatch(Struct, frozen=True):
    """Why a value does not stand where a type is due."""

    code: str
    message: str
    mend: str = ""
    mended: str | None = None
    about: About | None = None


def mismatch(have: Typed, want: Type, scope: Scope, what: str = "") -> Mismatch:
    """Explain that `have` does not fit `want`. `what` names the place in the message, for example `timeout`."""
    special = (
        _wrong_point(have, want)
        or _wrong_unit(have, want, what)
        or _wrong_text(have, want, scope)
        or _wrong_count(have, want, scope)
        or _wrong_field(have, want)
    )
    if special is not None:
        return special
    due = f"{what} is due {in_words(want)}" if what else f"expected {in_words(want)}"
    mend = f"write it in a longer text, such as: It is ${{{have.source}}}" if want == TEXT else ""
    return Mismatch("E013", f"{due}, this is {in_words(have.type)}", mend)


def _wrong_point(have: Typed, want: Type) -> Mismatch | None:
    source = have.source
    inner_have, inner_want = have.type, want
    if have.type.name == want.name == "list" and have.type.item and want.item:
        inner_have, inner_want = have.type.item, want.item
    pair = (inner_have.name, inner_want.name)
    single = inner_want is want
    if pair == ("place", "position"):
        mend = f"say above({source}, 60 m)" if single else "say above(...) for each point, or for the centre"
        about = OnGround(source) if single else None
        return Mismatch("E066", f"'{source}' is on the ground; {mend}", mend.removeprefix("say "), about=about)
    if pair == ("position", "place"):
        mended = f"ground({source})" if single else None
        mend = f"say ground({source})" if single else "say ground(...) for each point, or for the centre"
        return Mismatch("E066", f"'{source}' is in the air; {mend}", mend.removeprefix("say "), mended)
    return None


def _wrong_unit(have: Typed, want: Type, what: str) -> Mismatch | None:
    if have.literal == "number" and want.name in LIKELY:
        choices = unit_choices(want.name, have.source)
        subject = what or f"'{have.source}'"
        first = f"{have.source} {LIKELY[want.name][0]}" if len(LIKELY[want.name]) == 1 else None
        return Mismatch("E017", f"{subject} needs a unit: {choices}?", f"write {choices}", first)
    if have.literal == "quantity" and want.name in LIKELY:
        subject = f"{what} is" if what else "this is due"
        choices = unit_choices(want.name)
        said = f"{subject} {in_words(want)}, '{have.source}' is {in_words(have.type)}"
        return Mismatch("E017", said, f"for example {choices}")
    if have.literal == "quantity" and want.name in NUMBERS:
        number = have.source.rstrip("abcdefghijklmnopqrstuvwxyz%/ ")
        subject = what or f"'{have.source}'"
        said = f"{subject} is a bare number here, without a unit" if not what else f"{what} is a bare number"
        return Mismatch("E017", said, f"write {number}", number)
    return None


def _wrong_text(have: Typed, want: Type, scope: Scope) -> Mismatch | None:
    if have.literal != "text":
        return None
    word = have.const if isinstance(have.const, str) else have.source
    if want.name in ("enum", "literal") and want.values:
        near = closest(word, want.values)
        hint = f"; did you mean '{near}'?" if near else ""
        sure = sure_of(word, want.values)
        mended = f"'{sure}'" if sure else None
        said = f"'{word}' is never possible here{hint}"
        return Mismatch("E014", said, "one of " + ", ".join(want.values), mended)
    if word.isidentifier() and scope.type_of(word) is not None:
        said = f"expected {in_words(want)}, got the text '{word}'; did you mean {word}?"
        return Mismatch("E016", said, f"leave the quotes away: {word}", word)
    return Mismatch("E016", f"expected {in_words(want)}, got the text '{word}'", "")


def _wrong_count(have: Typed, want: Type, scope: Scope) -> Mismatch | None:
    if have.type.name == "list" and want.name != "list":
        if have.name in scope.roles:
            return Mismatch("E024", f"'{have.name}' is a list of agents; use for:", f"one of them: first({have.name})")
        return Mismatch("E013", f"expected {in_words(want)}, this is {in_words(have.type)}", "use for: or [0]")
    if want.name == "list" and have.type.name != "list":
        mended = f"[{have.source}]"
        return Mismatch("E013", f"expected {in_words(want)}, this is {in_words(have.type)}", f"write {mended}", mended)
    return None


def _wrong_field(have: Typed, want: Type) -> Mismatch | None:
    """Say of a record which of its fields does not fit."""
    if not have.type.name == want.name == "record":
        return None
    for name, due in want.fields.items():
        of = have.type.fields.get(name)
        if of is None:
            said = f"'{have.source}' has no '{name}', {in_words(want)} is due"
            return Mismatch("E013", said, f"fields: {', '.join(want.fields)}")
        if not fits(of, due):
            return Mismatch("E013", f"'{have.source}.{name}' is due {in_words(due)}, this is {in_words(of)}")
    return None


def is_measure(type_: Type) -> bool:
    """Return whether arithmetic may know the type: numbers, quantities, times."""
    return type_.name in NUMBERS or type_.name in QUANTITIES or type_ == ANY or type_.name == "time"
