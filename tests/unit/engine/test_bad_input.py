"""What agents send that is wrong: each is told with what, where and how to mend it, once; the engine goes on with the others.

Files that are wrong have their messages in tests/lang_errors: a type without mobility (`catalogue_mobility`), stations that no
way leads to (`site_routes`, `site_routes_islands`), a rule that requests itself (`site_rules`). Files whose bytes have another
hash stand in tests/unit/services/test_attachments.py, all cards that contradict in test_announced.py.
"""

from typing import Any

import pytest

from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.model import Catalogue
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, effects, packaged_world, task_of
from formiga_bt.transport.messages import AgentCard, CardAction, CardField

SITE, _ = packaged_world()
OWN = """
types:
  probe: {mobility: none, shared: true, actions: [Look]}
actions:
  Look:
    result: {held: mass, state: {type: enum, values: [slack, tight]}, spots: {list: place}, many: int}
    repeatable: true
"""
LOOK = "agents: {one: {type: probe}}\nsteps: [{do: one.Look, save_as: seen}, {notify: '${seen.state}'}]"


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Catalogue:
    file = tmp_path_factory.mktemp("own") / "own.yaml"
    file.write_text(OWN)
    catalogue, problems, _ = load_catalogue([file])
    assert problems == []
    return catalogue


def looking(own: Catalogue) -> tuple[Bench, ScriptedAgent]:
    """Return an engine with one probe, and its task that looks with it begun."""
    made = Bench(SITE, own, [task_of(LOOK, SITE, own)])
    probe = made.agent("probe_1", "probe")
    made.run_for(1)
    made.submit("Try")
    made.run_for(1)
    return made, probe


@pytest.mark.parametrize(
    ("result", "says"),
    [
        ({"held": "much"}, "field 'held' is to be mass, this came: 'much' (Expected `float`, got `str`)"),
        ({"held": 1e300}, "field 'held' is to be mass, this came: 1e+300 (1e+300 is out of bounds)"),
        ({"state": "loose"}, "field 'state' is to be one of slack, tight, this came: 'loose' (it is none of them)"),
        ({"state": 3}, "field 'state' is to be one of slack, tight, this came: 3 (it is none of them)"),
        ({"spots": [{}]}, "field 'spots' is to be list of place, this came: [{}] (it lacks 'east_m')"),
        ({"spots": {}}, "field 'spots' is to be list of place, this came: {} (Expected `array`, got `object`)"),
        ({"many": 1.5}, "field 'many' is to be int, this came: 1.5 (Expected `int`, got `float`)"),
    ],
)  # fmt: skip
def test_a_result_of_the_wrong_type_says_which_field_and_what_came(
    own: Catalogue, result: dict[str, Any], says: str
) -> None:
    made, probe = looking(own)
    probe.succeed({"held": 1.0, "state": "tight", "spots": [], "many": 1, **result})
    made.run_for(1)
    (bad,) = made.engine.state.tasks.values()

    assert (bad.outcome.code, bad.outcome.reason) == ("failed:bad_result", says)

    again = made.submit("Try")
    made.run_for(1)
    probe.succeed({"held": 1.0, "state": "tight", "spots": [{"east_m": 1.0, "north_m": 2.0}], "many": 1})
    made.run_for(1)
    assert made.task(again).outcome.status == "SUCCEEDED"


def test_a_card_that_contradicts_is_told_with_both_types_and_how_it_is_mended(own: Catalogue) -> None:
    made = Bench(SITE, own, [task_of(LOOK, SITE, own)])
    bad, good = made.agent("probe_1", "probe"), made.agent("probe_2", "probe")
    said = {name: getattr(bad.side.card, name) for name in AgentCard.__struct_fields__}
    look = CardAction(name="Look", result={"held": CardField(type="text")})
    bad.link.publish_card(AgentCard(**{**said, "actions": (look,)}))
    made.run_for(1)
    (alarm,) = [one.text for one in effects(made, Alarm) if one.code == "action_refused"]
    task = made.submit("Try")
    made.run_for(1)
    good.succeed({"state": "tight"})
    made.run_for(1)

    assert alarm == (
        "probe_1: Look is refused: result held: the card says text, the catalogue says mass; "
        "result state: the card says has none, the catalogue says one of slack, tight; "
        "result spots: the card says has none, the catalogue says list of place; "
        "result many: the card says has none, the catalogue says int. Let both say the same"
    )
    assert bad.requests == []
    assert made.task(task).outcome.status == "SUCCEEDED"
