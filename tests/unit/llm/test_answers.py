"""What hangs on an answer: a task that flies the same after a yes and after a no does not do what was asked for."""

from typing import Any

import pytest

from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged

AGENTS = [{"name": "drone", "type": "lwd"}, {"name": "watcher", "type": "watcher"}]
ASK = {"ask": "May it fly?", "of": ["watcher"], "save_as": "reply"}
THERE = [fly_to("camp"), home()]
IF_YES = (
    "Ask a watcher whether a light drone may fly to the camp; if yes it looks at it from 40 m and comes home, "
    "if no nothing flies."
)
SPANISH = "Pregunta a un vigilante; si dice que sí, un dron ligero mira el campamento desde 40 m y vuelve."
WHATEVER = "A light drone asks a watcher, looks at the camp from 40 m and comes home, whatever he says."
IGNORED = "the request lets something hang on an answer, and the machines do the same after a yes and after a no"


def case(then: list[Any], other: list[Any] | None = None) -> dict[str, Any]:
    return {"if": "reply.answer == 'yes'", "then": then, **({"else": other} if other is not None else {})}


@pytest.mark.parametrize(
    ("request_", "steps", "told"),
    [
        (IF_YES, [ASK, case(THERE, THERE)], True),
        (IF_YES, [ASK, case([{"wait": "1 s"}]), *THERE], True),
        (IF_YES, [ASK, case(THERE)], False),
        (IF_YES, [{"ask": "May it fly?", "of": ["watcher"]}, *THERE], False),
        (SPANISH, [ASK, case(THERE, THERE)], True),
        (WHATEVER, [ASK, *THERE], False),
        (IF_YES, [ASK, case([{"notify": "yes"}], [{"notify": "no"}]), *THERE], False),
    ],
)  # fmt: skip
def test_what_hangs_on_an_answer_is_another_flight_after_a_no(request_: str, steps: list[Any], told: bool) -> None:
    assert (IGNORED in errors(judged(request_, *steps, agents=AGENTS))) is told


@pytest.mark.parametrize(
    ("places", "told"),
    [(("camp", "lake_shore"), True), (("camp", "lake_shore", "camp", "lake_shore"), False)],
)
def test_a_round_leads_to_the_same_places_again(places: tuple[str, ...], told: bool) -> None:
    request = "2 rounds from the camp to the lake shore with a light drone, 40 m high. Home afterwards."
    found = judged(request, *map(fly_to, places), home(), agents=AGENTS[:1])

    assert any("does nothing 2 times" in one for one in errors(found)) is told
