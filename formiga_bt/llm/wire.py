"""What goes over the wire to an endpoint and back: server-sent events, whole answers, failures. Plain data, no connection.

`client` makes the request; everything that an endpoint sends is read here, with bounds, and never trusted.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from msgspec import Struct

from formiga_bt.llm.letters import whole
from formiga_bt.llm.records import Usage

LONGEST_EVENT: Final = 8 * 1024 * 1024
"""Bytes of one event, or of an answer that is not streamed."""
SHOWN: Final = 300
"""Letters of an endpoint's own words that are shown to a person."""
SHORTEST_KEY: Final = 8
"""A shorter one is no secret but a word that a server of one's own wants (`none`, `EMPTY`), and stays in answers."""


class EndpointFailure(Struct, frozen=True, kw_only=True):
    """Why there is no answer: an error of the endpoint, or of the way to it."""

    status: int = 0
    """Of HTTP; 0: no answer came."""
    text: str = ""
    """The endpoint's words, for us to judge."""
    param: str = ""
    """The parameter that it complains of, if it says so."""
    retry_after_s: float | None = None
    is_timeout: bool = False
    is_lasting: bool = False
    """Asking again does not help."""


class AnswerPiece(Struct, frozen=True, kw_only=True):
    """A part of an answer."""

    text: str = ""
    tokens: int = 0
    finish: str = ""
    usage: Usage | None = None
    is_last: bool = False
    """The endpoint says that the answer is complete, if not how it ended."""


class NotTheProtocol(ValueError):  # noqa: N818
    """The endpoint sends something else than the protocol."""


def pieces(kind: str, chunks: Iterable[bytes]) -> Iterator[AnswerPiece]:
    """Yield the parts of an answer.

    Args:
        kind: its content type.
        chunks: its body.

    Raises:
        NotTheProtocol: it is neither events nor JSON of the protocol, or an error told in the middle of a stream.
    """
    if "event-stream" not in kind:
        yield _piece(_object(b"".join(_bounded(chunks))), "message")
        yield AnswerPiece(is_last=True)
        return
    for event in _events(chunks):
        yield AnswerPiece(is_last=True) if event == b"[DONE]" else _piece(_object(event), "delta")


def _bounded(chunks: Iterable[bytes]) -> Iterator[bytes]:
    total = 0
    for chunk in chunks:
        total += len(chunk)
        if total > LONGEST_EVENT:
            raise NotTheProtocol("an answer without end")
        yield chunk


def _events(chunks: Iterable[bytes]) -> Iterator[bytes]:
    rest = b""
    for chunk in chunks:
        *lines, rest = (rest + chunk).split(b"\n")
        if len(rest) > LONGEST_EVENT:
            raise NotTheProtocol("a line without end")
        for line in lines:
            if line.startswith(b"data:"):
                data = line[5:].strip()
                yield data
                if data == b"[DONE]":
                    return
            elif line.startswith((b"<", b"{")):
                raise NotTheProtocol("no events")
    if rest.startswith((b"<", b"{")):
        raise NotTheProtocol("no events")


def _object(raw: bytes) -> Mapping[str, Any]:
    try:
        found = json.loads(raw)
    except (ValueError, RecursionError):
        raise NotTheProtocol(f"no JSON: {shown(raw[:SHOWN].decode('utf-8', 'replace'))}") from None
    if not isinstance(found, dict):
        raise NotTheProtocol("no JSON object")
    if found.get("error"):
        raise NotTheProtocol(f"an error in the middle: {shown(message_of(found)[0])}")
    return found


def _piece(found: Mapping[str, Any], key: str) -> AnswerPiece:
    usage = _usage(found.get("usage"))
    choices = found.get("choices")
    if not isinstance(choices, list):
        raise NotTheProtocol("no choices")
    if not choices:
        return AnswerPiece(usage=usage)
    choice = choices[0] if isinstance(choices[0], dict) else {}
    found_said = choice.get(key)
    said = found_said if isinstance(found_said, dict) else {}
    text = said.get("content") or said.get("refusal") or ""
    tokens = 1 if text or said.get("reasoning") or said.get("reasoning_content") else 0
    finish = choice.get("finish_reason") or ""
    return AnswerPiece(text=_whole(text), tokens=tokens, finish=finish if isinstance(finish, str) else "", usage=usage)


def _whole(text: Any) -> str:
    """Return the text, or the texts of a list of parts, without halves of letters."""
    if isinstance(text, list):
        text = "".join(str(part.get("text", "")) for part in text if isinstance(part, dict))
    return str(whole(str(text)))


def _usage(found: Any) -> Usage | None:
    if not isinstance(found, dict):
        return None
    details = found.get("prompt_tokens_details")
    cached = details.get("cached_tokens") if isinstance(details, dict) else 0
    return Usage(_count(found.get("prompt_tokens")), _count(cached), _count(found.get("completion_tokens")))


def _count(value: Any) -> int:
    return max(0, value) if isinstance(value, int) and not isinstance(value, bool) else 0


def message_of(body: Any) -> tuple[str, str]:
    """Return an error's words, with its type and code, and the parameter that it names, from the body of a refusal."""
    if isinstance(body, dict) and isinstance(body.get("error"), dict):
        body = body["error"]
    if not isinstance(body, dict):
        return str(body or ""), ""
    words = body.get("message") or body.get("error") or body.get("detail") or ""
    marks = [str(body[key]) for key in ("type", "code") if body.get(key)]
    return " ".join([words if isinstance(words, str) else json.dumps(words), *marks]), str(body.get("param") or "")


def shown(text: str) -> str:
    """Return an endpoint's words as a person may see them: one short line, nothing that moves a terminal's cursor."""
    line = re.sub(r"[\s\x00-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069]+", " ", text).strip()
    return line if len(line) <= SHOWN else line[: SHOWN - 3] + "..."


def masked(text: str, key: str) -> str:
    """Return an answer without the key that the endpoint was asked with, should it say that again."""
    if len(key) < SHORTEST_KEY:
        return text
    return text.replace(key, "***").replace(key.replace("/", "\\/"), "***")


def retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return how long an endpoint asks to wait; None: it does not say, or not as a number."""
    for key, scale in (("retry-after-ms", 1e-3), ("retry-after", 1.0)):
        try:
            seconds = float(headers[key]) * scale
        except (KeyError, ValueError):
            continue
        if 0 <= seconds < 1e9:
            return seconds
    return None
