"""The forms in which a model is held to a schema, and what is read out of its answers."""

import json
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.llm.ladder import (
    Memory,
    is_about_form,
    is_about_length,
    json_in,
    lower,
    plainly,
    response_format,
    said_in_prompt,
    strictly,
)

STEP = {"type": "object", "properties": {"do": {"const": "Go"}, "to": {"type": "string"}}, "required": ["do"]}
SCHEMA: dict[str, Any] = {
    "$defs": {"step": STEP},
    "type": "object",
    "properties": {"steps": {"type": "array", "items": {"$ref": "#/$defs/step"}}},
    "required": ["steps"],
    "additionalProperties": False,
}


def test_the_ladder_goes_down_and_ends() -> None:
    assert [lower("strict"), lower("schema"), lower("json"), lower("text")] == ["schema", "json", "text", None]


def test_a_strict_schema_requires_every_key_and_the_answer_loses_its_nulls() -> None:
    step = strictly(SCHEMA)["$defs"]["step"]
    assert step == {
        "type": "object",
        "properties": {
            "do": {"type": "string", "const": "Go"},
            "to": {"anyOf": [{"type": "string"}, {"type": "null"}]},
        },
        "required": ["do", "to"],
        "additionalProperties": False,
    }
    assert plainly({"steps": [{"do": "Go", "to": None}]}, SCHEMA) == {"steps": [{"do": "Go"}]}


def test_what_is_no_object_at_the_root_is_wrapped_for_strict_services() -> None:
    either = {"anyOf": [{"$ref": "#/$defs/step"}, {"type": "null"}], "$defs": {"step": STEP}}
    strict = strictly(either)
    assert strict["required"] == ["answer"]
    assert strict["properties"]["answer"] == {"anyOf": [{"$ref": "#/$defs/step"}, {"type": "null"}]}
    assert strict["$defs"]["step"]["required"] == ["do", "to"]
    assert plainly({"answer": {"do": "Go", "to": None}}, either) == {"do": "Go"}


def test_forms_of_the_rungs() -> None:
    strict, schema = response_format("strict", SCHEMA), response_format("schema", SCHEMA)
    assert strict is not None
    assert strict["json_schema"]["strict"] is True
    assert schema == {"type": "json_schema", "json_schema": {"name": "answer", "strict": False, "schema": SCHEMA}}
    assert response_format("json", SCHEMA) == {"type": "json_object"}
    assert response_format("text", SCHEMA) is None
    assert said_in_prompt("schema", SCHEMA) == ""
    assert json.dumps(SCHEMA, separators=(",", ":")) in said_in_prompt("json", SCHEMA)
    assert said_in_prompt("text", SCHEMA).endswith("```.\n")


@pytest.mark.parametrize(
    ("status", "text", "is_form"),
    [
        (400, "This model does not support response format `json_schema`", True),
        (422, "response_format: extra fields not permitted", True),
        (500, "Input should be 'text' or 'json_object'", True),
        (400, "Invalid schema for response_format 'answer': In context=(), 'allOf' is not permitted", True),
        (400, "Failed to generate JSON. Please adjust your prompt. json_validate_failed", True),
        (400, "maximum context length is 8192 tokens, your schema has 9000", False),
        (400, "temperature is not supported", False),
        (401, "response_format", False),
        (500, "internal error", False),
    ],
)
def test_which_refusals_speak_of_the_form(status: int, text: str, is_form: bool) -> None:
    assert is_about_form(status, text) is is_form


def test_which_refusals_speak_of_the_length() -> None:
    assert is_about_length("request (9031 tokens) exceeds the available context size (8192 tokens)")
    assert is_about_length("This model's maximum context length is 8192 tokens")
    assert not is_about_length("rate limit: 8192 tokens a minute")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ('{"a": 1}', {"a": 1}),
        ('Here it is:\n```json\n{"a": 1}\n```\nGood luck', {"a": 1}),
        ('```\n{"a": 0}\n```\nNo, better:\n```json\n{"a": 1}\n```', {"a": 1}),
        ('<think>maybe {"a": 0}</think>{"a": 1}', {"a": 1}),
        ('I say {"a": 1} to that', {"a": 1}),
        ("[1]", [1]),
        ("7", None),
        ('"words"', None),
        ("no", None),
        ("", None),
        ('{"a": ', None),
        ('{"a": NaN}', None),
        ('{"a": "\\ud800"}', None),
        ("[" * 100_000, None),
        ('{"a": ' + "9" * 10_000 + "}", None),
    ],
    ids=range(15),
)
def test_json_is_found_in_an_answer(text: str, value: Any) -> None:
    assert json_in(text) == value


def test_a_rung_is_remembered_for_an_endpoint_and_a_model(tmp_path: Path) -> None:
    memory = Memory(tmp_path / "deep" / "rungs.json")
    assert memory.recall("https://a/v1", "m") is None
    memory.keep("https://a/v1", "m", "json")
    memory.keep("https://b/v1", "m", "text")
    assert [memory.recall("https://a/v1", "m"), memory.recall("https://b/v1", "m")] == ["json", "text"]
    assert memory.recall("https://a/v1", "n") is None


@pytest.mark.parametrize("text", ["", "[]", '{"formiga": "0.0.0", "rungs": {"u m": "json"}}', '{"rungs": 1}', "\xff"])
def test_an_unusable_memory_is_none(text: str, tmp_path: Path) -> None:
    file = tmp_path / "rungs.json"
    file.write_text(text, encoding="latin-1")
    memory = Memory(file)
    assert memory.recall("u", "m") is None
    memory.keep("u", "m", "schema")
    assert memory.recall("u", "m") == "schema"


def test_a_memory_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    memory = Memory(tmp_path / "file" / "rungs.json")
    memory.keep("u", "m", "json")
    assert Memory(tmp_path / "file" / "rungs.json").recall("u", "m") is None
    assert (tmp_path / "file").read_text() == ""
