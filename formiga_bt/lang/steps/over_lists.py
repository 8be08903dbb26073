"""The loop over lists: for, one item after another or all at once. Loop names, zipped lists, collected results."""

import ast
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Literal

from formiga_bt.base.diagnostics import Fix, Mark
from formiga_bt.lang.body import Body
from formiga_bt.lang.checks import sampled
from formiga_bt.lang.expr.at_run import sure_of_type
from formiga_bt.lang.expr.tokens import ExprSyntax, Parsed, parse_expression
from formiga_bt.lang.expr.typing_rules import in_words
from formiga_bt.lang.flow import Around, Flow, NamedValue
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.steps.blocks import Readers, read_child_failure, read_need
from formiga_bt.lang.steps.loops import leave, read_body
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import read_name, shorten, what_is
from formiga_bt.lang.types import ANY, INT, Type, agent_type, list_of
from formiga_bt.lang.walk import plain_name
from formiga_bt.lang.written import saves, writes


def read_for(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read a loop over the items of lists."""
    mark = keys["for"].key.mark
    parallel = keys.word("mode") == "parallel"
    lists = _read_lists(body, keys["for"].value)
    length = _same_length(body, lists or {})
    part: Part = {"parallel": parallel, "said_mode": "mode" in keys, "need": read_need(body, keys, length, "items")}
    part["on_child_failure"] = read_child_failure(keys)
    _read_most(body, keys, part, parallel=parallel)
    entry = body.flow.copy()
    if parallel and "steps" in keys:
        _check_sets(body, keys["steps"].value)
    with _loop_names(body, lists or {}, mark):
        around = Around(mark, [], f"this parallel for ({mark.said})" if parallel else "")
        steps, outs = read_body(read, body, keys, around)
    part |= steps
    end = body.flow
    whole = part["need"] == "all" and bool(length)
    _after_for(body, entry, [*outs, end], parallel=parallel, whole=whole, mark=mark)
    body.flow.released = {
        name: at
        for one, at in end.released.items()
        for name in (body.items.get(one, ()) if one in (lists or {}) else (one,))
    }
    if "first" in keys and _may_be_first(body, keys, parallel=parallel):
        some = bool(length) or any(plain_name(expr) in body.lists for expr, _ in (lists or {}).values())
        part["first"] = _gather(body, keys["first"].value, "first", entry, end)
        body.flow.sure = body.flow.sure if some else body.flow.sure - {part["first"]}  # an empty list is a success
    elif "collect" in keys:
        part["collect"] = _gather(body, keys["collect"].value, "collect", entry, end)
    return {"lists": {name: expr for name, (expr, _) in lists.items()}, **part} if lists else None


def _after_for(body: Body, entry: Flow, outs: list[Flow], *, parallel: bool, whole: bool, mark: Mark) -> None:
    """Set what holds after the last item: of a parallel `for`, nothing that an item saved."""
    end = outs[-1]
    if not parallel:
        body.flow = end
        leave(body, outs if whole else [*outs, entry])
        return
    body.flow = entry.copy()
    body.flow.released = dict(end.released)
    for name in end.saved:
        if name not in entry.saved:
            what = f"'{name}' is written by every round of the parallel for at {mark.said}, each for itself"
            help_ = f"use collect: {name} to gather one result per round, or first: {name} to end with the first one"
            body.gone[name] = ("E072", what, help_)


def _read_most(body: Body, keys: Keys, part: Part, *, parallel: bool) -> None:
    if not parallel:
        for key in ("max_parallel", "on_child_failure"):
            if key in keys:
                what = f"'{key}' is for mode: parallel only"
                body.problems.add("E008", keys[key].key.mark, what, "add mode: parallel, or remove it")
    if "max_parallel" not in keys:
        return
    most = body.value(keys["max_parallel"].value, INT, "max_parallel")
    if isinstance(most.const, int) and most.const >= 1:
        part["max_parallel"] = most.const
    elif most.type != ANY:
        body.problems.add("E008", most.mark, "'max_parallel' must be a number, at least 1", "such as: max_parallel: 2")


def _read_lists(body: Body, node: Node) -> dict[str, tuple[Expr, Entry]] | None:
    """Return the loop names with their lists, in file order."""
    if not isinstance(node, Mapping_):
        what = f"'for' needs names and their lists, this is {what_is(node)}"
        body.problems.add("E008", node.mark, what, "such as: for: {drone: '${drones}'}")
        return None
    if not node.entries:
        body.problems.add("E044", node.mark, "'for' goes over nothing", "such as: for: {drone: '${drones}'}")
    found: dict[str, tuple[Expr, Entry]] = {}
    for entry in node.entries:
        at = entry.key
        if read_name(at, body.problems, "for") is None or not is_free(at, body.problems):
            continue
        old = body.names.get(at.text) or body.flow.saved.get(at.text)
        if old is not None:
            origin = "saved name" if old.origin == "saved" else old.origin
            what = f"'{at.text}' is a {origin} already; first at {old.mark.said}"
            body.problems.add("E018", at.mark, what, "choose another name")
            body.used.add(at.text)
        found[at.text] = (_read_list(body, entry), entry)
    return found


def _read_list(body: Body, entry: Entry) -> Expr:
    node = entry.value
    if isinstance(node, Scalar) and "${" not in node.text:
        text = node.text.strip()
        if body.scope().type_of(text) is not None:
            what = f"'{entry.key.text}' must go over a list, got the text '{text}'; did you mean ${{{text}}}?"
            body.problems.add("E016", node.mark, what, f"write ${{{text}}}", Fix(node.mark, f"${{{text}}}"))
            body.used.add(text)
            return Expr(text, ANY, node.mark, lambda _env: ())
        mend = f"write repeat: {text}, or ${{range({text})}}" if text.isdigit() else "such as: ${drones}"
        what = f"'{entry.key.text}' must go over a list, this is the text '{shorten(text)}'"
        body.problems.add("E048", node.mark, what, mend)
        return Expr(text, ANY, node.mark, lambda _env: ())
    expr = body.value(node, ANY, entry.key.text)
    if expr.type.name not in ("list", "any"):
        what = f"'{entry.key.text}' must go over a list, this is {in_words(expr.type)}"
        body.problems.add("E048", expr.mark, what, "a list stands in [ ], or comes from a role with count")
    elif expr.const == ():
        body.problems.add("E044", expr.mark, f"the list of '{entry.key.text}' is empty", "give it items")
    return sure_of_type(expr, list_of(ANY))


def _same_length(body: Body, lists: Mapping[str, tuple[Expr, Entry]]) -> int | None:
    """Return how many items the lists have, if known; report E048 where they differ."""
    first: tuple[str, int] | None = None
    for name, (expr, entry) in lists.items():
        length = length_of(body, expr, entry.value)
        shown = shorten(expr.source.removeprefix("${").removesuffix("}").strip(), 30) or name
        if length is None:
            continue
        if first is None:
            first = shown, length
        elif first[1] != length:
            what = f"'{first[0]}' has {first[1]} items, '{shown}' has {length}"
            body.problems.add("E048", expr.mark, what, "lists that go together have equal lengths")
    return first[1] if first is not None else None


def length_of(body: Body, expr: Expr, node: Node | None = None) -> int | None:
    """Return the number of items of a list, if it is known before any run."""
    if isinstance(expr.const, tuple):
        return len(expr.const)
    if isinstance(node, Listing):
        return len(node.items)
    try:
        parsed = parse_expression(expr.source.strip().removeprefix("${").removesuffix("}"))
    except ExprSyntax:
        return None
    length = _length(body, parsed, parsed.root)
    if length is not None or expr.type.name != "list" or any(read.field for read in expr.reads):
        return length
    scope = body.scope()
    types = {read.name: scope.type_of(read.name) or ANY for read in expr.reads}
    return sampled.length_of(expr, types, body.world.site)


def _length(body: Body, parsed: Parsed, node: ast.expr) -> int | None:
    match node:
        case ast.List(elts=items):
            return len(items)
        case ast.Name():
            name = parsed.token(node.id).text
            return body.lists.get(name) or body.lengths.get(name)
        case ast.Call(func=ast.Name() as func, args=args):
            return _length(body, parsed, args[0]) if parsed.token(func.id).text == "reverse" and args else None
    return None


@contextmanager
def _loop_names(body: Body, lists: Mapping[str, tuple[Expr, Entry]], mark: Mark) -> Iterator[None]:
    """Make the loop names visible in a block; after it they have no value."""
    new = [name for name in lists if name not in body.names and name not in body.flow.saved]
    for name in new:
        expr, entry = lists[name]
        item = expr.type.item or ANY
        body.names[name] = NamedValue(item, entry.key.mark, "loop name")
        if item.name == "agent":
            roles = tuple(read.name for read in expr.reads if not read.field and _is_agents(body, read.name))
            body.agents[name] = item.of or _common(body, roles)
            body.items[name] = roles
            of = Type("agent", of=body.agents[name], foreign=item.foreign)
            body.names[name] = NamedValue(of, entry.key.mark, "loop name")
    try:
        yield
    finally:
        for name in new:
            del body.names[name]
            body.agents.pop(name, None)
            what = f"'{name}' is a loop name: it has a value in the loop at {mark.said} only"
            body.gone[name] = ("E019", what, "move the step into the loop")


def _common(body: Body, roles: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(of for role in roles for of in body.agents.get(role, ())))


def _is_agents(body: Body, name: str) -> bool:
    """Return whether a name is a role, an agent param, or a param that is a list of agents."""
    named = body.names.get(name)
    return name in body.agents or (
        named is not None and named.origin == "param" and agent_type(named.type).name == "agent"
    )


def _check_sets(body: Body, node: Node) -> None:
    """Report E072 for a var that the rounds of a parallel `for` assign at once."""
    for name in sorted(writes(node) - {at.text for at in saves(node)}):
        if name in body.vars:
            at = _setter(node, name)
            if at is not None:
                what = f"'{name}' is written by every round of this parallel for"
                body.problems.add("E072", at.mark, what, "use save_as: and collect: to gather one result per round")


def _setter(node: Node, name: str) -> Scalar | None:
    """Return the key of the first `set` of a name."""
    if isinstance(node, Listing):
        return next((at for item in node.items if (at := _setter(item, name)) is not None), None)
    if not isinstance(node, Mapping_):
        return None
    for entry in node.entries:
        if entry.key.text == "set" and isinstance(entry.value, Mapping_) and (found := entry.value.get(name)):
            return found.key
        if (at := _setter(entry.value, name)) is not None:
            return at
    return None


def _may_be_first(body: Body, keys: Keys, *, parallel: bool) -> bool:
    """Report E008 for a `first` that is not for this loop, or beside options that decide otherwise when it ends."""
    mark = keys["first"].key.mark
    if not parallel:
        help_ = "add mode: parallel; or leave the loop with break_if"
        body.problems.add("E008", mark, "'first' is for mode: parallel only", help_)
    others = [key for key in ("collect", "need", "on_child_failure") if key in keys]
    if others:
        what = f"'first' ends the loop with the first item that saves the name, so '{others[0]}' has no place beside it"
        body.problems.add("E008", keys[others[0]].key.mark, what, f"remove one of them: first or {others[0]}")
    return parallel and "collect" not in keys


def _gather(body: Body, node: Node, key: Literal["collect", "first"], entry: Flow, end: Flow) -> str:
    """Define what the loop makes of a saved name of its body: the list of all, or the first one."""
    at = read_name(node, body.problems, key)
    if at is None:
        return ""
    named = end.saved.get(at.text)
    if named is None or at.text in entry.taken:
        known = [name for name in end.saved if name not in entry.saved]
        what = f"no step of this loop saves '{at.text}'"
        body.problems.add(
            "E010", at.mark, what, f"saved here: {', '.join(known)}" if known else "add save_as: to a step"
        )
        body.used.add(at.text)
        return ""
    gathered = NamedValue(list_of(named.type) if key == "collect" else named.type, at.mark, "saved")
    body.every[at.text] = body.flow.saved[at.text] = gathered
    body.used.discard(at.text)
    body.gone.pop(at.text, None)
    body.flow.taken |= {at.text}
    body.flow.sure |= {at.text}
    return at.text
