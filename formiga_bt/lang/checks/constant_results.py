"""W098: an expression whose result is foregone: a call that does nothing, a comparison that is never true, a needless is_set.

Read from the text of the expressions of a task, wherever they stand. Nothing here needs values: what is computed from constants
is folded, and told, by the checker of expressions.
"""

import ast
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.items import Items
from formiga_bt.lang.checks.ranges import Ranges
from formiga_bt.lang.checks.reasons import no_code
from formiga_bt.lang.checks.repeats import bodies, parts_of
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.tokens import ExprSyntax, Parsed, parse_expression
from formiga_bt.lang.forms import FormField
from formiga_bt.lang.model import Ask, Call, Catalogue, Do, Expr, Param, Request, Sequence, Site, Step, Subtree, Task
from formiga_bt.lang.site.far import FAR_M
from formiga_bt.lang.text.reading import Problems

_TWO_PLACES: Final = ("zigzag", "line", "toward", "distance", "bearing", "midpoint")
"""Helpers from one place to another one."""
_TELLING: Final = tuple(f"{name}(" for name in (*_TWO_PLACES, "offset", "is_set", "first", "last"))
"""What an expression holds of which anything is to be said; most hold none of it, and are not read."""
_PLAIN: Final = (str, int, float, Mark, type(None))
"""What holds no expression."""


def check_foregone(task: Task, catalogue: Catalogue, site: Site | None, problems: Problems) -> None:
    """Report W098 for the expressions of a task and of the subtrees that it sees."""
    every = (*task.steps, *task.on_failure, *task.on_abort, *task.finally_)
    checks = _Foregone(
        reach_m(site), site is not None, catalogue, problems, Ranges(task.params, every), Items(task.vars, every)
    )
    for name, expr in task.vars.items():
        with problems.within("vars", name):
            checks.check(expr, {})
    with problems.within("agents"):
        for role in task.roles.values():
            checks.all_of(role, {})
    sure = _given(task.params)
    for name, steps in (
        ("steps", task.steps),
        ("on_failure", task.on_failure),
        ("on_abort", task.on_abort),
        ("finally", task.finally_),
    ):
        with problems.within(name):
            checks.steps(steps, sure)
    with problems.within("steps"):
        checks.stands(task)
    for subtree in task.subtrees.values():
        checks.ranges, checks.items = Ranges(subtree.params, subtree.steps), Items({}, subtree.steps)
        with problems.outermost(subtree.name, "steps"):
            checks.steps(subtree.steps, _given(subtree.params))


def reach_m(site: Site | None) -> float:
    """Return the distance of the two points of a site that are farthest apart; without a fence what flies at all."""
    corners = site.fence.corners if site is not None and site.fence is not None else ()
    found = [math.hypot(a.east_m - b.east_m, a.north_m - b.north_m) for a in corners for b in corners]
    return max(found, default=2 * FAR_M)


def _given(params: Mapping[str, Param]) -> dict[str, Mark]:
    return {p.name: p.mark for p in params.values() if not p.optional or p.default is not None}


class _Foregone:
    def __init__(
        self, reach: float, is_site: bool, catalogue: Catalogue, problems: Problems, ranges: Ranges, items: Items
    ) -> None:
        self.reach_m = reach
        self.is_site = is_site
        self.catalogue = catalogue
        self.problems = problems
        self.ranges = ranges
        self.items = items
        """These two of the body whose steps are looked at."""
        self.told: set[Mark] = set()

    # --- steps ---------------------------------------------------------------------------------------------------

    def steps(self, steps: tuple[Step, ...], sure: Mapping[str, Mark]) -> None:
        """Check steps that run in their order; `sure` are the names that are surely set, and where that was done."""
        known = dict(sure)
        for step in steps:
            with self.problems.within(step.title):
                self.own(step, known)
                for body in bodies(step):
                    self.steps(body, known)
                if isinstance(step, Sequence) and step.finally_:
                    self.steps(step.finally_, sure)
            saved = step.save_as if isinstance(step, Ask | Do | Call | Request) else ""
            if saved and step.when is None and not step.ignore_failure:
                known[saved] = step.mark

    def own(self, step: Step, sure: Mapping[str, Mark]) -> None:
        """Check what a step itself says."""
        for name in parts_of(step):
            value = getattr(step, name)
            if not isinstance(value, _PLAIN) and not (
                isinstance(value, tuple) and value and isinstance(value[0], Step)
            ):
                self.all_of(value, sure, step.form if isinstance(step, Ask) else ())

    def all_of(self, value: Any, sure: Mapping[str, Mark], form: tuple[FormField, ...] = ()) -> None:
        """Check the expressions in a part of the model; `form` belongs to the result that they read."""
        for expr in _expressions(value):
            self.check(expr, sure, form)

    def stands(self, task: Task) -> None:
        """Report W098 for a question about a machine that surely stands at its port: before its first command."""
        untouched = {role.name: role for role in task.roles.values() if not role.away and not role.is_list}
        for step in task.steps:
            if not isinstance(step, Do):
                return
            role = untouched.get(step.who.name)
            if role is None or step.when is None:
                return
            source = step.when.source.replace(" ", "")
            if source in (f"{role.name}.airborne", f"not{role.name}.airborne"):
                always = "true" if source.startswith("not") else "false"
                what = f"this is always {always}: '{role.name}' stands at its port when the task begins"
                help_ = f"take the condition away; or give '{role.name}' away: true, if it may be elsewhere"
                self.problems.add("W098", step.when.mark, what, help_)
            untouched.pop(step.who.name)

    # --- expressions ---------------------------------------------------------------------------------------------

    def check(self, expr: Expr, sure: Mapping[str, Mark], form: tuple[FormField, ...] = ()) -> None:
        """Report W098 for an expression."""
        source = expr.source
        is_condition = expr.type.name == "bool" and not expr.is_const
        if (not is_condition and "(" not in source and "[" not in source) or expr.mark in self.told:
            return
        spans = holes(source)
        found = [] if isinstance(spans, int) else [source[a + 2 : b - 1] for a, b in spans]
        for text in found or [source]:
            if not is_condition and "[" not in text and not any(word in text for word in _TELLING):
                continue
            try:
                parsed = parse_expression(text.strip())
            except ExprSyntax:
                continue
            nodes = list(ast.walk(parsed.root))
            missing = next((said for node in nodes if (said := self.items.missing(node, parsed))), None)
            if missing is not None:
                self.told.add(expr.mark)
                self.problems.add("W105", expr.mark, *missing)
                return
            what = next((said for node in nodes if (said := self._node(node, parsed, sure))), None)
            what = what or self.ranges.foregone(expr, parsed, form)
            if what is not None:
                self.told.add(expr.mark)
                self.problems.add("W098", expr.mark, *what)
                return

    def _node(self, node: ast.AST, parsed: Parsed, sure: Mapping[str, Mark]) -> tuple[str, str] | None:
        if isinstance(node, ast.Compare):
            return self._far(node, parsed) or _just_now(node, parsed) or _no_code(node, parsed)
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
            return None
        name = parsed.token(node.func.id).text
        args = [parsed.text(arg) for arg in node.args]
        if name == "offset" and len(node.args) == 1 and not node.keywords:
            return f"offset({args[0]}) is {args[0]} itself", "say how far: east=, north= or up="
        if name in _TWO_PLACES and len(args) > 1 and args[0] == args[1]:
            return f"{name} goes from '{args[0]}' to '{args[0]}'", "give it two places"
        if name == "is_set" and args and args[0] in sure:
            what = f"'{args[0]}' is always set here ({sure[args[0]].said}): is_set is always true"
            return what, "take it away; a step that may fail and go on has ignore_failure: true"
        return None

    def _far(self, node: ast.Compare, parsed: Parsed) -> tuple[str, str] | None:
        """Return what is wrong with a distance that is compared with one that no two places have."""
        sides = [node.left, *node.comparators]
        if len(sides) != 2:
            return None
        for one, other in (sides, sides[::-1]):
            if not (isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and isinstance(other, ast.Name)):
                continue
            token = parsed.token(other.id)
            if parsed.token(one.func.id).text != "distance" or token.unit_type != "distance":
                continue
            if float(token.value) > self.reach_m:
                reach = format_quantity("distance", float(round(self.reach_m)))
                where = f"this site is {reach} across" if self.is_site else f"nothing flies farther than {reach}"
                return f"no distance is ever {token.text}: {where}", "m or km?"
        return None


def _no_code(node: ast.Compare, parsed: Parsed) -> tuple[str, str] | None:
    """Return what is wrong with a reason code that is compared with a word that is none."""
    sides = [node.left, *node.comparators]
    if not any(parsed.text(one) == "error.code" for one in sides):
        return None
    words = [parsed.token(one.id) for side in sides for one in ast.walk(side) if isinstance(one, ast.Name)]
    for word in words:
        help_ = no_code(str(word.value)) if word.kind == "text" else ""
        if help_:
            return f"no failure has the code '{word.value}'", help_
    return None


def _just_now(node: ast.Compare, parsed: Parsed) -> tuple[str, str] | None:
    """Return what is wrong with `now == t`: time goes on, and nothing looks at just that moment."""
    sides = [one for one in (node.left, *node.comparators) if isinstance(one, ast.Name)]
    exact = any(isinstance(op, ast.Eq | ast.NotEq) for op in node.ops)
    if not exact or not any(parsed.token(one.id).text == "now" for one in sides):
        return None
    end = "never" if isinstance(node.ops[0], ast.Eq) else "always"
    return f"'{parsed.text(node)}' is {end} true: it is hardly ever just that moment", "compare with >= or <"


def _expressions(value: Any) -> Iterator[Expr]:
    if isinstance(value, Expr):
        yield value
    elif isinstance(value, Step | Subtree):
        return
    elif isinstance(value, tuple):
        for item in value:
            yield from _expressions(item)
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _expressions(item)
    elif not isinstance(value, _PLAIN) and isinstance(value, Struct):
        for name in parts_of(value):
            yield from _expressions(getattr(value, name))
