"""Task files to their JSON form (`llm_form`): for examples that a model is shown, and for tests."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.lang.json_form.words import NAMED, POINTS, RECORDS, VALUED, field_key, is_hole
from formiga_bt.lang.kinds import KINDS, MODIFIERS, PARAM, RECORD_FIELD, TASK, Option
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse


def from_yaml(text: str, catalogue: Catalogue) -> dict[str, Any]:
    """Return the JSON form of a task file that has no errors.

    Args:
        text: of the file.
        catalogue: whose actions it uses.

    Raises:
        ValueError: the file has errors, and this form has no words for them.
    """
    node, _ = parse(text, "task.yaml")
    if not isinstance(node, Mapping_):
        raise ValueError("a task is a mapping")
    reader = _Reader(catalogue)
    return reader.options(node, TASK)


class _Reader:
    """Turns nodes into the JSON form."""

    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue

    def options(self, node: Mapping_, options: tuple[Option, ...]) -> dict[str, Any]:
        known = {option.name: option for option in options}
        return {e.key.text: self.option(e.key.text, e.value, _known(known, e.key.text)) for e in node.entries}

    def option(self, key: str, node: Node, option: Option) -> Any:
        form = option.form
        entries = node.entries if isinstance(node, Mapping_) else ()
        if form == "map" and key in NAMED:
            return [{"name": e.key.text, **self._named(e.value, NAMED[key])} for e in entries]
        if form == "map" and key == RECORDS:
            return [{"name": e.key.text, "fields": self._fields(e.value)} for e in entries]
        if form == "map" and key in VALUED:
            return [{"name": e.key.text, "value": self.value(e.value)} for e in entries]
        if form == "map" and key == "cases":
            return [{"value": e.key.text, "steps": self.steps(e.value)} for e in entries]
        if form == "steps":
            return self.steps(node)
        if isinstance(node, Mapping_) and option.keys:
            return self.options(node, option.keys)
        if form == "value" and option.name != "formiga":
            return self.value(node)
        if form == "words" and not isinstance(node, Listing):
            return _texts(node)
        if isinstance(node, Listing):
            return [text for item in node.items for text in _texts(item)]
        if isinstance(node, Mapping_):
            return {e.key.text: e.value.text for e in node.entries if isinstance(e.value, Scalar)}
        return _json_of(node, form, option)

    def _fields(self, node: Node) -> list[dict[str, Any]]:
        entries = node.entries if isinstance(node, Mapping_) else ()
        return [{"name": e.key.text, **self._named(e.value, RECORD_FIELD)} for e in entries]

    def _named(self, node: Node, options: tuple[Option, ...]) -> dict[str, Any]:
        if isinstance(node, Mapping_) and not (options in (PARAM, RECORD_FIELD) and node.get("type") is None):
            return self.options(node, options)
        if isinstance(node, Mapping_):
            return {"type": {e.key.text: e.value.text for e in node.entries if isinstance(e.value, Scalar)}}
        if not isinstance(node, Scalar):
            raise ValueError("a list where a name or a mapping is due")
        return {"type": node.text}

    def steps(self, node: Node) -> list[dict[str, Any]]:
        if not isinstance(node, Listing):
            raise ValueError("steps are a list")
        return [self.step(item) for item in node.items if isinstance(item, Mapping_)]

    def step(self, node: Mapping_) -> dict[str, Any]:
        words = [entry.key.text for entry in node.entries]
        options = {name for word in words if word in KINDS for name in (o.name for o in KINDS[word].options)}
        kind = next((word for word in words if word in KINDS and word not in options), "")
        if not kind:
            raise ValueError(f"a step of no kind: {', '.join(words)}")
        this = Option(kind, KINDS[kind].form, "", KINDS[kind].type)
        known = {option.name: option for option in (*MODIFIERS, this, *KINDS[kind].options)}
        found = {e.key.text: self.option(e.key.text, e.value, _known(known, e.key.text)) for e in node.entries}
        if kind != "do":
            return {kind: found.pop(kind), **found}
        role, _, action = str(found.pop("do")).partition(".")
        fields = {field_key(one["name"]): one["value"] for one in found.pop("with", ())}
        return {"action": action, "agent": role, **fields, **found}

    def value(self, node: Node) -> dict[str, Any]:
        if isinstance(node, Listing):
            return {"list": [self.value(item) for item in node.items]}
        if isinstance(node, Mapping_) and {e.key.text for e in node.entries} not in map(set, POINTS):
            return {"record": [{"name": e.key.text, "value": self.value(e.value)} for e in node.entries]}
        if isinstance(node, Mapping_):
            return {"lit": {e.key.text: e.value.text for e in node.entries if isinstance(e.value, Scalar)}}
        if is_hole(node.text) and node.text.count("${") == 1:
            return {"expr": node.text[2:-1]}
        if node.quoted or node.block or "${" in node.text:
            return {"text": node.text}
        return {"lit": node.text}


def _texts(item: Node) -> list[str]:
    """Return an item of a list of words; `dock_bay: 2` is one, too."""
    if isinstance(item, Mapping_):
        return [f"{e.key.text}: {e.value.text}" for e in item.entries if isinstance(e.value, Scalar)]
    return [item.text] if isinstance(item, Scalar) else []


def _known(options: Mapping[str, Option], key: str) -> Option:
    if key not in options:
        raise ValueError(f"'{key}' is no key here")
    return options[key]


def _json_of(node: Scalar, form: str, option: Option) -> Any:
    if form == "flag":
        return node.text == "true"
    return int(node.text) if option.type == "int" else node.text
