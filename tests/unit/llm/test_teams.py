"""Teams, lists of places and machines that keep apart, in the short form; coordinates by names; what is read of a request."""

import json
import re
from functools import cache
from typing import Any

import pytest

from formiga_bt.llm import prompt
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.envelope import ModelAnswer, schema_of, shapes
from formiga_bt.llm.examples import examples_of
from formiga_bt.llm.judging.judge import Judged, judge
from formiga_bt.llm.records import Draft
from formiga_bt.llm.shaping.teams import from_to, gap_of, in_compass
from formiga_bt.llm.vocabulary import offered, verbs_of
from formiga_bt.llm.words.points import named
from formiga_bt.llm.words.wording import Words, read, roles_of
from formiga_bt.llm.world import RequestWorld, world_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree


@cache
def world() -> RequestWorld:
    return world_of()


def words(request: str) -> Words:
    return read(request, world().site, world().catalogue)


def judged(request: str, *steps: Any, agents: list[dict[str, Any]]) -> Judged:
    answer = ModelAnswer("", tree={"task": "Mission", "agents": agents, "steps": list(steps)})
    return judge(answer, words(request), world(), verbs_of(world()), "short", compared=words(request))


def land(agent: str, at: str) -> dict[str, Any]:
    return {"do": "FlyAndLand", "agent": agent, "at": at}


TWO = [{"name": "one", "type": "lwd"}, {"name": "other", "type": "lwd"}]
TEAM = [{"name": "drones", "type": "lwd", "count": 3}]


def errors(found: Judged) -> list[str]:
    return [one.text for one in found.shortfalls if one.severity == "error"]


def test_a_team_does_at_one_time_what_it_is_told_each_at_its_own_place() -> None:
    found = judged(
        "Three light drones hover over the camp as a triangle of 20 m and land below.",
        {"do": "FlyTo", "agent": "drones", "to": "triangle(camp, 20 m)", "height": "20 m"},
        land("drones", "triangle(camp, 20 m)"),
        agents=TEAM,
    )

    assert errors(found) == []
    assert found.flight is not None
    assert sorted(found.flight.stands.values()) == ["camp", "camp", "camp"] or len(found.flight.stands) == 3
    assert found.yaml.count("mode: parallel") == 2
    assert "drone: ${drones}" in found.yaml


def test_a_team_that_is_sent_to_one_place_stands_in_a_row(wording: Wording) -> None:
    found = judged(
        "Three light drones land at the camp, 8 m apart, and come home.",
        land("drones", "camp"),
        {"do": "ReturnHome", "agent": "drones"},
        agents=TEAM,
    )

    assert errors(found) == []
    assert "spot: ${[camp, offset(camp, east=east), offset(camp, east=2 * east)]}" in found.yaml
    wording(found.mends[0])


def test_two_machines_never_land_on_one_spot(wording: Wording) -> None:
    found = judged(
        "Two light drones land at the camp, 5 m apart.",
        {"parallel": [land("one", "camp"), land("other", "camp")]},
        agents=TWO,
    )

    assert errors(found) == []
    wording(found.mends)


def test_one_machine_flies_a_list_and_a_place_is_no_list() -> None:
    found = judged(
        "A light drone flies once round the camp at 20 m and comes home.",
        {"do": "FlyTo", "agent": "drone", "to": "circle(camp, 20 m)", "height": "30 m"},
        {"do": "FlyAlong", "agent": "drone", "way": "camp", "height": "30 m"},
        home(),
        agents=[{"name": "drone", "type": "lwd"}],
    )

    assert errors(found) == []
    assert (found.yaml.count("call: FlyAlong"), found.yaml.count("call: FlyTo")) == (1, 1)


def test_a_way_begins_where_the_request_says() -> None:
    along = {"do": "FlyAlong", "agent": "drone", "way": "zigzag(camp, lake_shore, 5 m, 6)", "height": "30 m"}
    agents = [{"name": "drone", "type": "lwd"}]
    found = judged(
        "A light drone zigzags from the lake shore to the camp, 5 m.", along, land("drone", "camp"), agents=agents
    )

    assert errors(found) == []
    assert "zigzag(lake_shore, camp, amplitude, 6)" in found.yaml


@pytest.mark.parametrize(
    "request_",
    [
        "A light drone flies straight from the camp to the north field at 30 m, zigzags back with 4 legs of 10 m to each side, "
        "and comes home.",
        "A light drone flies from the camp to the north field at 30 m; 4 legs and 10 m to each side bring it to the camp in a "
        "zigzag, and it comes home.",
    ],
)
def test_a_way_back_is_not_turned_round(request_: str) -> None:
    back = {"do": "FlyAlong", "agent": "drone", "way": "zigzag(north_field, camp, 10 m, 4)", "height": "30 m"}
    steps = (fly_to("camp", "30 m"), fly_to("north_field", "30 m"), back, home())
    found = judged(request_, *steps, agents=[{"name": "drone", "type": "lwd"}])

    assert (errors(found), found.mends) == ([], ())
    assert "zigzag(north_field, camp, amplitude, 4)" in found.yaml


def test_longer_names_are_other_places(wording: Wording) -> None:
    found = words("It looks at the lake shore, then at the lake.")

    assert (found.spans("lake"), found.spans("lake_shore")) == ([(40, 44)], [(16, 26)])
    wording(found.alone("lake"))


def test_a_way_flown_back_to_front_is_told(wording: Wording) -> None:
    found = judged(
        "A light drone goes from the camp to the lake shore and comes home.",
        fly_to("lake_shore"),
        fly_to("camp"),
        home(),
        agents=[{"name": "drone", "type": "lwd"}],
    )

    wording(errors(found))


@pytest.mark.parametrize(
    ("request_", "steps", "told"),
    [
        ("A light drone looks at the camp, then at the lake shore, and returns.", ("lake_shore", "camp"), True),
        ("A light drone looks at the camp, then at the lake shore, and returns.", ("camp", "lake_shore"), False),
        ("A light drone looks at the camp after the lake shore, then returns.", ("lake_shore", "camp"), False),
    ],
)
def test_the_order_of_places_is_compared(request_: str, steps: tuple[str, str], told: bool) -> None:
    found = judged(request_, *map(fly_to, steps), home(), agents=[{"name": "drone", "type": "lwd"}])

    assert any("before" in one for one in errors(found)) is told


@pytest.mark.parametrize(
    ("request_", "counts", "more"),
    [
        ("one light drone lands at the camp while another one circles it", {}, True),
        ("An LWD lands there. At the same time a second LWD goes round it", {}, True),
        ("One light drone looks at the camp", {"lwd": 1}, False),
        ("a pair of light drones looks at the camp", {"lwd": 2}, False),
        ("Two small drones at once", {"lwd": 2}, False),
        ("One light drone looks at the camp for a second and at the other field", {"lwd": 1}, False),
        ("Both heavy drones land at the camp", {"hwd": 2}, False),
        ("Both light drones and heavy drones land", {}, False),
        ("All light drones fly to the camp and come home", {"lwd": 3}, False),
        ("Every light drone lands at the camp", {"lwd": 3}, False),
        ("All light drones stay at home", {}, False),
        ("When all light drones are down, a heavy drone starts", {}, False),
        ("lwd_1 circles; all light drones then come home", {}, False),
        ("The whole fleet flies to the camp", {"*": 5}, False),
        ("Each of the three light drones hovers over the camp", {"lwd": 3}, False),
        ("A light drone lands at the camp, and another at the east field", {}, True),
        ("A light drone makes a circle at the camp, and another at the east field", {}, False),
    ],
)
def test_how_many_machines_are_spoken_of(request_: str, counts: dict[str, int], more: bool) -> None:
    found = words(request_)

    assert (dict(found.counts), found.speaks_of_more()) == (counts, more)


ONE, OTHER = [fly_to("camp", agent="one"), home("one")], [fly_to("lake_shore", agent="other"), home("other")]
LATER = [*ONE, {"wait": "10 s"}, *OTHER]


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        ("Two light drones look at the camp and the lake shore, at the same moment", True),
        ("A light drone looks at the camp; while that goes on, one more light drone looks at the lake shore", True),
        ("A light drone looks at the camp. During that, another one looks at the lake shore", True),
        ("Both light drones fly at once, one to the camp, a second one to the lake shore", True),
        ("Un par de drones ligeros mira el campamento y la orilla del lago a la vez", True),
        ("Two light drones look at the camp and the lake shore, never both at the same time", False),
        ("Two light drones look at the camp and the lake shore, one at a time", False),
        ("Dos drones ligeros miran el campamento y la orilla del lago, uno a la vez", False),
        ("Two light drones go at once and look at the camp and the lake shore", False),
        ("Two light drones look at the camp and the lake shore, at the same time every day", False),
        ("Two light drones look at the camp and the lake shore in parallel rows", False),
        ("Two light drones at the same time, if the wind allows it: camp, lake shore", False),
        ("A light drone looks at the camp, then another one at the lake shore; same time at both", False),
        ("A light drone looks at the camp while the other waits, and it looks at the lake shore", False),
    ],
)
def test_machines_that_are_wanted_at_one_time_do_not_fly_one_after_the_other(request_: str, told: bool) -> None:
    found = judged(request_, *LATER, agents=TWO)

    assert found.flight is not None
    assert found.flight.status == "SUCCEEDED"
    assert [one.help for one in found.shortfalls if one.code == "not_at_once"] == ['{"parallel": [...]}'] * told


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        ("A light drone looks at the camp, another one at the lake shore. Never both in the air.", True),
        ("Two light drones look at the camp and the lake shore, but no two of them may be airborne at once.", True),
        ("Two light drones look at the camp and the lake shore; only one of them is in the air at a time", True),
        ("Un dron ligero mira el campamento y otro la orilla del lago. Nunca los dos en el aire.", True),
        (
            "Dos drones ligeros miran el campamento y la orilla del lago, sin que estén los dos a la vez en el aire",
            True,
        ),
        ("Two light drones look at the camp and the lake shore, never both in the air over the camp", False),
        ("Two light drones look at the camp and the lake shore and are both in the air", False),
        ("Two light drones look at the camp and the lake shore, not far from one another", False),
        ("Two light drones look at the camp and the lake shore and tell the picker: never both in the air? no!", True),
        ('Two light drones look at the camp and the lake shore and send "never both in the air"', False),
    ],
)
def test_machines_of_which_one_may_be_in_the_air_fly_one_after_the_other(request_: str, told: bool) -> None:
    apart = {"parallel": [{"sequence": ONE}, {"sequence": OTHER}]}
    both = judged(request_, apart, agents=TWO)
    later = judged(request_, *LATER, agents=TWO)

    assert [one.code for one in both.shortfalls if one.code == "air_shared"] == ["air_shared"] * told
    assert "air_shared" not in {one.code for one in later.shortfalls}


def test_machines_that_are_in_the_air_at_one_time_are_at_once(wording: Wording) -> None:
    request = "Un par de drones ligeros mira el campamento y la orilla del lago a la vez"
    apart = {"parallel": [{"sequence": ONE}, {"sequence": OTHER}]}

    assert errors(judged(request, apart, agents=TWO)) == []
    found = judged(request, *ONE, *OTHER, agents=TWO)
    assert errors(found) == []
    wording(found.mends)


@pytest.mark.parametrize(
    ("request_", "gap"),
    [
        ("they land 5 meters apart", "5 m"),
        ("landing 8 m from each other", "8 m"),
        ("(10 m between them) and wait", "10 m"),
        ("fly at 40 m and land", ""),
    ],
)
def test_how_far_apart_they_are_to_be(request_: str, gap: str) -> None:
    assert gap_of(words(request_)) == gap


@pytest.mark.parametrize(
    ("request_", "ways"),
    [
        ("from the camp to the lake shore, go to the north field", {("camp", "lake_shore")}),
        ("from the camp to the lake shore, then on to the north field",
         {("camp", "lake_shore"), ("lake_shore", "north_field")}),
        ("from the camp to the lake shore to the north field", {("camp", "lake_shore"), ("lake_shore", "north_field")}),
        ("from the camp to the lake shore and back to the camp", {("camp", "lake_shore")}),
        ("from the camp to the lake shore and to the camp", {("camp", "lake_shore")}),
        ("from the camp over the north field to the lake shore", {("camp", "lake_shore")}),
        ("from camp to lake shore, look at the lake", {("camp", "lake_shore")}),
        ("5 m from the camp, one goes to the lake shore", set()),
        ("away from the camp, to the lake shore", set()),
        ("a view from the camp, and from the lake shore to the base", {("lake_shore", "base")}),
    ],
)  # fmt: skip
def test_a_way_ends_at_the_first_place_that_it_goes_to(request_: str, ways: set[tuple[str, str]]) -> None:
    assert from_to(words(request_)) == ways


def test_from_one_place_to_another(wording: Wording) -> None:
    assert from_to(words("zigzag from the camp towards the lake shore")) == {("camp", "lake_shore")}
    assert from_to(words("from the camp to the lake shore and from the lake shore to the camp")) == set()
    wording(in_compass("offset(camp, south=5 m, west=3 m)"))


def test_coordinates_get_a_name_and_come_back_in_the_file() -> None:
    request = "A light drone looks at 66.501000 N 25.703000 E from 40 m and comes home."
    chat = Scripted(tree(fly_to("point_1", "40 m"), home()))
    found: Draft = draft(request, world(), chat, options=Options(rounds=0))

    assert found.kind == "task", found.say
    assert "<request>A light drone looks at point_1 from 40 m and comes home.</request>" in chat.asked[0][-1].text
    assert "lat: 66.501" in found.yaml
    assert ("point_1", "66.501,25.703", "66.501000 N 25.703000 E") in [(v.name, v.text, v.words) for v in found.values]
    assert "66.501000 N 25.703000 E" in found.yaml.splitlines()[1]


def test_a_follow_up_has_the_points_of_the_request_before(wording: Wording) -> None:
    first = draft(
        "A light drone looks at 66.501000 N 25.703000 E from 40 m and comes home.",
        world(),
        Scripted(tree(fly_to("point_1", "40 m"), home())),
        options=Options(rounds=0),
    )
    chat = Scripted(tree(fly_to("point_1", "40 m"), fly_to("point_2", "40 m"), home()))
    found = draft("then also at 66.502000 N 25.704000 E", world(), chat, options=Options(rounds=0), previous=first)

    assert found.kind == "task", found.say
    shown = [one.text for one in chat.asked[0] if one.role == "user"]
    wording(shown[0], shown[-1])
    assert [v.text for v in found.values if v.name.startswith("point")] == ["66.501,25.703", "66.502,25.704"]
    assert "66.501000 N" in found.request


def test_coordinates_of_a_place_are_that_place(wording: Wording) -> None:
    from formiga_bt.base.geo import Frame

    site = world().site
    lat, lng = Frame(site.lat, site.lng, site.ground_msl_m).lat_lng(site.places["camp"])
    found = named(f"fly to {lat:.6f} N {lng:.6f} E, then to {lat + 0.001:.6f}, {lng:.6f}", site)

    assert list(found.points) == ["point_1"]
    wording(found.text, named("at 10.30, 40.5 m high", site).text)


def test_a_model_is_told_what_was_read(wording: Wording) -> None:
    request = "Two light drones land at the lake shore, 5 m apart; a watcher is asked; then one goes to the camp."

    wording(prompt.reading(words(request), world()))
    assert prompt.reading(words("hello"), world()) == ""


def test_all_examples_fit_the_shapes_that_small_models_are_held_to() -> None:
    verbs = offered(verbs_of(world()))
    kinds = shapes(world())
    assert set(verbs) == {"FlyTo", "FlyAlong", "FlyAndLand", "ReturnHome", "Explore", "MiniFinder"}
    checked = 0
    for example in examples_of(world()):
        for step in re.findall(r'\{"do": [^{}]*\}', example.text):
            values = json.loads(step)
            for key, type_ in verbs[values["do"]].fields.items():
                if type_ in kinds and key in values:
                    assert re.fullmatch(kinds[type_]["pattern"], values[key]), (example.id, key, values[key])
                    checked += 1
    assert checked > 40
    place = kinds["place"]["pattern"]
    said = {
        "camp": True,
        "fix.go_to": True,
        "one.position": True,
        "one.home": True,
        "one.hold": False,
        "one.battery": False,
    }
    assert {one: re.fullmatch(place, one) is not None for one in said} == said
    typed = json.dumps(schema_of(world(), verbs, typed=True))
    assert ("pattern" in typed, "pattern" in json.dumps(schema_of(world(), verbs))) == (True, False)


def test_the_sites_own_tasks_are_examples(wording: Wording) -> None:
    chat = Scripted(tree(fly_to("camp"), home()))
    made = draft("A light drone looks at the camp and comes home.", world(), chat, options=Options(rounds=0))
    own = RequestWorld(world().catalogue, world().site, (), {"look.yaml": made.yaml, "broken.yaml": "task: ["})

    found = [one for one in examples_of(own) if one.id.startswith("own:")]
    assert [one.id for one in found] == ["own:look.yaml"]
    wording([one.request for one in found])
    assert found[0].answer["tree"]["steps"][0]["to"] == "camp"


def test_a_distance_hides_no_helper() -> None:
    found = judged(
        "A light drone flies 8 m from the base towards the camp, and comes home.",
        fly_to("toward(base, camp, 8 m)"),
        home(),
        agents=[{"name": "drone", "type": "lwd"}],
    )

    assert errors(found) == []
    assert "gap: {type: distance, default: 8 m}" in found.yaml


def test_who_shall_land_does_not_fly_home(wording: Wording) -> None:
    hover = {"do": "FlyTo", "agent": "drones", "to": "[camp, offset(camp, east=10 m)]", "height": "20 m"}
    back = {"do": "ReturnHome", "agent": "drones"}
    agents = [{"name": "drones", "type": "lwd", "count": 2}]
    found = judged("Two light drones hover 10 m apart over the camp and land together.", hover, back, agents=agents)
    home_ = judged("Two light drones hover 10 m apart over the camp and land at home.", hover, back, agents=agents)

    assert errors(found) == errors(home_) == []
    wording(found.mends)
    assert ("ReturnHome" in found.yaml, "ReturnHome" in home_.yaml) == (False, True)


def test_a_figure_that_is_named_is_flown(wording: Wording) -> None:
    found = judged(
        "A light drone flies a circle of 20 m round the camp and comes home.",
        {"do": "FlyAlong", "agent": "drone", "way": "line(camp, offset(camp, east=20 m), 4)", "height": "30 m"},
        home(),
        agents=[{"name": "drone", "type": "lwd"}],
    )

    wording(errors(found))


def test_a_landing_after_a_flight_is_compared(wording: Wording) -> None:
    request = "Two light drones fly to the camp and land 5 m apart; then both return home."
    found = judged(
        request,
        {"parallel": [fly_to("camp", agent="one"), fly_to("lake_shore", agent="other")]},
        {"parallel": [home("one"), home("other")]},
        agents=TWO,
    )

    wording([(one.text, one.help) for one in found.shortfalls if one.severity == "error"])


def test_a_centre_that_is_to_be_gone_back_to_is(wording: Wording) -> None:
    ring = {"do": "FlyAlong", "agent": "drone", "way": "circle(camp, 20 m)", "height": "30 m"}
    request = "A light drone flies a circle of 20 m about the camp, goes back to the centre, and comes home."
    agents = [{"name": "drone", "type": "lwd"}]

    again = {**ring, "way": "circle(camp, 20 m, 40)"}
    wording(errors(judged(request, ring, again, home(), agents=agents)))
    assert errors(judged(request, ring, fly_to("camp"), home(), agents=agents)) == []
    assert errors(judged("A light drone circles the camp, 20 m from the centre.", ring, home(), agents=agents)) == []


def test_a_machine_where_a_place_is_due_means_where_it_is(wording: Wording) -> None:
    around = {"do": "FlyAlong", "agent": "other", "way": "circle(one, 20 m)", "height": "30 m"}
    request = "One light drone lands at the camp. Meanwhile another one circles it at 20 m and lands, too."
    found = judged(request, land("one", "camp"), {"sequence": [around, land("other", "camp")]}, agents=TWO)

    assert errors(found) == []
    assert "circle(camp, radius)" in found.yaml
    wording(found.mends)


def test_a_role_that_is_called_as_an_agent_is_that_agent() -> None:
    found = judged(
        "A heavy drone lands at the camp, asks picker_1, and comes home.",
        land("drone", "camp"),
        {"ask": "All clear?", "of": ["picker_1"]},
        home(),
        agents=[{"name": "drone", "type": "hwd"}, {"name": "picker_1", "type": "picker", "id": "picker_1"}],
    )

    assert errors(found) == []
    assert found.flight is not None
    assert found.flight.asked == ("picker_1",)


def test_an_answer_that_is_looked_at_is_kept(wording: Wording) -> None:
    choice = {"if": "reply.answer == 'yes'", "then": [fly_to("camp")], "else": [fly_to("lake_shore")]}
    found = judged(
        "A watcher decides whether a light drone looks at the camp or at the lake shore; it comes home.",
        {"ask": "The camp?", "of": ["watcher"]},
        choice,
        home(),
        agents=[{"name": "drone", "type": "lwd"}, {"name": "watcher", "type": "watcher"}],
    )

    assert errors(found) == []
    wording(found.mends)
    assert "save_as: reply" in found.yaml
    assert "expect" not in found.yaml


def test_a_team_in_branches_goes_to_as_many_places() -> None:
    found = judged(
        "Two light drones look at the camp and the lake shore at the same time, then return.",
        {"parallel": [fly_to("camp", agent="drones"), fly_to("lake_shore", agent="drones")]},
        home("drones"),
        agents=[{"name": "drones", "type": "lwd", "count": 2}],
    )

    assert errors(found) == []
    assert "spot: ${[camp, lake_shore]}" in found.yaml


def test_a_gap_is_no_height(wording: Wording) -> None:
    hover = {"parallel": [fly_to("camp", "8 m", agent="one"), fly_to("lake_shore", "8 m", agent="other")]}
    found = judged("Two light drones hover 8 m apart.", hover, agents=TWO)

    wording(found.mends[0])


@pytest.mark.parametrize(
    ("request_", "roles"),
    [
        ("Two light drones land; a watcher confirms", (("lwd", 2), ("watcher", 1))),
        ("Three LWDs and one heavy drone hover", (("hwd", 1), ("lwd", 3))),
        ("A light drone looks at the camp", ()),
        ("lwd_1 and two light drones hover", ()),
        ("A light drone hovers over the camp, and two more 12 m to its sides", (("lwd", 3),)),
        ("Take a drone and two others, all of them heavy drones: they hover", (("hwd", 3),)),
        ("Un dron ligero va a camp y dos más a la orilla del lago", (("lwd", 3),)),
        ("A heavy drone hovers, and two more light drones circle", ()),
        ("Three drones hover; the heavy drone circles", ()),
        ("Three drones hover, all light drones go home", ()),
        ("Two light drones look for the picker", ()),
    ],
)
def test_the_roles_that_are_certain_are_in_the_schema(request_: str, roles: tuple[tuple[str, int], ...]) -> None:
    assert roles_of(words(request_), world().catalogue) == roles


def test_a_schema_holds_a_model_to_the_roles() -> None:
    import jsonschema

    schema = schema_of(world(), offered(verbs_of(world())), typed=True, roles=(("lwd", 2), ("watcher", 1)))
    watcher = {"name": "w", "type": "watcher"}
    fits = []
    for agents in ([*TWO, watcher], [{**TEAM[0], "count": 2}, watcher], TWO, [TWO[0], watcher], [*TEAM, watcher]):
        fits.append(jsonschema.Draft202012Validator(schema).is_valid(tree(home(), agents=agents)))

    assert fits == [True, True, False, False, False]


def test_who_is_asked_by_another_name_keeps_the_roles_open() -> None:
    words = read(
        "Dos drones ligeros van a camp. Cuando el capataz confirme, vuelven a casa.", world().site, world().catalogue
    )

    assert words.counts["lwd"] == 2
    assert roles_of(words, world().catalogue) == ()


def test_a_right_angle_is_no_number_and_legs_are_no_height(wording: Wording) -> None:
    request = "Three light drones, triangle, corner of 90 degrees at the west field, legs 15 m. Land together."
    assert [one.words for one in words(request).amounts] == ["15 m"]
    between = "Three LWDs: one over the west field, two 15 m from it, with ninety degrees between them."
    assert [one.words for one in words(between).amounts] == ["15 m"]
    assert [one.words for one in words("A light drone turns by 90 degrees over the camp.").amounts] == ["90 degrees"]

    def stand(spots: str, height: str) -> Judged:
        up = {"do": "FlyTo", "agent": "drones", "to": spots, "height": height}
        return judged(request, up, land("drones", spots), agents=TEAM)

    assert errors(stand("triangle(west_field, 15 m)", "40 m")) == []
    wrong = stand("line(west_field, offset(west_field, east=20 m), 3)", "15 m")
    wording(errors(wrong))
