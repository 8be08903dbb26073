"""Tasks in JSON form (`llm_form`) to YAML files, and from there through the loader of all tasks.

`to_yaml` writes the YAML file that such an object means; `load_task_json` checks that file, and says of each problem where in
the JSON it stands.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.diagnostics import Diagnostic, Mark
from formiga_bt.lang.json_form.words import NAMED, OF_ACTIONS, RECORDS, VALUED, is_hole
from formiga_bt.lang.kinds import KINDS, MODIFIERS, RECORD_FIELD, TASK, Option
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.text.document import Mapping_, Scalar, parse

_HIDDEN: Final = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff]")
_PATH_STEP: Final = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True, slots=True)
class JsonProblem:
    """A problem and where it stands in the JSON: `$.steps[0].to`."""

    path: str
    diagnostic: Diagnostic
    """Its message has JSON paths where another one names lines."""


@dataclass(frozen=True, slots=True)
class LoadedJson:
    """What became of a task in JSON form."""

    task: Task | None
    problems: list[JsonProblem]
    yaml: str
    """The file that it means; empty if the JSON cannot be read at all."""


def load_task_json(
    data: Any,
    *,
    catalogue: Catalogue,
    site: Site | None = None,
    library: Sequence[Path] | None = None,
    name: str = "task.json",
) -> LoadedJson:
    """Read and check a task in JSON form.

    Args:
        data: the JSON value, or its text.
        catalogue: agent types and actions.
        site: where it is to run, if that is known.
        library: the folders where imports are looked up; None = the packaged trees.
        name: how diagnostics call it.
    """
    if isinstance(data, str):
        try:
            data = json.loads(data)
        except (ValueError, RecursionError) as error:
            return _unreadable(f"this is not JSON: {error}", name)
    if not isinstance(data, dict):
        return _unreadable("a task is a JSON object", name)
    try:
        text, paths = to_yaml(data)
    except FormError as error:
        return _unreadable(str(error), name, error.path)
    loaded = load_task_text(text, name, catalogue=catalogue, site=site, library=library, labels=paths)
    problems = []
    for found in loaded.diagnostics:
        inside = found.mark.file == name
        path = paths.get(found.mark.line, "$") if inside else str(found.mark)
        problems.append(JsonProblem(path, found))
    return LoadedJson(loaded.task, problems, text)


class FormError(ValueError):
    """The JSON is not of this form; `path` says where."""

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path


def _unreadable(message: str, name: str, path: str = "$") -> LoadedJson:
    return LoadedJson(None, [JsonProblem(path, Diagnostic("E008", Mark(name, 1, 1), message))], "")


def to_yaml(data: Mapping[str, Any]) -> tuple[str, dict[int, str]]:
    """Return the YAML file that a task in JSON form means, and the JSON path by its lines.

    Raises:
        FormError: the JSON is not of this form.
    """
    writer = _Writer()
    writer.options(data, TASK, 0, "$", first={"formiga": 1} if "formiga" not in data else {})
    return "".join(f"{line}\n" for line in writer.lines), dict(enumerate(writer.paths, 1))


class _Writer:
    """Writes lines, one key or item each, and remembers whence each came."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.paths: list[str] = []

    def line(self, indent: int, text: str, path: str) -> None:
        self.lines.append(" " * indent + text)
        self.paths.append(path)

    def options(
        self, data: Any, options: tuple[Option, ...], indent: int, path: str, first: Mapping[str, Any] | None = None
    ) -> None:
        """Write the keys of an object; those that no option knows are written as they are, for the checker to refuse."""
        known = {option.name: option for option in options}
        for key, value in {**(first or {}), **_object(data, path)}.items():
            if value is not None and not (key == "name" and "name" not in known):
                self.option(key, value, known.get(key), indent, f"{path}{_key(key)}")

    def option(self, key: str, value: Any, option: Option | None, indent: int, path: str) -> None:
        """Write one key with its value."""
        form = option.form if option is not None else ""
        word = _plain(key)
        if form == "map" and key in NAMED:
            self.block(word, indent, path)
            self.entries(value, NAMED[key], indent + 2, path)
        elif form == "map" and key == RECORDS:
            self.block(word, indent, path)
            for index, one in enumerate(_list(value, path)):
                at = f"{path}[{index}]"
                self.line(indent + 2, f"{_plain(_name(one, at))}:", at)
                self.entries(one.get("fields"), RECORD_FIELD, indent + 4, f"{at}.fields")
        elif form == "map" and key in VALUED:
            self.block(word, indent, path)
            for index, one in enumerate(_list(value, path)):
                at = f"{path}[{index}]"
                self.value(f"{_plain(_name(one, at))}:", one.get("value"), indent + 2, f"{at}.value")
        elif form == "map" and key == "cases":
            self.block(word, indent, path)
            for index, one in enumerate(_list(value, path)):
                at = f"{path}[{index}]"
                self.line(indent + 2, f"{_plain(str(_object(one, at).get('value', '')))}:", at)
                self.steps(one.get("steps"), indent + 4, f"{at}.steps")
        elif form == "steps":
            self.block(word, indent, path)
            self.steps(value, indent + 2, path)
        elif form == "options" or (option is not None and option.keys and _is_object(value, option.keys)):
            self.block(word, indent, path)
            self.options(value, option.keys if option is not None else (), indent + 2, path)
        elif form == "value" or isinstance(value, dict):
            self.value(f"{word}:", value, indent, path)
        elif isinstance(value, list):
            self.block(word, indent, path)
            for index, item in enumerate(value):
                self.line(indent + 2, f"- {_scalar(item, f'{path}[{index}]')}", f"{path}[{index}]")
            if not value:
                self.lines[-1] += " []"
        else:
            self.line(indent, f"{word}: {_scalar(value, path, text=form == 'text')}", path)

    def entries(self, value: Any, options: tuple[Option, ...], indent: int, path: str) -> None:
        """Write objects with `name` as a mapping of their names."""
        for index, one in enumerate(_list(value, path)):
            at = f"{path}[{index}]"
            self.line(indent, f"{_plain(_name(one, at))}:", at)
            self.options({k: v for k, v in one.items() if k != "name"}, options, indent + 2, at)

    def block(self, word: str, indent: int, path: str) -> None:
        self.line(indent, f"{word}:", path)

    def value(self, head: str, value: Any, indent: int, path: str) -> None:
        """Write a value after `key:` or `-`."""
        if not isinstance(value, dict) or len(value) != 1:
            if isinstance(value, (dict, list)) or value is None:
                raise FormError(
                    path, 'a value is {"lit": ..}, {"expr": ..}, {"text": ..}, {"list": [..]} or {"record": [..]}'
                )
            self.line(indent, f"{head} {_scalar(value, path)}", path)
            return
        ((kind, inner),) = value.items()
        path = f"{path}.{kind}"
        if kind == "expr" and isinstance(inner, str):
            self.line(indent, f"{head} {_plain('${' + inner + '}')}", path)
        elif kind == "text" and isinstance(inner, str):
            self.line(indent, f"{head} {_quoted(inner)}", path)
        elif kind == "list" and isinstance(inner, list):
            self.line(indent, head + ("" if inner else " []"), path)
            for index, item in enumerate(inner):
                self.value("-", item, indent + 2, f"{path}[{index}]")
        elif kind == "record" and isinstance(inner, list):
            self.line(indent, head if inner else f"{head} {{}}", path)
            for index, one in enumerate(inner):
                at = f"{path}[{index}]"
                self.value(f"{_plain(_name(one, at))}:", one.get("value"), indent + 2, f"{at}.value")
        elif kind == "lit" and isinstance(inner, dict):
            inside = ", ".join(f"{_plain(k)}: {_scalar(v, path)}" for k, v in inner.items() if v is not None)
            self.line(indent, f"{head} {{{inside}}}", path)
        elif kind == "lit" and not isinstance(inner, list) and inner is not None:
            self.line(indent, f"{head} {_scalar(inner, path)}", path)
        else:
            raise FormError(
                path, 'a value is {"lit": ..}, {"expr": ..}, {"text": ..}, {"list": [..]} or {"record": [..]}'
            )

    def steps(self, value: Any, indent: int, path: str) -> None:
        """Write a list of steps."""
        steps = _list(value, path)
        if not steps:
            self.lines[-1] += " []"
        for index, step in enumerate(steps):
            self.step(_object(step, f"{path}[{index}]"), indent, f"{path}[{index}]")

    def step(self, step: Mapping[str, Any], indent: int, path: str) -> None:
        """Write one step; its first key stands behind the dash."""
        start = len(self.lines)
        if "action" in step and step["action"] is not None:
            self._action(step, indent + 2, path)
        else:
            kind = next((key for key in step if key in KINDS and step[key] is not None), "")
            own = KINDS[kind].options if kind else ()
            this = (Option(kind, KINDS[kind].form, "", KINDS[kind].type),) if kind else ()
            known = {option.name: option for option in (*MODIFIERS, *this, *own)}
            ordered = {**({kind: step[kind]} if kind else {}), **step}
            for key, value in ordered.items():
                if value is not None:
                    self.option(key, value, known.get(key), indent + 2, f"{path}{_key(key)}")
        if len(self.lines) == start:
            self.line(indent, "- {}", path)
        else:
            self.lines[start] = f"{' ' * indent}- {self.lines[start][indent + 2 :]}"

    def _action(self, step: Mapping[str, Any], indent: int, path: str) -> None:
        self.line(indent, f"do: {_scalar(step.get('agent'), path)}.{_scalar(step['action'], path)}", path)
        known = {option.name: option for option in (*MODIFIERS, *KINDS["do"].options)}
        fields = {key: value for key, value in step.items() if key not in OF_ACTIONS and value is not None}
        if fields:
            self.block("with", indent, path)
        for key, value in fields.items():
            name = key.removeprefix("field_") if key.removeprefix("field_") in OF_ACTIONS else key
            self.value(f"{_plain(name)}:", value, indent + 2, f"{path}{_key(key)}")
        for key, value in step.items():
            if key in known and key != "with" and value is not None:
                self.option(key, value, known[key], indent, f"{path}{_key(key)}")


def _key(key: str) -> str:
    return f".{key}" if _PATH_STEP.fullmatch(key) else f"[{json.dumps(key)}]"


def _object(value: Any, path: str) -> dict[str, Any]:
    if isinstance(value, dict):
        return value
    raise FormError(path, "this must be an object")


def _list(value: Any, path: str) -> list[Any]:
    if isinstance(value, list):
        return value
    raise FormError(path, "this must be a list")


def _name(value: Any, path: str) -> str:
    name = _object(value, path).get("name")
    if isinstance(name, str):
        return name
    raise FormError(path, "this object needs a name")


def _is_object(value: Any, keys: tuple[Option, ...]) -> bool:
    return isinstance(value, dict) and bool(value) and set(value) <= {option.name for option in keys}


def _scalar(value: Any, path: str, *, text: bool = False) -> str:
    """Return a scalar as YAML, in quotes where it needs them."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return str(value)
    if not isinstance(value, str):
        raise FormError(path, "this must be a text, a number, true or false")
    return _quoted(value) if text and "${" not in value[:2] else _plain(value)


def _plain(text: str) -> str:
    node, found = parse(f"k: {text}\n", "")
    value = node.entries[0].value if isinstance(node, Mapping_) and len(node.entries) == 1 else None
    is_plain = not found and isinstance(value, Scalar) and value.text == text and not (value.quoted or value.block)
    if not is_plain or not text:
        return _quoted(text)
    return text if is_hole(text) or not set(text) & set("{}[],") else _quoted(text)


def _quoted(text: str) -> str:
    """Return a text in quotes; what cannot be seen, and would be refused in a file, is written as an escape."""
    return _HIDDEN.sub(lambda m: f"\\u{ord(m[0]):04x}", json.dumps(text, ensure_ascii=False))
