"""YAML text to JSON by YAML 1.2's core schema, which is how yaml-language-server reads a file."""

import re
from typing import Any

from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse

_WORDS = {"true": True, "false": False, "null": None, "~": None, "": None}


def as_json(text: str) -> Any:
    """Return the JSON value of a YAML text without errors."""
    node, found = parse(text, "file.yaml")
    assert node is not None, found
    return _value(node)


def _value(node: Node) -> Any:
    if isinstance(node, Mapping_):
        return {entry.key.text: _value(entry.value) for entry in node.entries}
    if isinstance(node, Listing):
        return [_value(item) for item in node.items]
    assert isinstance(node, Scalar)
    if node.quoted or node.block:
        return node.text
    if node.text.lower() in _WORDS:
        return _WORDS[node.text.lower()]
    if re.fullmatch(r"[-+]?\d+", node.text):
        return int(node.text)
    if re.fullmatch(r"[-+]?(\.\d+|\d+(\.\d*)?)([eE][-+]?\d+)?", node.text):
        return float(node.text)
    return node.text
