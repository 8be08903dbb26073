"""Canonical YAML text of a task file: block style, keys in the order given, quotes only where they are needed.

A value is text, a list, or a mapping with text keys. The key `TODO` of a mapping holds lines of comment for the item.
Called by the importer, and by the exporter for values in flow style.
"""

import re
from typing import Any, Final

TODO: Final = "#"
"""Key of the comments of a mapping."""

LONGEST_KEY: Final = 160
"""YAML has no keys of more than 1024 characters; escaped, one is up to six times as long."""

_PLAIN: Final = re.compile(r"[^\s\-?:,\[\]{}#&*!|>'\"%@`][^\x00-\x1f\x7f]*")
_FLOW_ODD: Final = re.compile(r"[,\[\]{}]")


class FlowMapping(dict[str, Any]):
    """A mapping that is written in flow style."""


def flow(value: Any) -> str:
    """Return a value in flow style on one line."""
    if isinstance(value, dict):
        return (
            "{" + ", ".join(f"{_quoted(str(k)[:LONGEST_KEY], inside=True)}: {flow(v)}" for k, v in value.items()) + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(flow(item) for item in value) + "]"
    return "null" if value is None else _quoted(str(value), inside=True)


def document(value: dict[str, Any]) -> str:
    """Return a mapping as a document in block style."""
    lines: list[str] = []
    _mapping(value, "", lines)
    return "\n".join(lines) + "\n"


def _comments(value: Any, pad: str, lines: list[str]) -> None:
    if isinstance(value, dict):
        lines += [f"{pad}# TODO: {one_line(text)}" for text in value.get(TODO, ())]


def _mapping(value: dict[str, Any], pad: str, lines: list[str]) -> None:
    for key, item in value.items():
        if key != TODO:
            _comments(item, pad, lines)
            _pair(key, item, pad, lines)


def _pair(key: str, item: Any, pad: str, lines: list[str]) -> None:
    head = f"{pad}{_quoted(key[:LONGEST_KEY])}:"
    if isinstance(item, dict) and not isinstance(item, FlowMapping) and [k for k in item if k != TODO]:
        lines.append(head)
        _mapping(item, pad + "  ", lines)
    elif isinstance(item, dict):
        lines.append(f"{head} {flow({k: v for k, v in item.items() if k != TODO})}")
    elif isinstance(item, list) and item and any(isinstance(one, dict) for one in item):
        lines.append(head)
        for one in item:
            _item(one, pad + "  ", lines)
    elif isinstance(item, list):
        lines.append(f"{head} {flow(item)}")
    else:
        lines.append(f"{head} {'null' if item is None else _quoted(str(item))}".rstrip())


def _item(value: Any, pad: str, lines: list[str]) -> None:
    _comments(value, pad, lines)
    if isinstance(value, FlowMapping) or not isinstance(value, dict):
        lines.append(f"{pad}- {flow(value)}")
        return
    inner: list[str] = []
    _mapping(value, pad + "  ", inner)
    first = next(i for i, line in enumerate(inner) if not line.lstrip().startswith("# TODO"))
    comments = [pad + line.lstrip() for line in inner[:first]]
    lines += [*comments, f"{pad}- {inner[first].lstrip()}", *inner[first + 1 :]]


def one_line(text: str) -> str:
    """Return text without line ends and control characters."""
    return " ".join("".join(ch if ch.isprintable() else " " for ch in text).split())


def _quoted(text: str, *, inside: bool = False) -> str:
    """Return a scalar, with quotes if plain style would not give the same text back (`inside` flow style: stricter)."""
    odd = not _PLAIN.fullmatch(text) or ": " in text or " #" in text or text != text.strip() or text.endswith(":")
    if re.match(r"-?[\d.]", text):
        odd = ": " in text or " #" in text or text != text.strip() or text.endswith(":") or not text.isprintable()
    if not text.isprintable() or text in ("null", "~"):
        odd = True
    if inside and _FLOW_ODD.search(text):
        odd = True
    if not odd:
        return text
    escaped = "".join(_escape(ch) for ch in text)
    return f'"{escaped}"'


def _escape(ch: str) -> str:
    if ch in '"\\':
        return "\\" + ch
    if ch == "\n":
        return "\\n"
    if ch == "\t":
        return "\\t"
    return ch if ch.isprintable() else f"\\u{min(ord(ch), 0xFFFD):04x}"
