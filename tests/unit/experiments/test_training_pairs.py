"""The training pairs: always the same, right as the product judges them, under any names, without the evaluation in them."""

import json
import random
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from experiments.e2_llm.fly import world_of
from experiments.e2_llm.fresh import FRESH
from experiments.e2_llm.requests import WORDS
from experiments.e2_llm.second_set import second_set
from experiments.e2_llm.train import make
from experiments.e2_llm.train.kinds import deciding, refusals, relays, rounds, settling
from experiments.e2_llm.train.kinds.clauses import Draw
from experiments.e2_llm.train.kinds.missions import Mission
from experiments.e2_llm.train.kinds.refusing import IMPOSSIBLE, UNCLEAR
from experiments.e2_llm.train.kinds.refusing_dangers import DANGEROUS
from experiments.e2_llm.train.leaks import OF_PAPER, Guard, grams, leaked
from experiments.e2_llm.train.pairs import KINDS, Made, Maker, renamed_problem, told_in_spanish, with_points_of
from experiments.e2_llm.train.phrases import Both
from experiments.e2_llm.train.phrases.cases import CASES
from experiments.e2_llm.train.phrases.parts import CLAUSES, SINGLE, TWO
from experiments.e2_llm.train.phrases.plain import FORMATION, FORMATION_THEN, PARTING, PLAIN
from experiments.e2_llm.train.phrases.turns import PARKED, RELAY, ROUNDS
from experiments.e2_llm.train.phrases.ways import EITHER, ENDINGS, NOTHING, ONLY_IF
from experiments.e2_llm.train.phrases.wide.cases import MORE_CASES
from experiments.e2_llm.train.phrases.wide.deciding import MORE_EITHER, MORE_NOTHING, MORE_ONLY_IF
from experiments.e2_llm.train.phrases.wide.ends import MORE_ENDINGS, MORE_PLAIN
from experiments.e2_llm.train.phrases.wide.formations import MORE_FORMATION, MORE_FORMATION_THEN
from experiments.e2_llm.train.phrases.wide.parting import MORE_PARTING
from experiments.e2_llm.train.phrases.wide.relays import MORE_CASES as MORE_MEETING
from experiments.e2_llm.train.phrases.wide.relays import MORE_RELAY
from experiments.e2_llm.train.phrases.wide.talk import MORE_SINGLE, PURPOSES, RADIO
from experiments.e2_llm.train.phrases.wide.teams import MORE_TWO
from experiments.e2_llm.train.phrases.wide.turns import MORE_PARKED, MORE_ROUNDS
from experiments.e2_llm.train.phrases.wide.ways import MORE_CLAUSES
from experiments.e2_llm.train.renaming import verbs_renamed
from experiments.e2_llm.train.score import marks_of, messages_of, without_role_names
from experiments.e2_llm.train.sites import PLACES, practice
from experiments.e2_llm.train.speaker import Metres, Speaker, Time
from formiga_bt.base.packaged import folder
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.llm.envelope import ModelAnswer, schema_of
from formiga_bt.llm.judging.judge import judge
from formiga_bt.llm.vocabulary import offered
from formiga_bt.llm.words.spoken import SPANISH, said
from formiga_bt.llm.words.wording import read, roles_of

WIDE: tuple[tuple[Mapping[str, Both], Mapping[str, Both]], ...] = (
    (CLAUSES, MORE_CLAUSES),
    (PLAIN, MORE_PLAIN),
    (ENDINGS, MORE_ENDINGS),
    (FORMATION, MORE_FORMATION),
    (FORMATION_THEN, MORE_FORMATION_THEN),
    (PARTING, MORE_PARTING),
    (CASES, {**MORE_CASES, **MORE_MEETING}),
    (RELAY, MORE_RELAY),
    (PARKED, MORE_PARKED),
    (ROUNDS, MORE_ROUNDS),
    (ONLY_IF, MORE_ONLY_IF),
    (EITHER, MORE_EITHER),
)
"""Tables and the wide ones of the same keys."""
IN_OTHER_WORDS = {"n", "ms", "m", "l", "k"}
"""How many machines, and what each is called: `a pair of`, `one ..., its partner ...`."""
SITES = (0, 1, 11)  # 11 is held out; names are changed at one of them at least
SEED = 1


@pytest.fixture(scope="module")
def made() -> list[Made]:
    maker = Maker(SEED)
    return [maker.made(number) for number in SITES]


def trees_of(made: list[Made]) -> list[tuple[Made, Any, dict[str, Any]]]:
    found = []
    for site in made:
        for pair in site.pairs:
            answer = json.loads(pair.answer)
            if "tree" in answer["answer"]:
                found.append((site, pair, answer))
    return found


def test_a_seed_gives_the_same_pairs_again(made: list[Made]) -> None:
    again = Maker(SEED).made(SITES[0])

    assert again.pairs == made[0].pairs
    assert again.practice.system == made[0].practice.system
    assert practice(SITES[0], 8).system != made[0].practice.system


@pytest.mark.slow
def test_every_tree_passes_checker_and_dry_run_and_needs_no_mend(made: list[Made]) -> None:
    trees = trees_of(made)
    assert len(trees) >= 15
    seen = set()
    for site, pair, answer in trees:
        at = site.practice
        key = (at.number, json.dumps(answer["answer"]))
        if key in seen:
            continue
        seen.add(key)
        tree = at.renaming.inverse().tree(answer["answer"]["tree"])
        world = with_points_of(pair, at.flown)
        judged = judge(ModelAnswer("", tree=tree), read("", world.site, world.catalogue), world, at.verbs, "short")
        assert (judged.errors, judged.mends) == (0, ()), pair.id
        assert judged.flight is not None
        assert judged.flight.status == "SUCCEEDED"
        assert renamed_problem(tree, at, pair) == ""


def test_renamed_verbs_and_fields_are_those_of_prompt_and_schema(made: list[Made]) -> None:
    import jsonschema

    assert any(site.practice.renaming.verbs for site in made)
    for site, pair, answer in trees_of(made):
        at = site.practice
        assert at.renaming.tree(at.renaming.inverse().tree(answer["answer"])) == answer["answer"]
        verbs = verbs_renamed(offered(at.verbs), at.renaming)
        roles = roles_of(read(pair.request, at.shown.site, at.shown.catalogue), at.shown.catalogue)
        schema = schema_of(at.shown, verbs, "short", typed=True, roles=roles)  # as the product asks
        jsonschema.Draft202012Validator(schema).validate(answer)
        for step in steps_in(answer["answer"]["tree"]["steps"]):
            assert f"\n{step['do']} " in at.system, pair.id
            for key in set(step) - {"do", "agent", "save_as"}:
                assert f'"{key}":' in at.system, pair.id
        old = set(at.renaming.verbs) - set(at.renaming.verbs.values())
        assert not [name for name in old if f"{name} " in at.system or f'"{name}"' in pair.answer]


def steps_in(data: Any) -> list[dict[str, Any]]:
    if isinstance(data, list):
        return [one for item in data for one in steps_in(item)]
    if not isinstance(data, dict):
        return []
    return ([data] if "do" in data else []) + [one for value in data.values() for one in steps_in(value)]


def test_no_request_shares_six_words_with_an_evaluation(made: list[Made]) -> None:
    requests = [pair.request for site in made for pair in site.pairs]

    assert len(requests) == len({one.casefold() for one in requests})
    assert not [one for one in requests if leaked(one)]


def test_no_plain_wording_in_the_tables_shares_six_words_with_an_evaluation() -> None:
    tables = [
        *CLAUSES.values(),
        *CASES.values(),
        *(both for of in (ENDINGS, ONLY_IF, EITHER, RELAY, PARKED, ROUNDS) for both in of.values()),
        *(both for of in (FORMATION, FORMATION_THEN, PARTING, RADIO) for both in of.values()),
        NOTHING,
        MORE_NOTHING,
        PURPOSES,
        *(row[0] for of in (IMPOSSIBLE, DANGEROUS, UNCLEAR) for row in of.values()),
    ]
    texts = [text for both in tables for wordings in both for text in wordings]
    texts += [text for of in (TWO, MORE_TWO) for frames in of.values() for text in frames]
    texts += [text for of in (SINGLE, MORE_SINGLE) for frames in of.values() for text, _ in frames]

    for text in texts:
        for form in range(3):
            assert not leaked(Speaker(random.Random(1), "en").filled(re.sub(r"\{\w+\}", "blank", text), {}, form))


@pytest.mark.parametrize(("plain", "wide"), WIDE, ids=[min(plain) for plain, _ in WIDE])
def test_a_wide_wording_says_what_all_plain_ones_say_and_nothing_else(
    plain: Mapping[str, Both], wide: Mapping[str, Both]
) -> None:
    def told(text: str) -> set[str]:
        found = {name.lower() for name in re.findall(r"\{(\w+)\}", text)} - IN_OTHER_WORDS
        return found - {"question"} | ({"x"} if "question" in found else set())

    assert set(wide) <= set(plain)
    for key, both in wide.items():
        said = [told(text) for wordings in plain[key] for text in wordings]
        for text in (text for wordings in both for text in wordings):
            assert set.intersection(*said) <= told(text) <= set.union(*said), f"{key}: {text}"


def test_who_speaks_wide_says_other_things_and_plain_wordings_stay_as_they_were() -> None:
    both = (("fly there",), ("vuela allí",), ("proceed there",), ("dirígete allí",))
    rng = random.Random(2)

    assert {Speaker(rng, "en").pick(both) for _ in range(40)} == {"fly there"}
    assert {Speaker(rng, "en", wide=True).pick(both) for _ in range(40)} == {"fly there", "proceed there"}
    assert {Speaker(rng, "es", wide=True).pick(both) for _ in range(40)} == {"vuela allí", "dirígete allí"}


def test_the_evaluations_own_wordings_are_known_as_such() -> None:
    texts = [text for of in (WORDS, FRESH) for wordings in of.values() for text in wordings] + [
        t for one in second_set() for t in one.wordings
    ]

    assert [one for one in texts if grams(one) and not leaked(one)] == []
    assert leaked("Now a light drone takes off and flies in a circular pattern with a small radius")
    assert not leaked("Have a light drone fly to the barn and come home")


def test_trees_near_the_papers_tasks_are_known_and_plain_ones_are_not() -> None:
    catalogue = world_of().catalogue
    guard = Guard(catalogue)

    for name in OF_PAPER:
        text = (folder("trees") / f"{name}.yaml").read_text(encoding="utf-8")
        assert guard.is_near(from_yaml(text, catalogue)), name
    assert guard.is_near({"steps": [{"call": "FlyAlong"}, {"call": "FlyTo"}, {"call": "ReturnHome"}]})
    assert not guard.is_near({"steps": [{"call": "FlyTo"}, {"call": "ReturnHome"}]})


def test_held_out_sites_are_marked(made: list[Made]) -> None:
    assert {pair.held for site in made[:2] for pair in site.pairs} == {False}
    assert {pair.held for pair in made[2].pairs} == {True}


def test_a_speaker_says_forms_and_values() -> None:
    speaker = Speaker(random.Random(3), "en")
    said = {speaker.filled("[hover|hovers] {h} up for {t}", {"h": Metres(40), "t": Time(60)}, 1) for _ in range(600)}

    assert "hovers 40 m up for one minute" in said
    assert "hovers forty metres up for 1 min" in said
    assert Speaker(random.Random(1), "es").filled("que [vuela|vuele|volar]", {}, 1) == "que vuele"


def test_make_writes_the_same_file_for_a_seed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a", "b"):
        make.main(["--pairs", "6", "--seed", "3", "--out", str(tmp_path / f"{name}.jsonl")])
    first, systems, pairs = make.read_pairs(tmp_path / "a.jsonl")

    assert (tmp_path / "a.jsonl").read_bytes() == (tmp_path / "b.jsonl").read_bytes()
    assert (first["seed"], len(pairs)) == (3, 6)
    assert set(systems) >= {pair.site for pair in pairs}
    assert "6 pairs on" in capsys.readouterr().out


def test_a_reference_scores_full_marks_and_another_answer_does_not(made: list[Made]) -> None:
    site, pair, answer = trees_of(made)[0]
    full = marks_of(pair.answer, None, pair, site.practice)
    refusal = json.dumps({"plan": "", "answer": {"impossible": "no", "instead": ""}})

    assert full == {"answers": True, "kind": True, "valid": True, "flies": True, "exact": True}
    assert marks_of(refusal, None, pair, site.practice) == full | {
        "kind": False,
        "valid": False,
        "flies": False,
        "exact": False,
    }
    assert marks_of("no JSON", None, pair, site.practice)["answers"] is False
    assert [one.role for one in messages_of(pair, "s", [pair])] == ["system", "user", "assistant", "user"]
    assert answer["answer"]["tree"]["task"] not in json.dumps(without_role_names(answer["answer"]["tree"]))


def test_names_of_roles_do_not_count_when_trees_are_compared() -> None:
    def tree(role: str, height: str) -> dict[str, Any]:
        step = {"do": "FlyTo", "agent": role, "to": "barn", "height": height}
        return {"task": role, "agents": [{"name": role, "type": "lwd"}], "steps": [step]}

    assert without_role_names(tree("a", "40 m")) == without_role_names(tree("b", "40 m"))
    assert without_role_names(tree("a", "40 m")) != without_role_names(tree("a", "50 m"))


def test_a_message_is_copied_in_the_language_of_the_request() -> None:
    answer = {
        "tree": {"steps": [{"if": "reply.answer == 'no'", "then": [{"notify": "Round finished"}]}, {"wait": "30 s"}]}
    }

    assert json.dumps(told_in_spanish(answer)) == json.dumps(answer).replace("Round finished", "Ronda terminada")


def drawn(make_one: Callable[[Draw], Mission], count: int = 30) -> list[Mission]:
    at = practice(0, SEED)
    return [make_one(Draw(random.Random(number), at)) for number in range(count)]


def kinds_of(steps: Any) -> str:
    return " ".join("home" if one.get("do") == "ReturnHome" else next(iter(one)) for one in steps)


def test_where_nothing_else_is_to_happen_there_is_no_else() -> None:
    for mission in drawn(deciding.only_if):
        last = mission.answer["tree"]["steps"][-1]
        assert "else" not in last
        assert last["then"]


def test_what_is_said_once_for_both_answers_is_in_both_branches_or_behind_them() -> None:
    for mission in drawn(deciding.either):
        steps = mission.answer["tree"]["steps"]
        yes, no = steps[1]["then"], steps[1]["else"]
        assert kinds_of(yes) == kinds_of(no)
        homes = json.dumps(yes).count("ReturnHome") + json.dumps(steps[2:]).count("ReturnHome")
        assert homes == json.dumps(no).count("ReturnHome") + json.dumps(steps[2:]).count("ReturnHome")
        assert homes == ("returns" in mission.plan)


def test_of_two_machines_in_turn_the_first_is_home_before_the_second_starts() -> None:
    for make_one in (relays.does_same, relays.by_turns, relays.after_yes):
        for mission in drawn(make_one):
            agents = [one["agent"] for one in steps_in(mission.answer["tree"]["steps"])]
            homes = [one["agent"] for one in steps_in(mission.answer["tree"]["steps"]) if one["do"] == "ReturnHome"]
            changes = [a for a, b in pairwise(agents) if a != b]
            assert len(changes) == 1
            assert homes[0] == changes[0] == agents[0]
            assert "parallel" not in json.dumps(mission.answer)


def test_who_lands_for_good_has_no_way_home_and_who_goes_to_its_port_has_one() -> None:
    missions = drawn(settling.settle, 60)

    assert {one.kind for one in missions} == {"for_good", "own_port"}
    for mission in missions:
        last = mission.answer["tree"]["steps"][-1]
        assert last["do"] == ("FlyAndLand" if mission.kind == "for_good" else "ReturnHome")
        assert ("ReturnHome" in json.dumps(mission.answer)) == (mission.kind == "own_port")


def test_machines_that_are_parked_stay_so_far_apart_as_is_said() -> None:
    for mission in drawn(settling.parked):
        gap = re.search(r"(\d+) m apart", mission.plan)
        assert gap is not None
        assert f"east={gap[1]} m)" in json.dumps(mission.answer)


def test_a_list_of_stops_is_flown_in_its_order() -> None:
    for mission in drawn(rounds.stops):
        at = [json.dumps(mission.answer).find(name) for name in mission.names]
        assert at == sorted(at)


def test_there_and_back_ends_where_it_began() -> None:
    for mission in drawn(rounds.there_and_back):
        flights = [one for one in steps_in(mission.answer["tree"]["steps"]) if one["do"] != "ReturnHome"]
        places = [one.get("to") or one.get("at") for one in flights]
        assert places[0] == places[2] != places[1]


def test_a_question_names_what_there_is() -> None:
    at = practice(0, SEED)
    texts = [one.answer["question"] for one in drawn(refusals.unclear, 60)]

    assert any(all(name in text for name in at.shown.site.places) for text in texts)
    assert any(all(name in text for name in (*at.ids["lwd"], *at.ids["hwd"])) for text in texts)
    assert any("The site has no place called" in text for text in texts)


def test_places_in_spanish_are_as_the_product_knows_them() -> None:
    known = [name for name in PLACES if all(part in SPANISH for part in name.split("_"))]

    assert len(known) > 25
    assert [name for name in known if not said(name, PLACES[name][1])] == []


def test_a_third_is_of_the_kinds_that_a_model_finds_hard_and_a_sixth_is_refused() -> None:
    def share(*modules: Any) -> float:
        names = {one.__name__ for one in modules}
        return sum(weight for one, weight in KINDS if one.__module__ in names) / sum(weight for _, weight in KINDS)

    assert 0.28 < share(deciding, relays, settling, rounds) < 0.38
    assert 0.14 < share(refusals) < 0.2


def test_who_has_landed_flies_home_under_any_names() -> None:
    at = next(one for one in (practice(n, SEED) for n in range(20)) if "ReturnHome" in one.renaming.verbs)
    place = next(iter(at.shown.site.places))
    steps = [
        {"do": "FlyAndLand", "agent": "drone", "at": place},
        {"wait": "20 s"},
        {"do": "ReturnHome", "agent": "drone"},
    ]

    assert (
        renamed_problem({"task": "Stop", "agents": [{"name": "drone", "type": at.kinds["lwd"][0]}], "steps": steps}, at)
        == ""
    )
    assert at.flown.site.people["watchers"]  # whom the engine asks to stand clear
