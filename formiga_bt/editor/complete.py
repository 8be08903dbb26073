"""What may be written at a position: keys, kinds with what they need, names, fields, units, values.

Everything comes from the tables of the language, the catalogue, the site and what the last check saw at the step.
Called by the server for each completion; it looks at the lines around the position only.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal

from formiga_bt.base.units import LIKELY, UNITS
from formiga_bt.editor.grammar import FreeMapping, OptionMapping, Steps, kind_of, options_of, step_value
from formiga_bt.editor.phrase import phrase, type_of
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.view import PositionView, look
from formiga_bt.editor.wording import field_line, param_line, type_words
from formiga_bt.lang.expr.helpers import STANDARD
from formiga_bt.lang.expr.scope import fields_of
from formiga_bt.lang.expr.typing_rules import fits
from formiga_bt.lang.kinds import KINDS, MODIFIERS, Option, StepKind
from formiga_bt.lang.model import AgentType
from formiga_bt.lang.params import SIMPLE
from formiga_bt.lang.types import ANY, Type

What = Literal["kind", "option", "field", "name", "helper", "value", "unit", "action", "subtree", "file"]


@dataclass(frozen=True, slots=True)
class Item:
    """A proposal: `insert` replaces the columns `start` to `end` of the line. `snippet`: it has places to fill (`$1`)."""

    label: str
    insert: str
    start: int
    end: int
    what: What
    detail: str = ""
    doc: str = ""
    snippet: bool = False
    order: int = 5


_PLACES: Final[Mapping[str, str]] = {
    "action": "drone.Action",
    "cond": "condition",
    "expr": "expression",
    "name": "name",
}


def complete(project: Project, document: Document, line: int, col: int) -> list[Item]:
    """Return the proposals at a position (0-based, in characters), the likeliest first."""
    view = look(project, document, line, col)
    if view is None:
        return []
    if view.at.slot in ("key", "word", "item"):
        found = list(_keys(view))
        if not found and view.at.slot == "word":
            found = list(_values(view))
    else:
        found = list(_values(view))
    return sorted(found, key=lambda item: item.order)


# --- keys ----------------------------------------------------------------------------------------------------------


def _keys(view: PositionView) -> Iterator[Item]:
    at, schema = view.at, view.slot.schema
    inner = at.levels[-1] if at.levels else None
    keys = inner.keys if inner is not None and inner.kind == "map" and at.slot != "item" else {}
    own = at.text if at.colon else ""
    others = {key: text for key, text in keys.items() if key != own}
    if isinstance(schema, Steps):
        if _in_item(view):
            yield from _step_keys(view, others)
        else:
            yield from _kinds(view, dash=True)
    elif isinstance(schema, OptionMapping):
        dash = schema.owner in _LISTED and not _in_item(view) and not at.flow
        for order, option in enumerate(schema.options):
            if option.name not in others:
                yield _option(view, option, 1 if option.required else 2 + order / 100, dash=dash)
    elif isinstance(schema, FreeMapping):
        yield from _free_keys(view, schema, others)


_LISTED: Final = frozenset(
    {"pilot", "scenario agent", "scenario task", "fault", "order", "answer", "case", "answer or goal"}
)


def _in_item(view: PositionView) -> bool:
    """Return whether the position is in the mapping of a list item, not where its dash belongs."""
    lists = [level for level in view.at.levels if level.kind == "list"]
    return view.at.slot != "item" and len(view.at.levels) > 1 and bool(lists) and view.at.levels[-2].kind == "list"


def _step_keys(view: PositionView, others: Mapping[str, str]) -> Iterator[Item]:
    kind = kind_of(others)
    if kind is None:
        yield from _kinds(view, dash=False)
        yield from (_option(view, option, 7) for option in MODIFIERS if option.name not in others)
        return
    for option in options_of(kind)[1:]:
        if option.name not in others:
            order = 1 if option.required else 3 if option in MODIFIERS else 2
            yield _option(view, option, order)


def _kinds(view: PositionView, *, dash: bool) -> Iterator[Item]:
    for order, kind in enumerate(KINDS.values()):
        text = kind.name if view.at.colon else ("- " if dash else "") + _kind_snippet(view, kind, dash=dash)
        yield _key_item(view, kind.name, text, "kind", kind.doc, 1 + order / 100)


def _kind_snippet(view: PositionView, kind: StepKind, *, dash: bool) -> str:
    """Return a step of a kind with what it must have; the lines after the first keep the indentation of the first."""
    needed = [Option(kind.name, kind.form, "", kind.type), *(o for o in kind.options if o.required)]
    if view.at.flow:
        return f"{kind.name}: $0"
    rows: list[str] = []
    for number, option in enumerate(needed, 1):
        rows += _rows(option, number)
    pad = " " * (_extra(view) + (2 if dash else 0))
    return ("\n" + pad).join(rows)


def _rows(option: Option, number: int) -> list[str]:
    key = option.name
    match option.form:
        case "steps":
            return [f"{key}:", f"  - ${number}"]
        case "map" if key == "for":
            return [f"{key}:", f"  ${{{number}:item}}: \\${{${{9:list}}\\}}"]
        case "map" if key == "cases":
            return [f"{key}:", f"  ${{{number}:value}}:", f"    - ${{{number + 1}}}"]
        case "map" if isinstance(of := step_value([key], key), FreeMapping) and isinstance(of.of, OptionMapping):
            return [f"{key}:", f"  ${{{number}:name}}:", f"    ${{{number + 1}}}"]
        case "map":
            return [f"{key}:", f"  ${{{number}:name}}: ${{9:value}}"]
        case "roles":
            return [f"{key}: [${{{number}:role}}]"]
        case "value":
            text = "1 " + LIKELY[option.type][0] if option.type in LIKELY else "1"
            return [f"{key}: ${{{number}:{text}}}"]
        case _:
            return [f"{key}: ${{{number}:{_PLACES.get(option.form, 'text')}}}"]


def _extra(view: PositionView) -> int:
    """Return by how much the keys stand further in than the line begins: clients indent by the line."""
    line = view.document.lines[view.at.line] if view.at.line < len(view.document.lines) else ""
    indent = len(line) - len(line.lstrip()) if line.strip() else view.at.column
    return max(0, view.at.column - indent)


def _option(view: PositionView, option: Option, order: float, *, dash: bool = False) -> Item:
    key = option.name
    needs = "required" if option.required else type_words(option)
    if view.at.colon:
        text = key
    else:
        text = ("- " if dash else "") + _option_snippet(view, option)
    return _key_item(view, key, text, "option", option.doc, order, needs)


def _option_snippet(view: PositionView, option: Option) -> str:
    key, pad = option.name, " " * _extra(view)
    if option.values:
        return f"{key}: ${{1|{','.join(option.values)}|}}"
    if option.form == "flag":
        return f"{key}: ${{1|true,false|}}"
    if view.at.flow:
        return f"{key}: $0"
    if option.form == "steps":
        return f"{key}:\n{pad}  - $0"
    if key == "with":
        return _with_snippet(view, pad)
    if option.form in ("map", "options"):
        needed = [one.name for one in option.keys if one.required]
        rows = [f"{pad}  {one}: ${number}" for number, one in enumerate(needed, 1)] or [f"{pad}  $0"]
        return f"{key}:\n" + "\n".join(rows)
    if option.form in ("roles", "words"):
        return f"{key}: [$0]"
    return f"{key}: $0"


def _with_snippet(view: PositionView, pad: str) -> str:
    action = view.action
    needed = [f.name for f in action.fields.values() if f.default is None and not f.optional] if action else []
    needed += [p.name for p in view.params().values() if p.default is None and not p.optional]
    rows = [f"{pad}  {name}: ${number}" for number, name in enumerate(needed, 1)] or [f"{pad}  $0"]
    return "with:\n" + "\n".join(rows)


def _free_keys(view: PositionView, schema: FreeMapping, others: Mapping[str, str]) -> Iterator[Item]:
    if schema.what == "with":
        action = view.action
        for spec in action.fields.values() if action is not None else ():
            if spec.name not in others:
                order = 1 if spec.default is None and not spec.optional else 2
                yield _plain_key(view, spec.name, "field", field_line(spec), spec.help, order)
        for param in view.params().values():
            if param.name not in others:
                order = 1 if param.default is None and not param.optional else 2
                yield _plain_key(view, param.name, "field", param_line(param), param.help or param.label, order)
    elif schema.what == "set":
        known = view.document.last_known()
        for one in known.occurrences:
            if one.origin == "var" and one.space == view.slot.body and one.name not in others:
                yield _plain_key(view, one.name, "name", f"var: {view.scope.type_of(one.name) or ANY}")
    elif schema.what == "cases":
        of = type_of(view.slot.step.get("switch", ""), view.scope)
        yield from (_plain_key(view, value, "value") for value in of.values if value not in others)


def _plain_key(view: PositionView, key: str, what: What, detail: str = "", doc: str = "", order: float = 2) -> Item:
    return _key_item(view, key, key if view.at.colon else f"{key}: $0", what, doc, order, detail)


def _key_item(view: PositionView, label: str, text: str, what: What, doc: str, order: float, detail: str = "") -> Item:
    snippet = not view.at.colon
    plain = text if snippet else text.replace("\\$", "$")
    return Item(label, plain, view.at.start, view.at.end, what, detail, doc, snippet, int(order * 100))


# --- values --------------------------------------------------------------------------------------------------------


def _values(view: PositionView) -> Iterator[Item]:
    inside = view.expression()
    if inside is not None:
        yield from _in_expression(view, *inside)
        return
    option = view.option
    form = option.form if option is not None else "value"
    if option is not None and option.values:
        yield from _words(view, option.values)
        return
    match form:
        case "action":
            yield from _role_and(view, _actions)
        case "flag":
            yield from _words(view, ("true", "false"))
        case "roles":
            yield from _agents(view, site_roles=True)
        case "name" | "word" | "words":
            yield from _named(view, option)
        case "text" | "steps":
            return
        case _:
            yield from _plain_values(view)


def _words(view: PositionView, words: Iterable[str], what: What = "value", detail: str = "") -> Iterator[Item]:
    for word in words:
        yield Item(word, word, view.at.start, view.at.end, what, detail)


def _role_and(
    view: PositionView, after_dot: Callable[[PositionView, list[AgentType], int], Iterator[Item]]
) -> Iterator[Item]:
    """Propose for `role.Word`: agents before the dot, what their types have after it."""
    text, start = view.at.text, view.at.start
    dot = text.find(".")
    if dot < 0 or view.at.offset <= dot:
        end = start + (dot if dot >= 0 else len(text))
        tail = "" if dot >= 0 else "."
        for name, of in view.scope.names.items():
            if of.name == "agent":
                yield Item(name, name + tail, start, end, "name", str(of))
        return
    agent = view.scope.type_of(text[:dot].strip()) or ANY
    types = [view.catalogue.types[name] for name in agent.of if name in view.catalogue.types]
    yield from after_dot(view, types, start + dot + 1)


def _actions(view: PositionView, types: list[AgentType], start: int) -> Iterator[Item]:
    for spec in view.catalogue.actions.values():
        if not spec.cuts and all(spec.name in one.actions for one in types):
            yield Item(spec.name, spec.name, start, view.at.end, "action", f"({', '.join(spec.fields)})", spec.help)


def _events(view: PositionView, types: list[AgentType], start: int) -> Iterator[Item]:
    for name in dict.fromkeys(name for one in types or view.catalogue.types.values() for name in one.events):
        if all(name in one.events for one in types):
            yield Item(name, name, start, view.at.end, "action", "event")


def _agents(view: PositionView, *, site_roles: bool) -> Iterator[Item]:
    for name, of in view.scope.names.items():
        if of.name == "agent" or (of.item is not None and of.item.name == "agent"):
            yield Item(name, name, view.at.start, view.at.end, "name", str(of))
    if site_roles and view.site is not None:
        yield from _words(
            view, (name for name in view.site.people if name not in view.scope.names), "name", "site role"
        )


def _named(view: PositionView, option: Option | None) -> Iterator[Item]:
    """Propose for an option that names something that is defined elsewhere."""
    name = option.name if option is not None else ""
    start, end = view.at.start, view.at.end
    match name:
        case "call":
            for signature in view.subtrees.values():
                shown = ", ".join(f"{param.name}: {param.type}" for param in signature.params.values())
                yield Item(signature.name, signature.name, start, end, "subtree", f"({shown})")
        case "request":
            yield from _words(view, view.project.task_names(view.document), "subtree", "task")
        case "wait_for":
            yield from _role_and(view, _events)
        case "release" | "role":
            yield from _agents(view, site_roles=False)
        case "with_resource" if view.site is not None:
            for known in view.site.resources.values():
                yield Item(known.name, known.name, start, end, "value", f"{known.capacity} of it")
        case "list":
            yield from _words(view, (*SIMPLE, *view.record_names()), "value", "type of the items")
        case "type" if view.slot.section in ("params", "subtrees", "actions", "records", "vars"):
            yield from _words(view, (*SIMPLE, "enum"), "value", "type")
            yield from _words(view, view.record_names(), "value", "record")
        case "type" | "any_of" | "of" | "extends":
            for one in view.catalogue.types.values():
                yield Item(one.name, one.name, start, end, "value", one.label or "agent type")
        case "actions":
            yield from _words(view, view.catalogue.actions, "action")
        case "imports":
            yield from _words(view, view.project.importable(view.document.path), "file")
        case "on" if view.document.kind == "task" and "options" in view.slot.step:
            yield from _words(view, re.findall(r"[\w-]+", view.slot.step["options"]))
        case "home" if view.site is not None:
            yield from _words(view, view.site.ports, "value", "port")


def _plain_values(view: PositionView) -> Iterator[Item]:
    """Propose literals of the type that is due, names that fit as `${name}`, and places of the site."""
    due = view.due()
    unit = list(_units_after(view, due))
    if unit:
        yield from unit
        return
    start, end = view.at.start, view.at.end
    if due is not None and due.name == "bool":
        yield from _words(view, ("true", "false"))
    if due is not None and due.name == "enum":
        yield from _words(view, due.values)
    if due is not None and due.name in ("place", "region") and view.site is not None:
        known = view.site.places if due.name == "place" else view.site.regions
        yield from _words(view, known, "value", f"{due.name} of the site")
    if view.document.kind not in ("task", "library"):
        return
    quote = '"' if view.at.flow and not view.at.quoted else ""
    for name, of in view.scope.names.items():
        if due is None or fits(of, due, view.scope.agent_types):
            yield Item(name, f"{quote}${{{name}}}{quote}", start, end, "name", str(of))


def _units_after(view: PositionView, due: Type | None) -> Iterator[Item]:
    found = re.fullmatch(r"\s*[-+]?\d+(?:\.\d+)?(\s*)([a-z/%]*)", view.at.text[: view.at.offset])
    if found is None:
        return
    gap = "" if found[1] else " "
    for unit, (name, _) in UNITS.items():
        if due is None or due.name == name or due == ANY:
            start = view.at.start + found.start(2)
            yield Item(unit, gap + unit, start, start + len(found[2]), "unit", name)


# --- expressions ---------------------------------------------------------------------------------------------------


def _in_expression(view: PositionView, text: str, offset: int, column: int) -> Iterator[Item]:
    at = phrase(text, offset)
    start = column + at.start
    end = column + offset + len(re.match(r"\w*", text[offset:])[0])  # type: ignore[index]
    match at.what:
        case "field":
            fields = fields_of(type_of(at.owner, view.scope), view.scope.agent_types)
            for name, of in (fields or {}).items():
                yield Item(name, name, start, end, "field", str(of))
        case "unit":
            gap = "" if at.word or text[:offset][-1:].isspace() else " "
            for unit, (kind, _) in UNITS.items():
                yield Item(unit, gap + unit, start, column + offset, "unit", kind)
        case "text":
            compared = type_of(at.owner, view.scope)
            for value in compared.values:
                yield Item(value, value, start, column + offset, "value", str(compared))
        case _:
            yield from _names(view, start, end)


def _names(view: PositionView, start: int, end: int) -> Iterator[Item]:
    scope = view.scope
    for name in scope.visible():
        own = name in scope.names
        yield Item(name, name, start, end, "name", str(scope.type_of(name)), order=1 if own else 3)
    for name in STANDARD.names():
        forms = STANDARD.forms(name)
        shown = forms[0].signature if forms else "is_set(name)"
        doc = forms[0].help if forms else "whether a name has a value"
        yield Item(name, f"{name}($0)", start, end, "helper", shown, doc, snippet=True, order=4)
    for word in ("and", "or", "not", "in", "if", "else", "true", "false"):
        yield Item(word, word, start, end, "value", order=6)
