"""The ladder of structured output: from a strict schema, over a schema and JSON mode, down to words and a fenced block.

Endpoints that speak the same protocol differ in how they hold a model to a form. `client` asks on a rung; if the endpoint says
that it does not know that form, it asks one rung lower, and the rung is remembered for the endpoint and the model.
"""

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from formiga_bt import __version__
from formiga_bt.llm.folders import cache_folder, read_object, write_object
from formiga_bt.llm.records import Rung

RUNGS: Final[tuple[Rung, ...]] = ("strict", "schema", "json", "text")
WRAPPED: Final = "answer"
"""Key around an answer that is no plain object, where the form must be one."""
IN_WORDS: Final = (
    "Answer with one JSON value and nothing else. It must be valid under this JSON Schema, which has all keys that "
    "there are:\n"
)
FENCED: Final = "Put it in one fenced block that begins with ```json and ends with ```.\n"
OF_FORM: Final = re.compile(
    r"response_format|response format|json_schema|json schema|json_object|json mode|structured output|guided_|"
    r"\bgrammar\b|\bschema\b",
    re.IGNORECASE,
)
OF_LENGTH: Final = re.compile(
    r"context[_ ](?:length|size|window)|exceed_context|maximum context|too many tokens|prompt is too long",
    re.IGNORECASE,
)
ONE_ANSWER: Final = re.compile(r"json_validate_failed|failed_generation|failed to generate json", re.IGNORECASE)


def lower(rung: Rung) -> Rung | None:
    """Return the next rung down; None below the lowest."""
    at = RUNGS.index(rung) + 1
    return RUNGS[at] if at < len(RUNGS) else None


def is_about_form(status: int, text: str) -> bool:
    """Return whether an error says that the endpoint does not know the form that was asked for."""
    if status not in (400, 404, 422, 500, 501) or is_about_length(text):
        return False
    return OF_FORM.search(text) is not None or ONE_ANSWER.search(text) is not None


def is_about_length(text: str) -> bool:
    """Return whether an error says that the question is too long for the model."""
    return OF_LENGTH.search(text) is not None


def is_of_one_answer(text: str) -> bool:
    """Return whether an error tells of one answer that missed the form, not of the endpoint: nothing to remember."""
    return ONE_ANSWER.search(text) is not None


def response_format(rung: Rung, schema: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the `response_format` of a request; None: it has none."""
    if rung == "text":
        return None
    if rung == "json":
        return {"type": "json_object"}
    wire = strictly(schema) if rung == "strict" else dict(schema)
    return {"type": "json_schema", "json_schema": {"name": "answer", "strict": rung == "strict", "schema": wire}}


def said_in_prompt(rung: Rung, schema: Mapping[str, Any]) -> str:
    """Return what is added to the system's message on a rung: the schema in words, or nothing."""
    if rung in ("strict", "schema"):
        return ""
    words = IN_WORDS + json.dumps(schema, separators=(",", ":"), ensure_ascii=False)
    return words if rung == "json" else f"{words}\n{FENCED}"


def strictly(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema as strict services want it: an object at the root, every key required, null for what need not be.

    `plainly` takes the answer back to the form of the schema itself.
    """
    strict = _strict(schema)
    if schema.get("type") == "object":
        return dict(strict)
    definitions = strict.pop("$defs", None)
    wrapped = {
        "type": "object",
        "additionalProperties": False,
        "properties": {WRAPPED: strict},
        "required": [WRAPPED],
    }
    return {**wrapped, **({"$defs": definitions} if definitions else {})}


def plainly(data: Any, schema: Mapping[str, Any]) -> Any:
    """Return the answer to a strict schema in the form of the schema itself: unwrapped, without the nulls."""
    if schema.get("type") != "object" and isinstance(data, dict) and set(data) == {WRAPPED}:
        data = data[WRAPPED]
    return _without_nulls(data)


def _without_nulls(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _without_nulls(value) for key, value in data.items() if value is not None}
    return [_without_nulls(one) for one in data] if isinstance(data, list) else data


TYPES: Final = {str: "string", bool: "boolean", int: "integer", float: "number"}


def _strict(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_strict(one) for one in schema]
    if not isinstance(schema, Mapping):
        return schema
    rest = {key: value if key in ("const", "enum") else _strict(value) for key, value in schema.items()}
    values = [schema["const"]] if "const" in schema else schema.get("enum", [])
    kinds = {TYPES.get(type(value)) for value in values} if isinstance(values, list) else set()
    if len(kinds) == 1 and "type" not in schema and None not in kinds:
        rest = {"type": kinds.pop(), **rest}
    if schema.get("type") != "object" or not isinstance(schema.get("properties"), Mapping):
        return rest
    must = schema.get("required", [])
    rest["properties"] = {
        name: _strict(one) if name in must else {"anyOf": [_strict(one), {"type": "null"}]}
        for name, one in schema["properties"].items()
    }
    return {**rest, "required": list(schema["properties"]), "additionalProperties": False}


def json_in(text: str) -> Any:
    """Return the JSON value in an answer: the answer itself, a fenced block in it, or an object among words. None: none."""
    thought = text.rfind("</think>")
    body = text[thought + len("</think>") :] if thought >= 0 else text
    for piece in (body, *_fenced(body), *_braced(body)):
        value = _value(piece)
        if value is not None:
            return value
    return None


def _fenced(text: str) -> Iterator[str]:
    yield from reversed(re.findall(r"```[A-Za-z0-9_]*[ \t]*\n(.*?)```", text, re.DOTALL))


def _braced(text: str) -> Iterator[str]:
    first, last = text.find("{"), text.rfind("}")
    if 0 <= first < last:
        yield text[first : last + 1]


def _value(text: str) -> Any:
    try:
        value = json.loads(text, parse_constant=_no_number)
        json.dumps(value, ensure_ascii=False).encode()  # halves of letters are no text
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, (dict, list)) else None


def _no_number(word: str) -> Any:
    raise ValueError(word)


class Memory:
    """The rungs that worked, by endpoint and model, in a file of the user's cache. Never fails: it only saves questions."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path or cache_folder() / "rungs.json"

    def recall(self, base_url: str, model: str) -> Rung | None:
        """Return the rung that worked last, if this version of ours found it."""
        kept = read_object(self._path)
        rung = kept.get("rungs", {}).get(f"{base_url} {model}") if _is_ours(kept) else None
        return rung if rung in RUNGS else None

    def keep(self, base_url: str, model: str, rung: Rung) -> None:
        """Remember a rung."""
        kept = read_object(self._path)
        rungs = kept["rungs"] if _is_ours(kept) else {}
        with suppress(OSError):
            write_object(self._path, {"formiga": __version__, "rungs": {**rungs, f"{base_url} {model}": rung}})


def _is_ours(kept: Mapping[str, Any]) -> bool:
    return kept.get("formiga") == __version__ and isinstance(kept.get("rungs"), dict)
