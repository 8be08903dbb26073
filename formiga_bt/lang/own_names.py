"""Names that an author may not give: what the language itself brings."""

from typing import Final

from formiga_bt.lang.expr.helpers import STANDARD
from formiga_bt.lang.expr.tokens import is_readable
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems

BUILT_IN: Final = frozenset({"base", "task", "now", "site", "error", "abort", "result", "agent"})
"""Names that no author may define."""


def is_free(at: Scalar, problems: Problems) -> bool:
    """Report E018 for a name that is built in, a helper's or a word of expressions; return whether it may be defined."""
    if at.text in BUILT_IN:
        problems.add("E018", at.mark, f"'{at.text}' is a built-in name", "choose another name")
        return False
    if at.text in STANDARD.reserved():
        problems.add(
            "E018", at.mark, f"'{at.text}' is a helper; a name of your own would hide it", "choose another name"
        )
        return False
    if not is_readable(at.text):
        what = f"no expression can read '{at.text}': it is a word of expressions"
        problems.add("E018", at.mark, what, f"call it {at.text}_")
        return False
    return True
