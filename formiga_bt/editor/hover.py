"""What is under the cursor: a key, an action, a field, a name with its type and unit, a helper.

Called by the server; like completion it looks at the lines around the position only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from formiga_bt.editor.grammar import FreeMapping, OptionMapping, options_of
from formiga_bt.editor.phrase import open_call, type_of, word_at
from formiga_bt.editor.project import Document, Project
from formiga_bt.editor.view import PositionView, look
from formiga_bt.editor.wording import (
    about_action,
    about_helper,
    about_kind,
    about_option,
    about_type,
    field_line,
    param_line,
    typed,
)
from formiga_bt.lang.expr.helpers import STANDARD, Helper
from formiga_bt.lang.expr.scope import Scope, fields_of
from formiga_bt.lang.expr.tokens import rough_tokens
from formiga_bt.lang.kinds import KINDS
from formiga_bt.lang.types import ANY

BUILT_INS: Final[Mapping[str, str]] = {
    "base": "the base station",
    "task": "this run of the task",
    "now": "the instant of what is being handled",
    "site": "the ports, places and regions of the site",
    "error": "the failure that led here",
    "abort": "why the task was ended from outside",
    "result": "what the action or the question gave",
}


@dataclass(frozen=True, slots=True)
class Hover:
    """A text (Markdown) about the columns `start` to `end` of the line."""

    text: str
    start: int
    end: int


def hover(project: Project, document: Document, line: int, col: int) -> Hover | None:
    """Return what is at a position (0-based, in characters), in words; None where there is nothing to say."""
    view = look(project, document, line, col)
    if view is None or (not view.at.text and view.at.slot != "value"):
        return None
    if view.at.slot in ("key", "word"):
        text = _about_key(view)
        if text or view.at.slot == "key":
            return Hover(text, view.at.start, view.at.end) if text else None
    inside = view.expression()
    if inside is not None:
        return _in_expression(view, *inside)
    text = _about_value(view)
    return Hover(text, view.at.start, view.at.end) if text else None


# --- keys ----------------------------------------------------------------------------------------------------------


def _about_key(view: PositionView) -> str:
    schema, word = view.slot.schema, view.at.text
    if view.at.levels and view.at.levels[-1].kind == "map" and _is_step(view):
        if word in KINDS and (view.slot.kind is None or view.slot.kind.name == word):
            return about_kind(KINDS[word])
        kind = view.slot.kind
        option = next((one for one in options_of(kind) if one.name == word), None)
        return about_option(option, f"of `{kind.name}`" if kind is not None else "of any step") if option else ""
    if isinstance(schema, OptionMapping):
        option = next((one for one in schema.options if one.name == word), None)
        return about_option(option, f"of a {schema.owner}") if option is not None else ""
    return _about_free_key(view, schema) if isinstance(schema, FreeMapping) else ""


def _is_step(view: PositionView) -> bool:
    return (
        len(view.at.levels) > 1
        and view.at.levels[-2].kind == "list"
        and not isinstance(view.slot.schema, OptionMapping)
    )


def _about_free_key(view: PositionView, schema: FreeMapping) -> str:
    word = view.at.text
    if schema.what == "with":
        if view.action is not None and word in view.action.fields:
            spec = view.action.fields[word]
            return f"**{word}**: {field_line(spec)}\n\n{spec.help}\n\n*of {view.action.name}*"
        param = view.params().get(word)
        if param is not None and view.callee is not None:
            return f"**{word}**: {param_line(param)}\n\n{param.help or param.label}\n\n*of {view.callee.name}*"
    if schema.what in ("params", "vars", "agents", "for", "set"):
        return _about_name(view, word)
    if schema.what == "types" and word in view.catalogue.types:
        return about_type(view.catalogue.types[word])
    if schema.what == "actions" and word in view.catalogue.actions:
        return about_action(view.catalogue.actions[word])
    return ""


# --- values --------------------------------------------------------------------------------------------------------


def _about_value(view: PositionView) -> str:
    word, option = view.at.text.strip(), view.option
    name = option.name if option is not None else ""
    if option is not None and option.form == "action":
        role, dot, action = word.partition(".")
        if dot and view.at.offset > len(role):
            spec = view.catalogue.actions.get(action)
            return about_action(spec) if spec is not None else ""
        return _about_name(view, role)
    if name in ("call", "request"):
        callee = view.callee
        if callee is None:
            return ""
        params = "".join(f"\n- `{param.name}`: {param_line(param)}" for param in callee.params.values())
        return f"**{word}**: {'subtree' if name == 'call' else 'task'} of {callee.path.name}{params}"
    if (
        name in ("type", "any_of", "of", "extends")
        and word in view.catalogue.types
        and view.document.kind != "scenario"
    ):
        return about_type(view.catalogue.types[word])
    if name == "actions" and word in view.catalogue.actions:
        return about_action(view.catalogue.actions[word])
    if name in ("release", "role", "save_as", "collect", "first") or (option is not None and option.form == "roles"):
        return _about_name(view, word)
    due = view.due()
    if due is not None and option is None:
        return f"**{view.at.key}**: {typed(due)}"
    return f"**{name}**: {typed(due)}\n\n{option.doc}" if due is not None and option is not None else ""


def _about_name(view: PositionView, name: str) -> str:
    """Return what a name is: its type and unit, as what it was defined, and the help of a param."""
    index = view.document.last_known()
    defined = index.definition((view.slot.body, name))
    of = view.scope.type_of(name)
    if of is None and defined is None:
        return ""
    origin = {"saved": "saved name"}.get(defined.origin, defined.origin) if defined is not None else ""
    why = view.scope.maybe_unset.get(name)
    unsure = "\n\nIt may have no value here: test is_set first." if why else ""
    said = origin or BUILT_INS.get(name, "")
    return f"**{name}**: {typed(of) if of is not None else 'any'}" + (f"\n\n*{said}*" if said else "") + unsure


def _in_expression(view: PositionView, text: str, offset: int, column: int) -> Hover | None:
    found = word_at(text, offset)
    if found is None:
        return _about_quantity(text, offset, column)
    word, start, end, owner = found
    said = ""
    if owner:
        owner_type = type_of(owner, view.scope)
        of = (fields_of(owner_type, view.scope.agent_types) or {}).get(word)
        said = f"**{owner}.{word}**: {typed(of)}" if of is not None else ""
    elif text[end:].lstrip()[:1] == "(":
        said = about_helpers(word)
    else:
        said = _about_name(view, word)
    return Hover(said, column + start, column + end) if said else None


def _about_quantity(text: str, offset: int, column: int) -> Hover | None:
    for token in rough_tokens(text):
        if token.kind == "quantity" and token.start <= offset <= token.end:
            of = type_of(token.text, Scope({}))
            return Hover(f"`{token.text}`: {of}", column + token.start, column + token.end) if of != ANY else None
    return None


@cache
def about_helpers(word: str) -> str:
    """Return the hover text of a helper, all its forms."""
    if word == "is_set":
        return "```\nis_set(name) -> bool\n```\nwhether a name has a value"
    return "\n\n".join(about_helper(form) for form in STANDARD.forms(word))


# --- signatures ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Signatures:
    """The forms of the helper that is being called, and which argument is being written."""

    forms: tuple[Helper, ...]
    argument: int


def signatures(project: Project, document: Document, line: int, col: int) -> Signatures | None:
    """Return the helper in whose brackets a position is; None outside of any."""
    view = look(project, document, line, col)
    inside = view.expression() if view is not None else None
    call = open_call(inside[0], inside[1]) if inside is not None else None
    if call is None or not STANDARD.forms(call[0]):
        return None
    return Signatures(STANDARD.forms(call[0]), call[1])
