"""The examples that a model is shown are right: they pass the schema, the checker, the dry run and the comparison."""

import json
from functools import cache

import jsonschema
import pytest

from formiga_bt.llm.envelope import read_answer, schema_of
from formiga_bt.llm.examples import Example, examples_of, most_similar
from formiga_bt.llm.judging.judge import judge
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.words.wording import read
from formiga_bt.llm.world import RequestWorld, world_of


@cache
def world() -> RequestWorld:
    return world_of()


def test_the_schema_of_answers_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema_of(world(), verbs_of(world())))


@pytest.mark.parametrize("example", examples_of(world_of()), ids=lambda e: e.id)
def test_an_example_is_right(example: Example) -> None:
    verbs = verbs_of(world())
    jsonschema.Draft202012Validator(schema_of(world(), verbs)).validate(json.loads(example.text))
    answer = read_answer(json.loads(example.text))
    if answer.tree is None:
        assert answer.question or answer.impossible
        return
    words = read(example.request, world().site, world().catalogue)
    judged = judge(answer, words, world(), verbs, "short", compared=words)

    assert judged.flight is not None
    assert (judged.shortfalls, judged.mends, judged.flight.status) == ((), (), "SUCCEEDED")


@pytest.mark.parametrize(
    ("request_", "best"),
    [
        ("a heavy drone goes round the camp twice, 5 m high", "ring"),
        ("explore the lake", "region"),
        ("both land, the watcher confirms, then one returns", "after"),
        ("fly zigzag", "zigzag"),
        ("follow picker_1 with the tracker", "follow"),
        ("Paint something", "no_verb"),
    ],
)
def test_the_most_similar_example_comes_last(request_: str, best: str) -> None:
    assert most_similar(request_, examples_of(world()), 3)[-1].id == best


def test_examples_can_be_held_back() -> None:
    assert "ring" not in [e.id for e in examples_of(world(), without=["ring"])]
