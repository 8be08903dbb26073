"""Keys that order, on a screen: what leaves, after which guard, for which target; and that nothing else ever leaves."""

from formiga_bt.base.errors import FormigaError
from formiga_bt.show.facts import LineFact
from formiga_bt.show.watch.orders import WatchReply
from tests.golden import Wording
from tests.unit.show.watch.fake import AT, FakeSource, Room, S, agent, alarm, many, question, task, watching


def test_hold_and_return_leave_at_once_and_the_reply_is_shown(wording: Wording) -> None:
    async def order(room: Room) -> None:
        room.actor.reply = WatchReply("hwd_1 hovers; it returns by itself in 12 min\nnext: formiga continue PickUp-1")
        await room.press("h")
        assert room.sent == ["hold PickUp-1"]
        wording(room.said)
        await room.press("a", "down", "r")
        assert room.sent == ["hold PickUp-1", "return hwd_2"]
        await room.press("H")
        assert room.sent[-1] == "hold --all"

    watching(order)


def test_orders_with_a_guard_leave_with_y_only(wording: Wording) -> None:
    async def order(room: Room) -> None:
        for key, words in (
            ("l", "land PickUp-1"), ("c", "continue PickUp-1"), ("A", "abort PickUp-1"), ("R", "return --all"),
            ("L", "land --all"), ("U", "release"),
        ):  # fmt: skip
            before = list(room.sent)
            await room.press(key)
            assert room.sent == before
            wording(room.said)
            await room.press("n")
            assert room.sent == before
            wording(room.said)
            await room.press(key, "y")
            assert room.sent == [*before, words]

    watching(order)


def test_land_of_what_stands_leaves_at_once() -> None:
    source = FakeSource()
    source.agents = [agent("hwd_1", landed="grounded")]

    async def order(room: Room) -> None:
        await room.press("a", "l")
        assert room.sent == ["land hwd_1"]

    watching(order, source)


def test_lockdown_leaves_with_its_key_twice_within_two_seconds(wording: Wording) -> None:
    async def order(room: Room) -> None:
        await room.press("exclamation_mark")
        wording(room.said)
        await room.tick(2.5)
        wording(room.said)
        await room.press("exclamation_mark")
        assert room.sent == []
        await room.press("exclamation_mark")
        assert room.sent == ["lockdown"]

    watching(order)


def test_cut_leaves_with_the_machines_own_name_only(wording: Wording) -> None:
    async def order(room: Room) -> None:
        await room.press("x")
        wording(room.said)
        await room.press("a", "x", *"hwd_2", "enter")
        wording(room.said)
        await room.press("x", "enter")
        assert room.sent == []
        await room.press("x", *"hwd_1")
        wording(room.said)
        assert room.sent == []
        await room.press("enter")
        assert room.sent == ["cut hwd_1"]
        assert room.actor.sent[0].confirmed == "hwd_1"

    watching(order)


def test_a_plain_question_is_answered_with_one_key(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question()]

    async def order(room: Room) -> None:
        await room.press("n", "2")
        assert room.sent == ["answer Q7 not_yet"]
        wording(room.said)
        await room.press("3")
        wording(room.said)
        assert len(room.sent) == 1

    watching(order, source)


def test_a_clearance_asks_for_a_second_key_with_the_question_and_since_when(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(kind="clearance", text="Do people stand clear of hwd_1?", options=("clear", "wait"))]

    async def order(room: Room) -> None:
        await room.press("n", "1")
        assert room.sent == []
        wording(room.said)
        await room.press("1")
        assert room.sent == []
        await room.press("1", "y")
        assert room.sent == ["answer Q7 clear"]

    watching(order, source)


def test_a_question_is_answered_from_its_task_too(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(task="PickUp-1")]

    async def order(room: Room) -> None:
        await room.press("1")
        await room.press("down", "1")
        assert room.sent == ["answer Q7 loaded"]
        wording(room.said)
        await room.press("up", "enter")
        await room.poll()
        await room.press("2")
        assert room.sent == ["answer Q7 loaded", "answer Q7 not_yet"]

    watching(order, source)


def test_of_several_questions_of_a_task_one_must_be_chosen(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(task="PickUp-1"), question("Q8", task="PickUp-1")]

    async def order(room: Room) -> None:
        await room.press("1")
        assert room.sent == []
        wording(room.said)

    watching(order, source)


def test_a_question_that_has_just_taken_the_place_of_another_is_not_answered(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(task="PickUp-1")]

    async def order(room: Room) -> None:
        source.questions = [question("Q8", task="PickUp-1", text="Shall it be cut loose?")]
        await room.poll(0.5)
        await room.press("1")
        assert room.sent == []
        wording(room.said)
        await room.poll(1.0)
        await room.press("1")
        assert room.sent == ["answer Q8 loaded"]

    watching(order, source)


def test_a_key_for_a_question_that_closed_answers_no_other(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(), question("Q8", text="Is it safe?")]

    async def order(room: Room) -> None:
        await room.press("n")
        source.questions = [question("Q8", text="Is it safe?")]
        await room.poll()
        await room.press("1")
        assert room.sent == []
        wording(room.said)
        await room.press("n", "1")
        assert room.sent == ["answer Q8 loaded"]

    watching(order, source)


def test_who_has_an_app_of_their_own_is_not_answered_for(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question(here=())]

    async def order(room: Room) -> None:
        await room.press("n", "1")
        assert room.sent == []
        wording(room.said)

    watching(order, source)


def test_a_machine_is_handed_back_with_its_number_or_b(wording: Wording) -> None:
    source = FakeSource()
    source.agents = [agent("lwd_3", taken=True, control="engine")]

    async def order(room: Room) -> None:
        await room.press("n", "2")
        wording(room.said)
        await room.press("y", "a", "b", "1", "y")
        assert room.sent == ["handback lwd_3 --return", "handback lwd_3 --continue"]

    watching(order, source)


def test_a_quarantined_machine_is_cleared_after_a_second_key() -> None:
    source = FakeSource()
    source.agents = [agent("hwd_1", quarantine="did not confirm a stop")]

    async def order(room: Room) -> None:
        await room.press("n", "1", "n", "a", "C", "y")
        assert room.sent == ["clear hwd_1"]

    watching(order, source)


def test_one_that_is_there_twice_cannot_be_cleared() -> None:
    source = FakeSource()
    source.agents = [agent("hwd_1", quarantine="double")]

    async def order(room: Room) -> None:
        await room.press("n", "1", "y")
        assert room.sent == []

    watching(order, source)


def test_an_order_hits_what_was_chosen_when_rows_change_places_under_the_cursor() -> None:
    source = FakeSource()
    source.tasks = many(40)

    async def order(room: Room) -> None:
        await room.press("down", "down")
        for turn in range(12):
            source.tasks = source.tasks[7:] + source.tasks[:7] if turn % 2 else source.tasks[::-1]
            await room.poll(0.5)
            if room.app.board.tasks.selection.id:
                await room.press("h")
        assert set(room.sent) == {"hold PickUp-3"}

    watching(order, source, size=(100, 60))


def test_what_is_asked_about_stays_while_rows_change_places() -> None:
    async def order(room: Room) -> None:
        await room.press("down", "A")
        room.source.tasks = [task(3), task(1), task(4)]
        await room.poll(1.0)
        assert room.shows("Abort PickUp-2")
        await room.press("y")
        assert room.sent == ["abort PickUp-2"]

    watching(order)


def test_a_row_that_is_gone_takes_no_order_and_neither_does_its_neighbour(wording: Wording) -> None:
    async def order(room: Room) -> None:
        await room.press("down")
        room.source.tasks = [task(1), task(3)]
        await room.poll()
        await room.press("h", "r", "l", "A", "x", "1", "y")
        assert room.sent == []
        wording(room.said)

    watching(order)


def test_in_a_task_orders_are_for_it_or_for_the_machine_that_is_chosen() -> None:
    async def order(room: Room) -> None:
        await room.press("down", "enter")
        await room.poll()
        await room.press("h", "a", "r")
        assert room.sent == ["hold PickUp-2", "return hwd_2"]

    watching(order)


def test_read_only_sends_nothing_whatever_is_pressed(wording: Wording) -> None:
    source = FakeSource()
    source.questions = [question()]
    keys = [
        "h",
        "r",
        "l",
        "c",
        "A",
        "H",
        "R",
        "L",
        "U",
        "exclamation_mark",
        "exclamation_mark",
        "x",
        "b",
        "C",
        "1",
        "y",
    ]

    async def order(room: Room) -> None:
        for pane in ("n", "t", "a"):
            await room.press(pane, *keys)
            wording(room.said)
        assert room.sent == []
        assert "READ ONLY" in room.lines[-1]
        assert "h:hold" not in room.lines[-1]

    watching(order, source, read_only=True)


def test_no_answer_to_an_order_is_told_as_such_and_a_refusal_as_refusal(wording: Wording) -> None:
    async def order(room: Room) -> None:
        room.actor.error = FormigaError("the engine does not answer")
        await room.press("h")
        wording(room.said)
        room.actor.error, room.actor.reply = None, WatchReply("REFUSED: hwd_1 is lost", good=False)
        await room.press("h")
        wording(room.said)
        assert any("REFUSED" in one.text and one.style.color.name == "red" for one in room.styled)
        await room.press("escape")
        assert not room.shows("REFUSED")

    watching(order)


def test_orders_are_tried_also_while_the_engine_does_not_answer() -> None:
    async def order(room: Room) -> None:
        room.source.gone = "nothing answers"
        await room.poll()
        await room.press("h")
        assert room.sent == ["hold PickUp-1"]

    watching(order)


def test_the_events_take_no_orders_and_an_alarm_is_acknowledged() -> None:
    source = FakeSource()
    source.lines = [LineFact(at=AT - S, text="hwd_9 is lost", severity="alarm")]
    source.alarms = [alarm(7, "hwd_9 is lost")]

    async def order(room: Room) -> None:
        await room.press("v", "h", "n", "h")
        assert room.sent == []
        await room.press("1")
        assert room.sent == ["ack A7"]

    watching(order, source)
