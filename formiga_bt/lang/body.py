"""Names while a body is read: what is visible here, what may be unset, what is never used.

A body is the steps of a task or of a subtree. `flow` is the part that depends on the path (definite assignment);
`Body` holds the rest and compiles every value and condition of the body, so that reads are counted in one place.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from operator import is_
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Diagnostic, Fix, Mark, UnknownName
from formiga_bt.base.units import format_number
from formiga_bt.lang.checks.outside import warn_outside
from formiga_bt.lang.expr.interpolation import holes
from formiga_bt.lang.expr.scope import MaybeUnset
from formiga_bt.lang.expressions import Scope, compile_bare, compile_cond, compile_expr, compile_value, compile_words
from formiga_bt.lang.flow import Around, Flow, NamedValue
from formiga_bt.lang.model import Expr, Step
from formiga_bt.lang.own_names import why_taken
from formiga_bt.lang.records import carried, error_of
from formiga_bt.lang.request.binding import never
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.text.reading import Problems, did_you_mean
from formiga_bt.lang.text.synonyms import nearest, surely
from formiga_bt.lang.types import AGENT, ANY, DURATION, PERCENT, Type
from formiga_bt.lang.world import Resolver, World
from formiga_bt.lang.written import saves, scalars

_FRACTION: Final = re.compile(r"(?<![\w.])(0?\.\d{1,6}|1(?:\.0{1,6})?)\s*%")
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class Body:
    """One task or subtree being read."""

    def __init__(self, world: World, problems: Problems, resolve: Resolver) -> None:
        self.world = world
        self.problems = problems
        self.resolve = resolve
        self.names: dict[str, NamedValue] = {}
        self.agents: dict[str, tuple[str, ...]] = {}
        """Roles and params of type agent -> their agent types (empty = any)."""
        self.lists: dict[str, int] = {}
        """Roles with a count."""
        self.items: dict[str, tuple[str, ...]] = {}
        """Loop names -> the roles or agent params that their list is made of."""
        self.lengths: dict[str, int] = {}
        """Lists of a known number of items: vars that no step assigns."""
        self.tightened: Mapping[str, float] = {}
        """The limits of flight that the task makes stricter, named as in `AgentType.limits`."""
        self.heights: dict[str, str] = {}
        """Names that are heights at which an agent of the body flies -> that agent's name."""
        self.around: Around | None = None
        self.loop: Mark | None = None
        """The nearest loop, whatever stands between."""
        self.bounded = 0
        """How many steps around this one are sure to end it: time-outs, guards, races."""
        self.volatile: frozenset[str] = frozenset()
        """Names that may be written while a live condition of this point is watched."""
        self.watched: frozenset[str] | None = None
        """For the checks of a reactive step: what may be written while they are watched; None elsewhere."""
        self.gone: dict[str, tuple[str, str, str]] = {}
        """Names that had a value in a loop only -> code, message and help for a use outside."""
        self.optional: frozenset[str] = frozenset()
        self.vars: frozenset[str] = frozenset()
        self.every: dict[str, NamedValue] = {}
        """All saved names so far, on whatever path."""
        self.later: dict[str, Mark] = {}
        self.used: set[str] = set()
        self.needs: dict[str, dict[str, None]] = {}
        self.extra: dict[str, Type] = {}
        self.flow = Flow()
        self._seen: tuple[list[Any], Scope] | None = None
        """What the last scope was made of, and that scope."""
        self.dropped = False
        """A step could not be read: what follows from the order of the steps is not known."""

    # --- names -------------------------------------------------------------------------------------------------

    def define(self, name: str, named: NamedValue, optional: bool = False) -> None:
        """Add a param, var or role."""
        self.names[name] = named
        if why_taken(name):
            self.used.add(name)  # refused already
        if optional:
            self.optional |= {name}

    def need(self, agent: str, action: str) -> None:
        """Record that the body orders `action` of a role or agent param, or of the items of a list of them."""
        for owner in self.items.get(agent, (agent,)):
            self.needs.setdefault(owner, {})[action] = None

    def save(self, at: Scalar, of: Type) -> str:
        """Define a saved name from here on; report E018 if it is taken."""
        name = at.text
        named = NamedValue(of, at.mark, "saved")
        before = len(self.problems.found)
        old = self.names.get(name)
        first = self.every.get(name)
        if old is not None:
            self.problems.add(
                "E018",
                at.mark,
                f"'{name}' is a {old.origin} already; first at {old.mark.said}",
                "choose another name",
            )
        elif name in self.flow.taken:
            where = (self.flow.saved[name].mark if name in self.flow.saved else at.mark).said
            self.problems.add("E018", at.mark, f"'{name}' is saved twice; first at {where}", "choose another name")
        elif first is not None and ANY not in (first.type, of) and first.type != of:
            what = f"'{name}' is saved with another type at {first.mark.said}"
            self.problems.add("E018", at.mark, what, "exclusive branches may share a name if the types agree")
        if len(self.problems.found) > before:
            self.used.add(name)
        self.every.setdefault(name, named)
        self.flow.saved[name] = named
        self.flow.taken |= {name}
        self.flow.sure |= {name}
        return name

    def count(self, node: Node, but: Collection[Mark] = ()) -> None:
        """Count the names in a node that cannot be read as used, so that one mistake is one diagnostic.

        `but`: where names stand that are not used there.
        """
        for scalar in scalars(node):
            if scalar.mark not in but:
                self.used.update(_WORD.findall(scalar.text))

    def drop(self, node: Node) -> None:
        """Give up on a step: its names count as used and as saved, so that one mistake is one diagnostic."""
        self.dropped = True
        self.count(node)
        for at in saves(node):
            if at.text not in self.flow.saved:
                named = NamedValue(ANY, at.mark, "saved")
                self.flow.saved[at.text] = named
                self.every.setdefault(at.text, named)
            self.flow.sure |= {at.text}
            self.used.add(at.text)

    @contextmanager
    def with_names(self, more: Mapping[str, Type]) -> Iterator[None]:
        """Make built-in names such as `error` or `result` visible in a block."""
        before, self.extra = self.extra, {**self.extra, **more}
        try:
            yield
        finally:
            self.extra = before

    @contextmanager
    def with_error(self, failed: Iterable[Step]) -> Iterator[None]:
        """Make `error` visible, the failure of one of these steps, with what they carry; nothing is known of it yet."""
        values = carried(failed)
        for name, of in values.items():
            typed = sorted((one for one in of if one.type != ANY), key=lambda one: (one.mark.file, one.mark.line))
            other = next((one for one in typed if one.type != typed[0].type), None)
            if other is not None:
                what = f"'{name}' is carried as {other.type} here and as {typed[0].type} at {typed[0].mark.said}"
                self.problems.add("E018", other.mark, what, "choose another name for one of them")
        self._forget_error()
        with self.with_names({"error": error_of(values)}):
            yield
        self._forget_error()

    def _forget_error(self) -> None:
        self.flow.sure = frozenset(name for name in self.flow.sure if not name.startswith("error."))

    # --- compiling ---------------------------------------------------------------------------------------------

    def scope(self) -> Scope:
        """Return the scope of this point; the same one as long as nothing is defined or saved."""
        here = [*self.names, *self.names.values(), *self.flow.saved, *self.flow.saved.values()]
        here += [self.flow.sure, self.optional, *self.extra, *self.extra.values(), *self.agents, self.lengths]
        if self._seen is None or len(here) != len(self._seen[0]) or not all(map(is_, here, self._seen[0])):
            self._seen = (here, self._scope())  # the very same things: equal ones may differ in what equality ignores
        return self._seen[1]

    def _scope(self) -> Scope:
        names = {name: named.type for name, named in self.names.items()}
        for name, named in self.flow.saved.items():
            names.setdefault(name, named.type)
        names.update(self.extra)
        doubtful = (self.optional | self.flow.saved.keys()) - self.flow.sure
        unset = {name: self._why_unset(name) for name in names if name in doubtful and self.is_unsure(name)}
        data = names["error"].fields.get("data") if "error" in self.extra else None
        fields = [f"error.data.{name}" for name in data.fields] if data is not None else []
        unset.update({name: MaybeUnset("E067") for name in fields if name not in self.flow.sure})
        return Scope(
            names,
            agent_types=self.world.catalogue.types,
            roles=frozenset(self.agents),
            maybe_unset=unset,
            site=self.world.site,
            counts={**self.lengths, **{name: count for name, count in self.lists.items() if count}},
        )

    def tell(self, mark: Mark) -> None:
        """Tell who watches the reading what is visible at a place."""
        if self.world.watch is not None:
            self.world.watch(mark, self.scope())

    def is_unsure(self, name: str) -> bool:
        """Return whether a name may be without value here."""
        if name in self.flow.sure or name in self.extra:
            return False
        return name in self.optional or (name in self.flow.saved and name not in self.names)

    def _why_unset(self, name: str) -> MaybeUnset:
        return MaybeUnset("E067") if name in self.optional else MaybeUnset("E019", self.flow.saved[name].mark.said)

    def value(self, node: Node, expected: Type, what: str = "", *, optional: bool = False) -> Expr:
        """Compile a value of an expected type."""
        expr, found = compile_value(node, self.scope(), expected, what=what, optional=optional)
        if not found:
            warn_outside(expr, node, self.world.site, self.problems)
        return self._took(expr, found, node)

    def span(self, node: Node, what: str) -> Expr:
        """Compile a duration that cannot be below zero."""
        return self.not_negative(self.value(node, DURATION, what), what)

    def not_negative(self, expr: Expr, what: str) -> Expr:
        """Report E062 for a constant duration below zero, and for a percent that is none."""
        wrong = never(expr.type, expr.const) if expr.is_const and expr.type in (DURATION, PERCENT) else ""
        if wrong:
            self.problems.add("E062", expr.mark, f"'{what}' {wrong}")
        return expr

    def text(self, node: Node, what: str) -> Expr:
        """Compile a text for people, which may hold `${...}` of any type."""
        expr, found = compile_words(node, self.scope(), what)
        return self._took(expr, found, node)

    def cond(self, node: Node, what: str, *, live: frozenset[str] | None = None) -> Expr | None:
        """Compile a condition; None (reported) if it is no scalar.

        `live`: it is watched, and these names may be written meanwhile besides those of the branches beside it.
        """
        if not isinstance(node, Scalar):
            self.problems.add("E008", node.mark, f"'{what}' must be a condition, such as: drone.battery > 30 %")
            return None
        expr, found = compile_cond(node, self.scope(), None if live is None else live | self.volatile)
        if expr.is_const and not found:
            what = f"this condition is always {'true' if expr.const else 'false'}"
            self.problems.add("E044", node.mark, what, "say what it depends on, or leave it away")
        return self._took(expr, found, node)

    def bare(self, node: Node, what: str) -> Expr | None:
        """Compile one bare expression of any type; None (reported) if it is no scalar or cannot be compiled."""
        if not isinstance(node, Scalar):
            self.problems.add("E008", node.mark, f"'{what}' must be an expression, such as: reply.answer")
            self.count(node)
            return None
        expr, found = compile_bare(node, self.scope(), what)
        self._took(expr, found, node)
        return None if found else expr

    def agent(self, at: Scalar, name: str) -> Expr:
        """Compile the bare name of a role or agent param found at the start of a scalar."""
        expr, found = compile_expr(name, at, 0, self.scope(), AGENT)
        return self._took(expr, found, at)

    def _took(self, expr: Expr, found: Iterable[Diagnostic], node: Node) -> Expr:
        self.problems.extend(self._relabel(d) for d in found if not self._is_told(d))
        self.used.update(read.name for read in expr.reads)
        self._check_released(expr)
        if isinstance(node, Scalar):
            self._warn_fractions(node, whole=expr.type.name in ("percent", "bool"))
        if found:
            for scalar in scalars(node):
                self.used.update(_WORD.findall(scalar.text))
            self.used.update(d.about.meant for d in found if isinstance(d.about, UnknownName))
        return expr

    def _check_released(self, expr: Expr) -> None:
        """Report E023 for the first role that is read after its release."""
        for read in expr.reads:
            if read.name in self.flow.released:
                where = self.flow.released[read.name].said
                what = f"'{read.name}' is no longer held here: released at {where}"
                self.problems.add("E023", expr.mark, what, "release it last")
                return

    def _warn_fractions(self, at: Scalar, *, whole: bool) -> None:
        """Report W070 for a percent literal, in an expression or as a value, that looks like a fraction of one."""
        inside = [(0, len(at.text))] if whole else holes(at.text)
        spans = [] if isinstance(inside, int) else inside
        for match in _FRACTION.finditer(at.text):
            if float(match[1]) > 0 and any(start <= match.start() < end for start, end in spans):
                meant = f"{format_number(round(float(match[1]) * 100, 6))} %"
                mark = at.mark_at(match.start(), match.end())
                what = f"{match[0]} is nearly empty; did you mean {meant}?"
                self.problems.add("W070", mark, what, "percent is 0 to 100", Fix(mark, meant))

    def _is_told(self, diagnostic: Diagnostic) -> bool:
        """Return whether a name that no expression can read was refused where it is defined."""
        about = diagnostic.about
        return diagnostic.code == "E009" and isinstance(about, UnknownName) and about.name in self.names

    def _relabel(self, diagnostic: Diagnostic) -> Diagnostic:
        """Turn "unknown name" into "used before it is saved" where a later step saves it."""
        if diagnostic.code != "E010" or not isinstance(diagnostic.about, UnknownName):
            return diagnostic
        name = diagnostic.about.name
        if name in self.gone:
            code, what, help_ = self.gone[name]
            return replace(diagnostic, code=code, message=what, help=help_, fix=None, about=None)
        if name in self.later and name not in self.flow.saved:
            what = f"'{name}' is used here before it is saved ({self.later[name].said})"
            help_ = "save it in an earlier step"
            if self.loop is not None and self.later[name].line > self.loop.line:
                help_ = "what a round saves has no value in the next one; keep it in a var, with set"
            return replace(diagnostic, code="E019", message=what, help=help_, fix=None, about=None)
        return diagnostic

    # --- the end -----------------------------------------------------------------------------------------------

    def report_unused(self, own: Iterable[str], what: str) -> None:
        """Report W060 for each name of `own` that nothing read."""
        for name in own:
            if name not in self.used:
                self.problems.unused(self.names[name].mark, what, name)

    def report_unread(self) -> None:
        """Report W060 for each saved name that nothing read."""
        for name, named in self.every.items():
            if name not in self.used:
                self.problems.add("W060", named.mark, f"'{name}' is saved but never used", "remove save_as")

    def unknown_agent(self, at: Mark, name: str, also: Iterable[str] = ()) -> None:
        """Report E020 for a name that is no role, or E013 for one that is no agent."""
        if name in self.names or name in self.flow.saved:
            known = self.names.get(name) or self.flow.saved[name]
            if known.type != ANY:
                self.problems.add("E020", at, f"'{name}' is a {known.type}, not an agent", "name a role of agents:")
            return
        if name in self.gone:
            code, what, help_ = self.gone[name]
            self.problems.add(code, at, what, help_)
            return
        near = nearest(name, self.agents)
        self.used.add(near)
        names = [*self.agents, *(one for one in also if one not in self.agents)]
        guess = did_you_mean(name, self.agents if near else names)
        help_ = f"roles: {', '.join(names)}" if names else "declare it under agents:"
        meant = surely(name, names)
        self.problems.add("E020", at, f"no role is called '{name}'{guess}", help_, Fix(at, meant) if meant else None)
