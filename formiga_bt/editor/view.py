"""A position of a file with all that is known there: what may stand at it, and the names that are visible.

Made once per request and handed to completion, hover and definitions.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from formiga_bt.editor.grammar import (
    FreeMapping,
    GrammarWalk,
    OptionMapping,
    OptionValue,
    Schema,
    Slot,
    Steps,
    scalar_behind,
)
from formiga_bt.editor.phrase import hole_around
from formiga_bt.editor.project import Document, Project, Signature
from formiga_bt.editor.where import EditorPosition, where
from formiga_bt.lang import records
from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.kinds import Option
from formiga_bt.lang.model import ActionSpec, Catalogue, Param, Site
from formiga_bt.lang.params import SIMPLE
from formiga_bt.lang.text.document import Mapping_
from formiga_bt.lang.types import ANY, INT, TEXT, Type


@dataclass(frozen=True)
class PositionView:
    """What is at a position."""

    project: Project
    document: Document
    at: EditorPosition
    slot: Slot

    @cached_property
    def catalogue(self) -> Catalogue:
        """Return the agent types and actions."""
        return self.project.catalogue(self.document.path)

    @cached_property
    def site(self) -> Site | None:
        """Return the site of the file."""
        return self.project.site_of(self.document.path)

    @cached_property
    def subtrees(self) -> Mapping[str, Signature]:
        """Return the subtrees that may be called."""
        return self.project.subtrees(self.document)

    def record_names(self) -> list[str]:
        """Return the records that the file declares, and those of the catalogue."""
        root = self.document.last_known().root
        own = root.get("records") if isinstance(root, Mapping_) else None
        names = (
            [one.key.text for one in own.value.entries] if own is not None and isinstance(own.value, Mapping_) else []
        )
        return [*names, *self.catalogue.records]

    @cached_property
    def scope(self) -> Scope:
        """Return the names that are visible here, `result` included where it has a value."""
        found = self.document.seen.visible(self.document.lines, self.at)
        if found is None:
            found = Scope({}, agent_types=self.catalogue.types, site=self.site)
        if self.at.key == "expect":
            found = found.with_names({"result": self._result()})
        return found

    def _result(self) -> Type:
        if "ask" in self.slot.step:
            return records.answer(("yes", "no"), self.slot.step.get("policy", "any"))
        action = self.action
        return records.result(action) if action is not None else ANY

    @property
    def action(self) -> ActionSpec | None:
        """Return the action that the step around orders."""
        return self.catalogue.actions.get(self.slot.step.get("do", "").partition(".")[2].strip())

    @cached_property
    def callee(self) -> Signature | None:
        """Return the subtree that the step around calls, or the task that it requests."""
        if "request" in self.slot.step:
            return self.project.task(self.document, self.slot.step["request"])
        return self.subtrees.get(self.slot.step.get("call", ""))

    @property
    def option(self) -> Option | None:
        """Return the option whose value this is."""
        schema = scalar_behind(self.slot.schema) if self.at.slot != "key" else None
        return schema.option if isinstance(schema, OptionValue) else None

    def due(self) -> Type | None:
        """Return the type of value that is due here, if that is known."""
        schema = scalar_behind(self.slot.schema)
        if not isinstance(schema, OptionValue):
            return None
        key = self.slot.names[-1] if self.slot.names else ""
        if schema.names == "with":
            return self._argument(key)
        if schema.names == "set":
            return self.scope.type_of(key)
        option = schema.option
        if option is None:
            return None
        if option.name in ("default", "min", "max") and option.type == "" and self._table_around == "param":
            of = next((level.keys.get("type", "") for level in reversed(self.at.levels) if level.kind == "map"), "")
            return Type(of) if of in SIMPLE else None
        if option.name == "timeout" or option.type:
            return INT if option.type == "int" else Type(option.type) if option.type else None
        return TEXT if option.form == "text" else None

    @property
    def _table_around(self) -> str:
        return "param" if len(self.slot.names) and self.slot.section in ("params", "subtrees") else ""

    def _argument(self, key: str) -> Type | None:
        action, callee = self.action, self.callee
        if action is not None and key in action.fields:
            return action.fields[key].type
        if callee is not None and key in callee.params:
            return callee.params[key].type
        return None

    def params(self) -> Mapping[str, Param]:
        """Return the params of what the step around calls or requests."""
        return self.callee.params if self.callee is not None else {}

    def expression(self) -> tuple[str, int, int] | None:
        """Return the expression around the position, the offset in it, and the column at which it begins."""
        text, offset = self.at.text, self.at.offset
        if self.at.slot == "key":
            return None
        option = self.option
        whole = option is not None and option.form in ("cond", "expr")
        hole = hole_around(text, offset)
        if hole is not None:
            start, end = hole
            return text[start:end], offset - start, self.at.start + start
        return (text, offset, self.at.start) if whole else None


def look(project: Project, document: Document, line: int, col: int) -> PositionView | None:
    """Return what is at a position (0-based, in characters); None where nothing can stand."""
    at = where(document.lines, line, col)
    if at is None:
        return None
    return PositionView(project, document, at, slot_at(document, at))


def slot_at(document: Document, at: EditorPosition) -> Slot:
    """Return what may stand at a place of a document."""
    walk = GrammarWalk(document.kind)
    for index, level in enumerate(at.levels):
        last = index == len(at.levels) - 1
        if level.kind == "list":
            walk.into_list()
            continue
        if last and at.slot == "word" and not _is_mapping(walk):
            break
        walk.into_map(level.keys)
        if level.under and (not last or at.slot == "value"):
            walk.behind(level.under, at_root=index == 0)
    return walk.slot


def _is_mapping(walk: GrammarWalk) -> bool:
    """Return whether a first word at this place is a key."""
    schema: Schema | None = walk.slot.schema
    return walk.is_step or isinstance(schema, OptionMapping | FreeMapping | Steps)
