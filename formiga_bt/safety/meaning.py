"""The fingerprint of what a task does: the same for a copy with other names, comments, or values of its params.

Pure functions. It tells whether a task is one that a model wrote before (`services.kept.drafted`). Two tasks with one
fingerprint send the same machines the same goals in the same order; what may differ:

| differs | because |
|---|---|
| names of the task, its params, roles, vars, loops and saved results; step names and notes; comments, layout | they only name |
| defaults of params, labels, help, aliases, the description, the version | who requests a task may give other values |
| priority, timeouts of the whole task, its envelope, the order of declarations | they change when, not what |

Anything else that differs, an added step for example, gives another fingerprint.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any, Final

from msgspec import Struct

from formiga_bt.lang.model import Call, Expr, For, Param, Role, Subtree, Task, Who, WithAgents
from formiga_bt.lang.types import Type

_WORD: Final = re.compile(r"(?<![\w.'])[A-Za-z_]\w*")
_HOLE: Final = re.compile(r"\$\{[^}]*\}")
_SILENT: Final = frozenset({"mark", "seg", "name", "note", "said_mode", "actions", "room", "label", "help", "aliases"})
_NAMES: Final = ("save_as", "collect", "first")


def meaning(task: Task) -> str:
    """Return the SHA-256 (hex) over what a task does."""
    writer = _Writer(task)
    sections = [writer.plain(part) for part in (task.steps, task.on_failure, task.on_abort, task.finally_)]
    text = json.dumps(["formiga meaning 1", *sections, *writer.declared(task.params, task.roles, task.vars)])
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


class _Writer:
    """Writes one body, the names of its own by their numbers in the order in which they are met."""

    def __init__(self, task: Task | None, subtree: Subtree | None = None, home: str = "") -> None:
        self._home = task.mark.file if task is not None else home
        steps: Any = (task.steps, task.on_failure, task.on_abort, task.finally_) if task is not None else ()
        self._own: set[str] = set()
        if task is not None:
            self._own |= {*task.params, *task.roles, *task.vars}
        if subtree is not None:
            steps = subtree.steps
            self._own |= set(subtree.params)
        self._collect(steps)
        self._numbers: dict[str, int] = {}

    def _collect(self, value: Any) -> None:
        if isinstance(value, tuple):
            for one in value:
                self._collect(one)
        elif isinstance(value, Struct) and not isinstance(value, Expr | Subtree):
            self._own |= {name for key in _NAMES if (name := getattr(value, key, ""))}
            if isinstance(value, For):
                self._own |= set(value.lists)
            if isinstance(value, WithAgents):
                self._own |= set(value.roles)
            for name in value.__struct_fields__:
                self._collect(getattr(value, name))

    def plain(self, value: Any) -> Any:
        """Return a part of the model as plain lists."""
        if isinstance(value, Expr):
            return self._source(value)
        if isinstance(value, Who):
            return ["who", value.site_role, self._source(value.agent) if value.agent is not None else value.name]
        if isinstance(value, Subtree):
            return self._subtree(value)
        if isinstance(value, Type):
            return str(value)
        if isinstance(value, Role | Param):
            return self._fields(value, {"default"})
        if isinstance(value, Mapping):
            return [[self._named(str(key)), self.plain(one)] for key, one in value.items()]
        if isinstance(value, tuple | list):
            return [self.plain(one) for one in value]
        if isinstance(value, Struct):
            return [type(value).__name__, *self._fields(value, set())]
        return value if isinstance(value, str | int | float | bool) or value is None else str(value)

    def declared(self, params: Mapping[str, Param], roles: Mapping[str, Role], vars_: Mapping[str, Expr]) -> list[Any]:
        """Return what is declared, in the order in which the steps use it."""
        rows = [["var", name, self.plain(expr)] for name, expr in vars_.items()]
        rows += [["role", name, self.plain(role)] for name, role in roles.items()]
        rows += [["param", name, self.plain(param)] for name, param in params.items()]
        unmet = len(self._numbers)
        keyed = [[self._numbers.get(name, unmet), kind, said] for kind, name, said in rows]
        return sorted(keyed, key=json.dumps)

    def _fields(self, value: Struct, without: set[str]) -> list[Any]:
        found: list[Any] = []
        for name in value.__struct_fields__:
            if name in _SILENT or name in without:
                continue
            here = getattr(value, name)
            if name in _NAMES:
                found.append(self._number(here) if here else "")
            elif name == "args" and isinstance(value, Call):
                found.append([self.plain(expr) for expr in here.values()])
            else:
                found.append(self.plain(here))
        return found

    def _subtree(self, subtree: Subtree) -> Any:
        """Return a subtree: one of a library that ships by its name, one of the author's own by what it does."""
        file = subtree.mark.file
        if file != self._home and not file.startswith("/"):
            return ["ships", subtree.name]
        inner = _Writer(None, subtree, self._home)
        said = [inner.plain(subtree.steps), inner.plain(subtree.returns)]
        return ["own", *said, [inner.plain(one.type) for one in subtree.params.values()]]

    def _source(self, expr: Expr) -> str:
        text = " ".join(expr.source.split())
        if expr.is_const:
            return text
        if "${" in text:
            return _HOLE.sub(lambda m: self._renamed(m[0]), text)
        return self._renamed(text)

    def _renamed(self, text: str) -> str:
        return _WORD.sub(lambda m: self._named(m[0]), text)

    def _named(self, name: str) -> str:
        return self._number(name) if name in self._own else name

    def _number(self, name: str) -> str:
        return f"#{self._numbers.setdefault(name, len(self._numbers))}"
