"""W105: an item that a list does not have in some run: one past the end, the next of the last, number -1, the first of none.

An item that is not there ends the task (`cannot_compute`), and nothing catches that. Said only where no condition of the body
asks about what the number is made of.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping

from formiga_bt.lang.checks.ranges import Words
from formiga_bt.lang.expr.tokens import Parsed
from formiga_bt.lang.model import Expr, For, Set, Step
from formiga_bt.lang.walk import bare, children, conditions

_ENDS = ("first", "last")


class Items:
    """What is known of numbers of items in one body.

    Args:
        vars_: of the task; none of a subtree.
        steps: of the body.
    """

    def __init__(self, vars_: Mapping[str, Expr], steps: Iterable[Step]) -> None:
        self._walked: dict[str, set[str]] = {}
        """Loop name -> the lists that it goes over, without blanks."""
        self._negative: set[str] = set()
        """Vars that hold a number below zero at some time."""
        self._asked: set[str] = set()
        self._told = ""
        given = [*vars_.items()]
        for step in _all(steps):
            if isinstance(step, For):
                for name, expr in step.lists.items():
                    self._walked.setdefault(name, set()).add(_plain(bare(expr)))
            given += step.assign.items() if isinstance(step, Set) else ()
            for cond in conditions(step):
                self._asked |= {read.name for read in cond.reads}
                self._told += _plain(cond.source) + "\n"
        for name, expr in given:
            if expr.is_const and isinstance(expr.const, int) and expr.const < 0:
                self._negative.add(name)

    def missing(self, node: ast.AST, parsed: Parsed) -> Words | None:
        """Return what is wrong with an item that a part of an expression reads."""
        if _has_condition(parsed.root):
            return None
        match node:
            case ast.Subscript(value=items, slice=index):
                return self._of_choice(items, parsed) or self._number(items, index, parsed)
            case ast.Call(func=ast.Name(id=name), args=[items]) if parsed.token(name).text in _ENDS:
                return self._of_choice(items, parsed)
            case _:
                return None

    def _of_choice(self, items: ast.AST, parsed: Parsed) -> Words | None:
        call = items.func if isinstance(items, ast.Call) else None
        if (
            not isinstance(call, ast.Name)
            or parsed.token(call.id).text != "where"
            or _plain(parsed.text(items)) in self._told
        ):
            return None
        what = "perhaps no item is chosen, and then there is no first one"
        return what, "keep the choice with set, and check: len(...) > 0 before"

    def _number(self, items: ast.AST, index: ast.AST, parsed: Parsed) -> Words | None:
        base, more = _sum(index, parsed)
        text = parsed.text(items)
        if base is None:
            return None
        if _plain(parsed.text(base)) == _plain(f"len({text})") and more >= 0:
            return f"this is past the end: the last item of '{text}' is [len({text}) - 1]", f"last({text})"
        name = parsed.token(base.id).text if isinstance(base, ast.Name) else ""
        if not name or name in self._asked:
            return None
        if more > 0 and self._walked.get(name) == {_plain(f"range(len({text}))")}:
            what = f"'{parsed.text(index)}' is past the end of '{text}' when '{name}' is the last"
            return what, f"go over range(len({text}) - {more}), or add when: {parsed.text(index)} < len({text})"
        if more == 0 and name in self._negative:
            return f"'{name}' may be below zero, and no item has such a number", f"check: {name} >= 0 before"
        return None


def _sum(node: ast.AST, parsed: Parsed) -> tuple[ast.AST | None, int]:
    """Return what a number is made of, and the constant that is added to it."""
    if not isinstance(node, ast.BinOp):
        return node, 0
    right = parsed.token(node.right.id) if isinstance(node.right, ast.Name) else None
    if right is None or not isinstance(right.value, int) or not isinstance(node.op, ast.Add | ast.Sub):
        return None, 0
    return node.left, right.value if isinstance(node.op, ast.Add) else -right.value


def _has_condition(node: ast.AST) -> bool:
    return any(isinstance(part, ast.IfExp | ast.BoolOp) for part in ast.walk(node))


def _plain(source: str) -> str:
    return "".join(source.split())


def _all(steps: Iterable[Step]) -> Iterator[Step]:
    for step in steps:
        yield step
        yield from _all(children(step))
