"""What is said of whether a list has any item: by conditions on its length, and by what is read of it before the first step."""

import re
from collections.abc import Callable, Iterator, Mapping
from operator import eq, ge, gt, le, lt, ne
from types import MappingProxyType
from typing import Final

from formiga_bt.lang.model import Expr, Task
from formiga_bt.lang.walk import bare, plain_name

_LENGTH: Final = re.compile(r"\(?\s*len\(\s*([A-Za-z_]\w*)\s*\)\s*(==|!=|<=|>=|<|>)\s*(\d{1,6})\s*\)?")
_TURNED: Final = re.compile(r"\(?\s*(\d{1,6})\s*(==|!=|<=|>=|<|>)\s*len\(\s*([A-Za-z_]\w*)\s*\)\s*\)?")
_MIRROR: Final = {"<": ">", ">": "<", "<=": ">=", ">=": "<=", "==": "==", "!=": "!="}
_SIGNS: Final[Mapping[str, Callable[[int, int], bool]]] = MappingProxyType(
    {"<": lt, "<=": le, ">": gt, ">=": ge, "==": eq, "!=": ne}
)
_WALKED: Final = re.compile(r"(?:reverse|range\(\s*len|range\(\s*0\s*,\s*len)\(\s*([A-Za-z_]\w*)\s*\)+")
_ITEM: Final = re.compile(
    r"(?:\b(?:first|last|min|max)\(\s*|\bnearest\([^()]*,\s*)([A-Za-z_]\w*)\s*\)|\b([A-Za-z_]\w*)\[\s*\d+\s*\]"
)


def says_filled(source: str) -> Iterator[tuple[str, bool | None, bool | None]]:
    """Iterate over the lists whose length a condition tells of, and how it turns out with items and without (None = either).

    Of `a and b` each part can only make it false, of `a or b` only true.
    """
    for word, fixed in ((" and ", False), (" or ", True)):
        if word in source:
            if not any(other in source for other in {" and ", " or ", " if ", "not "} - {word}):
                for part in source.split(word):
                    for name, *ends in says_filled(part):
                        filled, empty = (end if end is fixed else None for end in ends)
                        yield name, filled, empty
            return
    found = _LENGTH.fullmatch(source.strip())
    turned = _TURNED.fullmatch(source.strip())
    if found is not None:
        yield found[1], *_ends(found[2], int(found[3]))
    elif turned is not None:
        yield turned[3], *_ends(_MIRROR[turned[2]], int(turned[1]))


def _ends(sign: str, number: int) -> tuple[bool | None, bool | None]:
    """Return how `len(x) SIGN number` turns out for a list with items, and for an empty one."""
    holds = _SIGNS[sign]
    some = {holds(length, number) for length in (1, number - 1, number, number + 1) if length > 0}
    return (next(iter(some)) if len(some) == 1 else None), holds(0, number)


def walked(source: str) -> str:
    """Return the list by whose items a `for` goes: `posts` of `posts`, `reverse(posts)` and `range(len(posts))`; else ""."""
    found = _WALKED.fullmatch(source.strip())
    return found[1] if found is not None else source.strip() if source.strip().isidentifier() else ""


def filled_at_start(task: Task) -> frozenset[str]:
    """Return the lists that surely have an item when a task's steps begin: vars or roles read one of them before."""
    given = [expr for role in task.roles.values() for expr in (role.near, role.prefer, role.id) if expr is not None]
    found = {name for expr in (*given, *task.vars.values()) for name in _read_from(expr)}
    found |= {plain_name(role.near) for role in task.roles.values() if role.near is not None and role.count}
    return frozenset(found & task.params.keys())


def _read_from(expr: Expr) -> Iterator[str]:
    source = bare(expr)
    if " if " not in source:
        yield from (match[1] or match[2] for match in _ITEM.finditer(source))
