"""Check an expression: names, fields, types and units, then build its code bottom up.

One visit of Python's ast (see `tokens`), whitelisted node by node. Names that may be unset are narrowed by `is_set`
across `and`, `or`, `not` and `X if C else Y`. Called by `expressions`.
"""

import ast
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from formiga_bt.base.diagnostics import UnknownName
from formiga_bt.lang.expr.calls import BoundCall, bind, never_anywhere
from formiga_bt.lang.expr.daytime import TODAY
from formiga_bt.lang.expr.fleet_calls import type_of, why_no_type
from formiga_bt.lang.expr.helpers import Helper
from formiga_bt.lang.expr.item_calls import ITEM_NAME, item_calls_code
from formiga_bt.lang.expr.members import FLEET, fleet, read_of, type_read
from formiga_bt.lang.expr.operands import Operands
from formiga_bt.lang.expr.operators import (
    agent_field_code,
    any_field_code,
    call_code,
    is_there_code,
    item_code,
    name_code,
    point_field_code,
    record_field_code,
)
from formiga_bt.lang.expr.parts import dotted_name, poisoned, reads_of
from formiga_bt.lang.expr.scope import BUILT_INS, Scope, fields_of
from formiga_bt.lang.expr.tokens import Parsed
from formiga_bt.lang.expr.typed import (
    ExpressionProblems,
    Mismatch,
    Run,
    Typed,
    closest,
    constant,
    did_you_mean,
    sure_of,
)
from formiga_bt.lang.expr.typing_rules import in_words, literal
from formiga_bt.lang.model import Dependency
from formiga_bt.lang.types import ANY, BOOL, INT, NUMBER, Type

_FIELD_CODE: Final[Mapping[str, Callable[[Run, str], Run]]] = MappingProxyType(
    {
        "agent": agent_field_code,
        "any": any_field_code,
        "place": point_field_code,
        "position": point_field_code,
    }
)


class ExpressionChecker(Operands):
    """Checks one expression in a scope; problems go to `problems`."""

    def __init__(
        self, parsed: Parsed, scope: Scope, problems: ExpressionProblems, *, may_be_absent: bool = False
    ) -> None:
        super().__init__(parsed, scope, problems)
        self._told: set[str] = set()
        self._may_be_absent = may_be_absent
        self._item: Typed | None = None
        """The list over whose items the visit goes; None outside such a call."""

    def check(self) -> Typed:
        """Return the whole expression, typed and compiled."""
        root = self.parsed.root
        if self._may_be_absent and isinstance(root, ast.Name):
            self.known_set = frozenset({self.parsed.token(root.id).text})
        return self.visit(root)

    def visit(self, node: ast.expr) -> Typed:
        """Check a node, whitelisted by its kind."""
        match node:
            case ast.Name():
                return self._leaf(node)
            case ast.Attribute():
                return self._field(node)
            case ast.Subscript():
                return self._index(node)
            case ast.BinOp():
                return self.binary(node)
            case ast.UnaryOp():
                return self.unary(node)
            case ast.BoolOp():
                return self.logic(node)
            case ast.Compare():
                return self.comparison(node)
            case ast.IfExp():
                return self.choice(node)
            case ast.List():
                return self.items(node)
            case ast.Call():
                return self._call(node)
            case ast.Tuple():
                return self.bad(node, "E009", "a list stands in square brackets", f"write [{self.parsed.text(node)}]")
            case _:
                return self.bad(node, "E009", f"'{self.parsed.text(node)}' is not part of the language")

    def _leaf(self, node: ast.Name) -> Typed:
        token = self.parsed.token(node.id)
        match token.kind:
            case "number":
                type_ = INT if isinstance(token.value, int) else NUMBER
                return self.part(node, type_, constant(token.value), const=token.value, literal="number")
            case "quantity":
                type_ = Type(token.unit_type)
                return self.part(node, type_, constant(token.value), const=token.value, literal="quantity")
            case "bool":
                return self.part(node, BOOL, constant(token.value), const=token.value)
            case "text":
                type_ = literal(str(token.value))
                return self.part(node, type_, constant(token.value), const=token.value, literal="text")
        return self._name(node, token.text)

    def _name(self, node: ast.Name, name: str) -> Typed:
        if self._item is not None and name == ITEM_NAME:
            return self.part(node, self._item.type.item or ANY, name_code(name), self._item.reads)
        type_ = self.scope.type_of(name)
        if type_ is None:
            return self._unknown_name(node, name)
        self._check_set(node, name)
        return self.part(node, type_, name_code(name), (Dependency(name),), name=name)

    def _check_set(self, node: ast.AST, name: str) -> None:
        """Report a name, or a field such as `error.data.spot`, that may have no value here; each once."""
        reason = self.scope.maybe_unset.get(name)
        if reason is not None and name not in self.known_set and name not in self._told:
            self._told.add(name)
            what = f"'{name}' may be missing" if reason.code == "E067" else f"'{name}' may be unset here"
            why = f"it is saved only when {reason.saved} ran" if reason.saved else f"test is_set({name})"
            self.bad(node, reason.code, f"{what}: {why}", f"for example: is_set({name}) and ...")

    def _in_site(self) -> Mapping[str, str]:
        """Return how the places, ports and regions of the site are read, by name."""
        site = self.scope.site
        groups = {"regions": site.regions, "ports": site.ports, "places": site.places} if site is not None else {}
        return {name: f"site.{group}.{name}" for group, names in groups.items() for name in names}

    def _unknown_name(self, node: ast.Name, name: str) -> Typed:
        if self.scope.helpers.forms(name) or name == "is_set":
            return self.bad(node, "E010", f"'{name}' is a helper: call it", f"write {name}(...)")
        if name in BUILT_INS:
            return self._before_task(node, name)
        of_site = self._in_site()
        near = closest(name, self.scope.visible())
        if near and name not in of_site:
            message = f"unknown name '{name}'; did you mean '{near}'?"
            sure, about = sure_of(name, self.scope.visible()), UnknownName(name, near)
            return self.bad(node, "E010", message, f"write {near}", mended=sure, about=about)
        meant = of_site.get(sure_of(name, of_site) or "")
        if meant:
            said, help_ = (
                f"unknown name '{name}'; did you mean {meant}?",
                f"write {meant}; a text stands in quotes: '{name}'",
            )
            return self.bad(node, "E010", said, help_, mended=meant, about=UnknownName(name))
        legal = ", ".join(self.scope.visible()[:12])
        help_ = f"names here: {legal}; a text stands in quotes: '{name}'"
        return self.bad(node, "E010", f"unknown name '{name}'", help_, about=UnknownName(name))

    def _field(self, node: ast.Attribute) -> Typed:
        base = self.visit(node.value)
        name = self.parsed.token(node.attr).text
        if poisoned(base):
            return self.poison(node, base.reads)
        fields = fields_of(base.type, self.scope.agent_types)
        if fields is None:
            return self._no_field(node, base, name, ())
        is_open = base.type.name == "any" or (base.type.name == "names" and self.scope.site is None)
        if is_open:
            fields = {name: base.type.item or ANY}
        elif name not in fields:
            return self._no_field(node, base, name, tuple(fields))
        type_ = fields[name]
        reads = base.reads
        if base.type.name in ("agent", "any"):
            reads = self._and_fields(reads, name)
        known = self._of_site(base.source, name)
        if known is not None:
            return self.part(node, type_, constant(known), reads, const=known)
        self._check_set(node, dotted_name(node, self.parsed))
        code = _FIELD_CODE.get(base.type.name, record_field_code)
        return self.part(node, type_, code(base.run, name), reads)

    def _and_fields(self, reads: tuple[Dependency, ...], name: str) -> tuple[Dependency, ...]:
        """Return what is read of agents: what they are found by, and this field of each of them."""
        owners = {read.name for read in reads if not read.field and (type_read(read) or self._holds_agents(read.name))}
        return tuple(dict.fromkeys((*reads, *(Dependency(owner, name) for owner in sorted(owners)))))

    def _of_site(self, owner: str, name: str) -> object | None:
        """Return the value of `site.places.camp` where the site file is known."""
        site = self.scope.site
        if site is None or self.scope.type_of("site") is None or "site" in self.scope.names:
            return None
        match owner:
            case "site.ports":
                return site.ports[name].at if name in site.ports else None
            case "site.places":
                return site.places.get(name)
            case "site.regions":
                return site.regions.get(name)
        return None

    def _no_field(self, node: ast.Attribute, base: Typed, name: str, fields: tuple[str, ...]) -> Typed:
        token = self.parsed.token(node.attr)
        if base.type.name == "list" and base.name in self.scope.roles:
            return self.bad(
                node, "E024", f"'{base.name}' is a list of agents; use for:", f"one of them: first({base.name})"
            )
        if base.type.name in ("record", "names"):
            owner = f"'{base.source}'"
        else:
            owner = str(base.type) if base.type.name in ("agent", "list") else in_words(base.type)
        message = f"{owner} has no field '{name}'{did_you_mean(name, fields)}"
        mend = "fields: " + ", ".join(fields) if fields else "it has no fields"
        self.problems.report("E011", token.start, token.end, message, mend, mended=sure_of(name, fields))
        return self.poison(node, base.reads)

    def _holds_agents(self, name: str) -> bool:
        type_ = self.scope.type_of(name)
        while type_ is not None and type_.name == "list":
            type_ = type_.item
        return type_ is not None and type_.name in ("agent", "record", "any")

    def _index(self, node: ast.Subscript) -> Typed:
        base = self.visit(node.value)
        if isinstance(node.slice, ast.Tuple):
            return self.bad(node, "E009", "a list is read one item at a time", "write list[0]", reads=base.reads)
        index = self.visit(node.slice)
        if poisoned(base, index):
            return self.poison(node, reads_of([base, index]))
        if base.type.name not in ("list", "any"):
            is_field = index.literal == "text" and str(index.const).isidentifier()
            mend = f"write {base.source}.{index.const}" if is_field else ""
            return self.bad(node, "E013", f"{in_words(base.type)} has no items", mend, reads=base.reads)
        if index.type not in (INT, ANY):
            self.wrong(index, Mismatch("E013", f"an item's number is due an int, this is {in_words(index.type)}"))
            return self.poison(node, reads_of([base, index]))
        count = self.scope.counts.get(base.name)
        if index.is_const and isinstance(index.const, int) and index.const < 0:
            counted = (
                f"last({base.source})" if index.const == -1 else f"{base.source}[len({base.source}) - {-index.const}]"
            )
            what = f"items are counted from 0, there is no [{index.const}]"
            return self.bad(node, "E013", what, f"write {counted}", mended=counted, reads=base.reads)
        if count is not None and index.is_const and not index.const < count:
            what = f"'{base.name}' has {count} item{'' if count == 1 else 's'}, there is no [{index.const}]"
            mend = (
                f"the first is {base.name}[0], the last {base.name}[{count - 1}]"
                if count > 1
                else f"write {base.name}[0]"
            )
            return self.bad(node, "E013", what, mend, reads=base.reads)
        return self.made(node, base.type.item or ANY, item_code(base.run, index.run), [base, index])

    def _call(self, node: ast.Call) -> Typed:
        if not isinstance(node.func, ast.Name):
            said = "only helpers are called; values have fields, no methods"
            return self.bad(node, "E012", said, "helpers: " + ", ".join(self.scope.helpers.names()[:8]) + ", ...")
        token = self.parsed.token(node.func.id)
        if token.text == "is_set":
            return self._is_set(node)
        if token.text == FLEET and self.scope.helpers.forms(FLEET):
            return self._fleet(node)
        if any(form.each for form in self.scope.helpers.forms(token.text)):
            return self._over_items(node, self.scope.helpers.forms(token.text)[0])
        positional = [self.visit(argument) for argument in node.args]
        keywords: dict[str, Typed] = {}
        for keyword in node.keywords:
            value = self.visit(keyword.value)
            assert keyword.arg is not None, "'**' is no token of the language"
            keywords[self.parsed.token(keyword.arg).text] = value
        parts = [*positional, *keywords.values()]
        forms = self.scope.helpers.forms(token.text)
        if token.kind != "name" or not forms:
            return self._unknown_helper(node, token.text, reads_of(parts))
        bound = bind(forms, positional, keywords, self.scope)
        if not isinstance(bound, BoundCall):
            part, why = bound
            if part is None:
                return self.bad(node, why.code, why.message, why.mend, reads=reads_of(parts))
            self.wrong(part, why)
            return self.poison(node, reads_of(parts))
        run = call_code(bound.helper.run, [arg.run for arg in bound.args], needs_env=bound.helper.needs_env)
        first = bound.args[0] if bound.args else None
        why_not = bound.helper.refuses(first.const) if bound.helper.refuses and first and first.is_const else ""
        if why_not:
            return self.bad(node.args[0] if node.args else node, "E013", why_not, reads=reads_of(parts))
        why_not = never_anywhere(bound)
        if why_not:
            return self.bad(node, "E013", f"this never has a value: {why_not}", reads=reads_of(parts))
        if bound.helper.looks_at and not poisoned(*bound.args):
            reads = self._and_fields(reads_of(bound.args), bound.helper.looks_at)
            return self.part(node, bound.returns, run, reads)
        if bound.helper.daily and not poisoned(*bound.args):
            return self.part(node, bound.returns, run, (*reads_of(bound.args), TODAY))
        if bound.helper.of_task and not poisoned(*bound.args):
            if "task" not in self.scope.built_ins:
                return self._before_task(node, bound.helper.name)
            return self.part(node, bound.returns, run, (*reads_of(bound.args), Dependency("task")))
        return self.made(node, bound.returns, run, bound.args, pure=not bound.helper.needs_env)

    def _before_task(self, node: ast.AST, name: str) -> Typed:
        said = f"'{name}' has no value here: this is read before there is a task"
        return self.bad(node, "E027", said, f"it may read {' and '.join(self.scope.built_ins)}")

    def _over_items(self, node: ast.Call, helper: Helper) -> Typed:
        """Check a call whose second argument is read for each item of the first."""
        inner = [*node.args[1:], *(keyword.value for keyword in node.keywords)]
        names = [self.parsed.token(one.arg).text for one in node.keywords if one.arg is not None]
        if len(node.args) not in (1, 2) or len(inner) != 1 or names not in ([], [helper.args[1].name]):
            such = (
                f"such as: {helper.name}(finds, {helper.args[1].name}=...)"
                if helper.name == "sort"
                else helper.signature
            )
            return self.bad(node, "E012", f"{helper.name} takes a list, and what is read of each item", such)
        if self._item is not None:
            said = f"{helper.name} cannot stand in what is read of each item"
            return self.bad(node, "E012", said, "save it before, with set")
        if self.scope.type_of(ITEM_NAME) is not None:
            said = f"'{ITEM_NAME}' is an item of the list here, and a name of this task"
            return self.bad(node, "E012", said, "call it something else")
        items = self.visit(node.args[0])
        if items.type.name not in ("list", "any"):
            self.wrong(items, Mismatch("E013", f"{helper.name} is due a list, this is {in_words(items.type)}"))
            return self.poison(node, items.reads)
        self._item, self.of_items = items, True
        value = self.visit(inner[0])
        self._item, self.of_items = None, False
        bound = bind((helper,), [items, value], {}, self.scope)
        if not isinstance(bound, BoundCall):
            part, why = bound
            self.wrong(part or items, why)
            return self.poison(node, reads_of([items, value]))
        run = item_calls_code(helper.run, items.run, value.run)
        return self.made(node, bound.returns, run, [items, value], pure=False)

    def _fleet(self, node: ast.Call) -> Typed:
        argument = node.args[0] if len(node.args) == 1 and not node.keywords else None
        token = self.parsed.token(argument.id) if isinstance(argument, ast.Name) else None
        text = token.value if token is not None and token.kind == "text" else None
        written = self.parsed.text(argument) if argument is not None else ""
        why = why_no_type(argument, written, None if text is None else str(text), self.scope)
        if why is not None:
            return self.bad(argument or node, why.code, why.message, why.mend, mended=why.mended)
        if "task" not in self.scope.built_ins:
            return self._before_task(node, FLEET)
        of = str(text)
        return self.part(node, type_of(of, self.scope), lambda env: fleet(env, of), (read_of(of),))

    def _unknown_helper(self, node: ast.Call, name: str, reads: tuple[Dependency, ...]) -> Typed:
        start, end = self.parsed.span(node.func)
        names = self.scope.helpers.names()
        near = closest(name, names)
        if self.scope.type_of(name) is not None:
            said, mend, near = f"'{name}' is a value, not a helper", "an operator may be missing before '('", ""
        else:
            said = f"unknown helper '{name}'{did_you_mean(name, names)}"
            mend = f"write {near}" if near else "helpers: " + ", ".join(names)
        self.problems.report("E012", start, end, said, mend, mended=sure_of(name, names) if near else None)
        return self.poison(node, reads)

    def _is_set(self, node: ast.Call) -> Typed:
        argument = node.args[0] if len(node.args) == 1 and not node.keywords else None
        name = dotted_name(argument, self.parsed) if argument is not None else ""
        if isinstance(argument, ast.Attribute) and name.startswith("error.data."):
            return self._is_field_set(node, argument, name)
        if not isinstance(argument, ast.Name) or not name:
            return self.bad(node, "E012", "is_set takes one name", "is_set(reply)")
        if self.scope.type_of(name) is None:
            return self._unknown_name(argument, name)
        return self.part(node, BOOL, lambda env: env.is_set(name), (Dependency(name),))

    def _is_field_set(self, node: ast.Call, field: ast.Attribute, name: str) -> Typed:
        """Check whether a field of what a failure carries is asked for; which of them it has depends on who failed."""
        before, self.known_set = self.known_set, self.known_set | {name}
        part = self.visit(field)
        self.known_set = before
        if poisoned(part):
            return self.poison(node, part.reads)
        return self.part(node, BOOL, is_there_code(part.run), part.reads)
