"""Each order's guard: what is asked, and that nothing leaves without it."""

import pytest

from formiga_bt.show.facts import AgentFact, Now, QuestionFact, Top
from formiga_bt.show.watch.guards import PATIENCE_S, Gate, cannot_answer, guard_of
from formiga_bt.show.watch.orders import WatchOrder
from tests.golden import Wording
from tests.unit.show.watch.fake import AT, agent, question


def site(*agents: AgentFact, questions: tuple[QuestionFact, ...] = ()) -> Now:
    return Now(
        site="meadow", at=AT, top=Top(), counts={}, tasks=(), total=0, agents=agents, questions=questions, lines=()
    )  # fmt: skip


HWD = WatchOrder(verb="hold", kind="agent", target="hwd_1")
UP = site(agent("hwd_1", task="PickUp-1"))
DOWN = site(
    agent("hwd_1", task="PickUp-1", landed="grounded"), agent("eve", task="PickUp-1", mobility="people", landed="")
)


def order(verb: str, kind: str = "agent", target: str = "hwd_1", how: str = "", by: str = "") -> WatchOrder:
    return WatchOrder(verb=verb, kind=kind, target=target, how=how, by=by)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "now", "kind"),
    [
        (order("hold"), UP, "none"),
        (order("hold", "all", ""), UP, "none"),
        (order("return"), UP, "none"),
        (order("return", "task", "PickUp-1"), UP, "none"),
        (order("return", "all", ""), UP, "yes"),
        (order("land"), UP, "yes"),
        (order("land"), DOWN, "none"),
        (order("land", "task", "PickUp-1"), UP, "yes"),
        (order("land", "task", "PickUp-1"), DOWN, "none"),
        (order("land", "task", "PickUp-9"), UP, "yes"),
        (order("land", "agent", "hwd_9"), UP, "yes"),
        (order("land", "all", ""), DOWN, "yes"),
        (order("continue"), UP, "yes"),
        (order("abort", "task", "PickUp-1"), UP, "yes"),
        (order("clear"), UP, "yes"),
        (order("handback"), UP, "choose"),
        (order("handback", how="end"), UP, "yes"),
        (order("release", "all", ""), UP, "yes"),
        (order("lockdown", "all", ""), UP, "twice"),
        (order("cut"), UP, "typed"),
    ],
)
def test_what_is_asked_first(given: WatchOrder, now: Now, kind: str) -> None:
    guard = guard_of(given, now)
    assert guard.kind == kind
    assert guard.text == "" if kind == "none" else given.target in guard.text


def test_an_answer_leaves_at_once_unless_it_says_that_people_stand_clear(wording: Wording) -> None:
    plain, clears = question(), question("Q8", clears="hwd_1", clears_on=("loaded",))
    clearance = question("Q9", kind="clearance", text="Do people stand clear of hwd_1?", options=("clear", "wait"))
    now = site(questions=(plain, clears, clearance))
    assert guard_of(order("answer", "question", "Q7", "loaded"), now).kind == "none"
    assert guard_of(order("answer", "question", "Q8", "not_yet"), now).kind == "none"
    assert guard_of(order("answer", "question", "Q8", "loaded"), now).kind == "yes"
    asked = guard_of(order("answer", "question", "Q9", "clear"), now)
    wording(asked.text)
    assert guard_of(order("answer", "question", "Q5", "clear"), now).kind == "yes"


def test_several_people_here_who_answers_is_asked_first_then_the_rest(wording: Wording) -> None:
    both = question(kind="clearance", here=("eve", "bob"), asked=("eve", "bob"))
    gate = Gate()
    assert gate.begin(order("answer", "question", "Q7", "loaded"), site(questions=(both,)), 0.0) is None
    wording(gate.text)
    assert gate.press("2", "2", 1.0) is None
    assert "asked 0:41 ago" in gate.text
    sent = gate.press("y", "y", 2.0)
    assert sent is not None
    assert sent.by == "bob"
    wording(sent.words)


def test_who_has_an_app_of_their_own_cannot_be_answered_for(wording: Wording) -> None:
    assert cannot_answer(question()) == ""
    wording(cannot_answer(question(here=())))


def test_any_other_key_than_y_does_nothing(wording: Wording) -> None:
    for key, character in (("n", "n"), ("escape", ""), ("Y", "Y"), ("enter", ""), ("down", "")):
        gate = Gate()
        gate.begin(order("abort", "task", "PickUp-1"), UP, 0.0)
        assert gate.press(key, character, 1.0) is None
        assert not gate.is_open
        wording(gate.said)
        assert gate.press("y", "y", 1.5) is None


def test_what_is_asked_lapses(wording: Wording) -> None:
    gate = Gate()
    gate.begin(order("land"), UP, 0.0)
    assert not gate.lapse(PATIENCE_S)
    assert gate.press("y", "y", PATIENCE_S + 0.1) is None
    wording(gate.said)


def test_lockdown_needs_its_key_twice_within_two_seconds() -> None:
    lockdown = order("lockdown", "all", "")
    gate = Gate()
    gate.begin(lockdown, UP, 0.0)
    assert gate.press("exclamation_mark", "!", 2.0) == lockdown
    gate.begin(lockdown, UP, 10.0)
    assert gate.press("exclamation_mark", "!", 12.1) is None
    gate.begin(lockdown, UP, 20.0)
    assert gate.press("y", "y", 20.5) is None
    assert not gate.is_open


def typed(text: str, end: str = "enter") -> WatchOrder | None:
    gate = Gate()
    gate.begin(order("cut"), UP, 0.0)
    for character in text:
        assert gate.press(character, character, 1.0) is None
    return gate.press(end, "", 1.0)


def test_cut_needs_the_whole_name_and_enter() -> None:
    sent = typed("hwd_1")
    assert sent is not None
    assert sent.confirmed == "hwd_1"
    for wrong in ("hwd_2", "hwd", "hwd_1 ", "", "HWD_1", "y"):
        assert typed(wrong) is None
    assert typed("hwd_1", end="escape") is None


def test_a_typed_name_can_be_mended(wording: Wording) -> None:
    gate = Gate()
    gate.begin(order("cut"), UP, 0.0)
    for key in ("h", "w", "x", "backspace", "d", "_", "1"):
        gate.press(key, key if len(key) == 1 else "", 1.0)
    wording(gate.text)
    assert gate.press("enter", "", 1.0) is not None
