"""Forms: what people fill in with an answer is typed and checked by the engine."""

from formiga_bt.engine.kernel.inputs import NotifyPeople, SendGoal
from formiga_bt.rehearsal.testing import effects
from tests.unit.engine.conftest import Make
from tests.unit.engine.yard import Yard

FORM = "form: {crates: {type: int, min: 1, max: 40}, state: {type: enum, values: [dry, wet]}, spot: place}"
ASK = f"steps: [{{ask: 'Which?', of: [watchers], timeout: 10 min, save_as: got, {FORM}%s}}, {{notify: '%s'}}]\n"
TOLD = "${got.answer} ${got.crates + 1} ${got.state} ${distance(got.spot, base)}"
GOOD = {"crates": 12, "state": "dry", "spot": {"east_m": 30.0, "north_m": 4.0}}


def say(yard: Yard, form: object, who: int = 0) -> None:
    person = yard.people[who]
    person.succeed({"answer": "done", "by": person.id, "at": 0, "form": form})


def notices(yard: Yard) -> list[str]:
    return [one.text for one in effects(yard, NotifyPeople)]


def test_what_is_filled_in_is_a_typed_field_of_the_reply(make: Make) -> None:
    yard = make(ASK % ("", TOLD))
    task = yard.start()
    fields = effects(yard, SendGoal)[0].fields
    assert fields["options"] == ["done"]
    assert [one["name"] for one in fields["form"]] == ["crates", "state", "spot"]
    assert fields["form"][0] == {"name": "crates", "type": "int", "least": 1.0, "most": 40.0}

    say(yard, GOOD)

    assert yard.end(task) == ("SUCCEEDED", "")
    assert notices(yard)[-1].startswith("done 13 dry 30.265 m")


def test_what_does_not_fit_is_no_answer_and_its_person_is_told(make: Make) -> None:
    bad = [
        {**GOOD, "crates": 41}, {**GOOD, "crates": "many"}, {**GOOD, "state": "damp"}, {"crates": 2, "state": "dry"},
        {**GOOD, "spot": {"east_m": float("nan"), "north_m": 0.0}}, None, "all of them",
    ]  # fmt: skip
    for form in bad:
        yard = make(ASK % ("", TOLD), people=2)
        task = yard.start()

        say(yard, form)
        yard.run_for(1)

        assert yard.task(task).status == "ACTIVE", form
        assert any(one.startswith("Q1 is not answered") for one in notices(yard)), form
        say(yard, GOOD, who=1)
        assert yard.end(task) == ("SUCCEEDED", ""), form


def test_each_of_all_fills_in_a_form(make: Make) -> None:
    yard = make(ASK % (", policy: all", "${got.all[0].crates + got.all[1].crates}"), people=2)
    task = yard.start()
    say(yard, GOOD)
    say(yard, {**GOOD, "crates": 30}, who=1)
    assert yard.end(task) == ("SUCCEEDED", "")
    assert notices(yard)[-1] == "42"
