"""What a person reads before a draft is started: values in place of params, and what a program put right."""

from formiga_bt.lang.loader import load_task_text
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.summary import in_words
from formiga_bt.llm.world import world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, tree

PAIR = ({"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"})


def test_places_beside_others_are_read_with_their_values_and_what_was_put_right_is_told(wording: Wording) -> None:
    world = world_of()
    lands = [{"do": "FlyAndLand", "agent": "one", "at": "camp"}]
    lands += [{"do": "FlyAndLand", "agent": "other", "at": "offset(camp, east=6 m)"}]
    request = "Two light drones land at the camp, 6 m apart, and come home."
    made = draft(request, world, Scripted(tree({"parallel": lands}, agents=PAIR)), options=Options(rounds=0))
    task = load_task_text(made.yaml, "t.yaml", catalogue=world.catalogue, site=world.site, library=world.folders).task

    text = "\n".join(in_words(made, task)) + "\n"

    wording(text)
