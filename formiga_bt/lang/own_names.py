"""Names that an author may not give: what the language itself brings."""

from typing import Final

from formiga_bt.lang.expr.helpers import STANDARD
from formiga_bt.lang.expr.tokens import is_readable
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems

BUILT_IN: Final = frozenset({"base", "task", "now", "site", "error", "abort", "result", "agent"})
"""Names that no author may define."""


def why_taken(name: str) -> str:
    """Return why no author may give a name, in words; empty if it is free."""
    if name in BUILT_IN:
        return f"'{name}' is a built-in name"
    if name in STANDARD.reserved():
        return f"'{name}' is a helper; a name of your own would hide it"
    if not is_readable(name):
        return f"no expression can read '{name}': it is a word of expressions"
    return ""


def is_free(at: Scalar, problems: Problems) -> bool:
    """Report E018 for a name that is built in, a helper's or a word of expressions; return whether it may be defined."""
    why = why_taken(at.text)
    if why:
        problems.add("E018", at.mark, why, "choose another name" if is_readable(at.text) else f"call it {at.text}_")
    return not why
