"""The drafting loop as an author of the experiment, over a model that always says the same."""

import json
from typing import Any

from experiments.e2_llm.authors import DraftAuthor
from experiments.e2_llm.columns import hidden_in
from experiments.e2_llm.fly import world_of
from experiments.e2_llm.records import Whose
from experiments.e2_llm.requests import requests
from experiments.e2_llm.run import run_of
from formiga_bt.llm.records import Message, ModelReply, Usage

WORLD = world_of()


class Says:
    name, model = "scripted", "says"

    def __init__(self, answer: Any) -> None:
        self.answer = answer
        self.messages: list[list[Message]] = []

    def complete(self, messages: list[Message], schema: Any, **_options: Any) -> ModelReply:
        self.messages.append(list(messages))
        return ModelReply(
            text=json.dumps(self.answer), data=self.answer, usage=Usage(prompt=9, completion=7), seconds=0.5
        )

    def close(self) -> None:
        pass


def ring(radius: str) -> dict[str, Any]:
    go = {"do": "GoTo", "agent": "drone"}
    steps = [
        {"do": "FlyTo", "agent": "drone", "to": "base", "height": "20 m"},
        {"for": "spot", "in": f"polygon(base, {radius}, 24)", "steps": [{**go, "to": "above(spot, 20 m)"}]},
        {**go, "to": f"above(polygon(base, {radius}, 24)[0], 20 m)"},
        {**go, "to": "above(base, 20 m)"},
        {"do": "ReturnHome", "agent": "drone"},
    ]
    tree = {"task": "Ring", "agents": [{"name": "drone", "type": "lwd"}], "steps": steps}
    return {"plan": "Once round the base.", "answer": {"tree": tree}}


def test_a_right_answer_in_the_column_of_the_paper_is_a_success() -> None:
    request = next(one for one in requests("T6", WORLD) if one.goal["center"] == (0.0, 0.0))
    chat = Says(ring(f"{request.goal['radius_m']:g} m"))

    written = DraftAuthor(chat, "paper").write("T6", request.words)
    run = run_of(request, written, WORLD, "paper", Whose(provider="scripted", model="says"))

    assert run.first is not None
    assert (run.first.valid, run.first.success) == (True, True), run.first
    assert run.last is not None
    assert run.last.success
    assert run.ngram_tree is not None
    assert hidden_in(chat.messages[0][0].text) == ()
    assert [one.role for one in chat.messages[0]] == ["system", *["user", "assistant"] * 5, "user"]


def test_a_question_is_kept_as_what_was_said() -> None:
    said = {"plan": "", "answer": {"question": "For how long?"}}
    written = DraftAuthor(Says(said), "helpers").write("", "A drone guards the camp for some time.")

    assert (written.kind, written.say, len(written.attempts)) == ("question", "For how long?", 1)


def test_the_examples_that_are_held_back_are_there() -> None:
    from experiments.e2_llm.columns import NEAR_EXAMPLES
    from formiga_bt.llm.examples import examples_of
    from formiga_bt.llm.world import world_of

    assert set(NEAR_EXAMPLES) <= {one.id for one in examples_of(world_of())}
