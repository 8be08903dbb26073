"""XML elements with their lines: read safely from text, written with comments.

`parse` refuses what could harm before anything is built: document types (so no entity is ever declared), more than
1 MB, more than 64 levels, more than 20 000 elements, any processing instruction. Called by `btcpp_in`; `write` by
`btcpp_out`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final
from xml.parsers.expat import ErrorString, ExpatError, ParserCreate

MAX_BYTES: Final = 1_000_000
MAX_DEPTH: Final = 64
MAX_ELEMENTS: Final = 20_000


_VALUE: Final = re.compile(rb"=\s*(?:\"[^\"]*\"|'[^']*')")
"""Attributes such as `code="a < 3 && b"` are no XML either, and BT.CPP reads them too."""


def _escaped(value: re.Match[bytes]) -> bytes:
    return re.sub(rb"&(?!#?\w+;)", b"&amp;", value[0]).replace(b"<", b"&lt;")


def _without_comments(data: bytes) -> bytes:
    """Return the text with blanks for comments: rulers (`<!------->`) are no XML, but tutorials of BT.CPP have them."""
    pieces: list[bytes] = []
    at = 0
    while (start := data.find(b"<!--", at)) >= 0 and (end := data.find(b"-->", start + 4)) >= 0:
        pieces += [data[at:start], re.sub(rb"[^\n]", b" ", data[start : end + 3])]
        at = end + 3
    return b"".join([*pieces, data[at:]])


class XmlRefused(Exception):  # noqa: N818 - it names what is wrong
    """The text is no XML that we read; `line` and `col` are 1-based."""

    def __init__(self, line: int, col: int, message: str, mend: str = "") -> None:
        super().__init__(message)
        self.line, self.col, self.message, self.mend = line, col, message, mend


@dataclass(slots=True)
class XmlElement:
    """An element; `line` and `col` (1-based) tell where it stood in the text that was read, 0 = nowhere."""

    tag: str
    attrs: dict[str, str] = field(default_factory=dict)
    children: "list[XmlElement]" = field(default_factory=list)
    text: str = ""
    comment: str = ""
    """Written before the element."""
    line: int = 0
    col: int = 0

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute."""
        return self.attrs.get(name, default)

    def walk(self) -> "Iterator[XmlElement]":
        """Return the element and all below it, in document order."""
        stack = [self]
        while stack:
            one = stack.pop()
            yield one
            stack.extend(reversed(one.children))


def parse(data: bytes) -> XmlElement:
    """Return the root element of an XML document.

    Raises:
        XmlRefused: it is malformed, too large, too deep, or has a document type or a processing instruction.
    """
    if len(data) > MAX_BYTES:
        raise XmlRefused(1, 1, "the file is larger than 1 MB", "split it into several files")
    data = _without_comments(data)
    try:
        return _Reader().read(data)
    except XmlRefused:
        mended = _VALUE.sub(_escaped, data)
        if mended == data:
            raise
    return _Reader().read(mended)


class _Reader:
    def __init__(self) -> None:
        self.parser: Any = ParserCreate()
        self.root: XmlElement | None = None
        self.stack: list[XmlElement] = []
        self.count = 0
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.characters
        self.parser.StartDoctypeDeclHandler = self.doctype
        self.parser.ProcessingInstructionHandler = self.instruction
        self.parser.buffer_text = True

    def read(self, data: bytes) -> XmlElement:
        try:
            self.parser.Parse(data, True)
        except ExpatError as error:
            raise XmlRefused(error.lineno, error.offset + 1, f"this is not XML: {ErrorString(error.code)}") from None
        except ValueError as error:  # an encoding with several bytes per character
            raise XmlRefused(1, 1, f"this encoding cannot be read: {error}", "save the file as UTF-8") from None
        except LookupError:
            raise XmlRefused(1, 1, "this encoding is not known", "save the file as UTF-8") from None
        assert self.root is not None, "expat refuses a document without elements"
        return self.root

    def refuse(self, message: str, mend: str = "") -> XmlRefused:
        return XmlRefused(self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1, message, mend)

    def start(self, tag: str, attrs: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise self.refuse(f"more than {MAX_ELEMENTS} elements")
        if len(self.stack) >= MAX_DEPTH:
            raise self.refuse(f"more than {MAX_DEPTH} levels", "move inner parts into subtrees")
        line, col = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        element = XmlElement(tag, dict(attrs), line=line, col=col)
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)

    def end(self, _tag: str) -> None:
        self.stack.pop()

    def characters(self, text: str) -> None:
        self.stack[-1].text += text

    def doctype(self, *_: object) -> None:
        raise self.refuse("a document type (DOCTYPE) is not read", "remove it; trees need no entities")

    def instruction(self, *_: object) -> None:
        raise self.refuse("a processing instruction is not read", "remove it")


def write(root: XmlElement, head: str = "") -> str:
    """Return the document as text, two blanks a level, attributes on one line; `head` becomes the first comment."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines += _comment(head, "")
    _write(root, "", lines)
    return "\n".join(lines) + "\n"


def _write(element: XmlElement, pad: str, lines: list[str]) -> None:
    lines += _comment(element.comment, pad)
    attrs = "".join(f' {name}="{escape(value)}"' for name, value in element.attrs.items())
    if not element.children:
        text = escape(element.text)
        lines.append(f"{pad}<{element.tag}{attrs}>{text}</{element.tag}>" if text else f"{pad}<{element.tag}{attrs}/>")
        return
    lines.append(f"{pad}<{element.tag}{attrs}>")
    for child in element.children:
        _write(child, pad + "  ", lines)
    lines.append(f"{pad}</{element.tag}>")


def _comment(text: str, pad: str) -> list[str]:
    if not text:
        return []
    safe = "".join(ch for ch in text if ch >= " " or ch == "\n").replace("--", "- -")
    first, *rest = safe.split("\n")
    body = [f"{pad}<!-- {first}", *(f"{pad}     {line}".rstrip() for line in rest)]
    body[-1] += " -->"
    return body


_ESCAPES: Final = {ord("&"): "&amp;", ord("<"): "&lt;", ord(">"): "&gt;", ord('"'): "&quot;", 10: "&#10;", 9: "&#9;"}
_NO_XML: Final = dict.fromkeys(
    [*(n for n in range(32) if n not in (9, 10)), 0xFFFE, 0xFFFF, *range(0xD800, 0xE000)], "?"
)


def escape(text: str) -> str:
    """Return text as it stands in an attribute; characters that XML cannot hold become `?`."""
    return text.translate({**_NO_XML, **_ESCAPES})
