"""What no tree can do is told as impossible, with the reason, when every answer of a model runs against it."""

import pytest

from formiga_bt.llm.draft import draft
from formiga_bt.llm.world import world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree


def said(request: str, *answers: object) -> tuple[str, str]:
    made = draft(request, world_of(), Scripted(*answers))
    return made.kind, made.say


def test_a_place_that_every_answer_takes_for_one_of_the_site_is_named_with_those_there_are(wording: Wording) -> None:
    wrong = tree(fly_to("old_mill"), home())

    code, text = said("Fly over the old mill at 40 m and come home.", wrong, wrong, wrong, wrong)
    assert code == "impossible"
    wording(text)


def test_a_name_that_the_request_does_not_have_is_the_fault_of_the_model() -> None:
    wrong = tree(fly_to("old_mill"), home())

    assert said("Fly over the camp at 40 m and come home.", wrong, wrong, wrong, wrong)[0] == "failed"


@pytest.mark.parametrize("who", ["watcher", "watchers", "lwd_1"])
def test_people_and_machines_of_the_site_are_not_missing_where_a_model_took_them_for_places(who: str) -> None:
    wrong = tree(fly_to(who), home())
    kind, say = said(f"Fly over the camp at 40 m, wait for {who}, and come home.", wrong, wrong, wrong, wrong)

    assert kind == "failed"
    assert f'has no "{who}"' not in say


@pytest.mark.parametrize("far", ["40 km", "12 km"])
def test_a_way_longer_than_any_charge_is_impossible(far: str, wording: Wording) -> None:
    wrong = tree(fly_to(f"offset(base, north={far})"), home())
    kind, say = said(f"A light drone flies {far} north of the base at 40 m and comes home.", wrong, wrong, wrong, wrong)

    assert kind == "impossible"
    wording(say)


def test_a_height_that_the_request_says_and_nothing_may_fly_at_is_impossible(wording: Wording) -> None:
    wrong = tree(fly_to("camp", "300 m"), home())

    code, text = said("An LWD watches over the camp, 300 m, and returns.", wrong, wrong, wrong, wrong)
    assert code == "impossible"
    wording(text)
    assert said("An LWD watches over the camp and returns.", wrong, wrong, wrong, wrong)[0] == "failed"
