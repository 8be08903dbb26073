"""The watch on a screen: what is seen, found, followed and entered. Time stands still unless a test moves it."""

import pytest

from formiga_bt.show.facts import GoalFact, LineFact, StepFact, TaskFact, Top
from tests.unit.show.watch.fake import AT, FakeSource, Room, S, agent, alarm, many, question, replace, task, watching

TOP = Top(airborne=7, needs_you=2, longest_wait_us=41 * S, alarms=1, held=1, taken=(("PILOT", "lwd_3"),))


def busy() -> FakeSource:
    source = FakeSource()
    source.top = TOP
    source.questions = [question()]
    source.agents.append(agent("lwd_3", taken=True, control="engine"))
    source.alarms = [alarm(4, "hwd_9 is lost"), alarm(3, "an older one", state="acknowledged", owner="ann")]
    return source


def test_what_needs_a_person_is_on_top_with_its_numbered_answers() -> None:
    async def look(room: Room) -> None:
        assert room.lines[:10] == [
            "AIRBORNE 7 | NEEDS YOU 2 (0:41) | ALARM 1 | HELD 1 | PILOT has lwd_3                          meadow",
            " NEEDS YOU " + "─" * 88,
            "▶ Q7 0:41  PickUp-3 asks eve",
            "      Is the box loaded?",
            "      1 loaded   2 not_yet",
            "      lapses in 4:19, then its step fails: the task fails",
            "  HAND BACK lwd_3: it was taken over, and given back",
            "      1 continue   2 return   3 end",
            "  ALARM A4 0:30 ago: hwd_9 is lost (lost)",
            "      1 ack: you take care of it",
        ]
        assert room.lines[10] == " TASKS " + "─" * 92

    watching(look, busy())


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (40, 10), (200, 60)])
def test_every_screen_shows_the_top_line_and_what_needs_a_person(size: tuple[int, int]) -> None:
    async def look(room: Room) -> None:
        assert room.text.startswith("AIRBORNE 7 | NEEDS YOU 2 (0:41)")
        assert room.shows("ALARM 1 | HELD 1")
        assert room.shows("PILOT has lwd_3")
        assert room.shows("Is the box loaded? 1 loaded 2 not_yet")
        assert len(room.lines) == size[1]

    watching(look, busy(), size=size)


def test_the_top_line_stays_in_every_view() -> None:
    async def look(room: Room) -> None:
        first = room.lines[0]
        for keys in (["enter"], ["w"], ["question_mark"], ["escape"], ["pagedown", "end"]):
            await room.press(*keys)
            await room.poll()
            assert room.lines[0] == first

    watching(look, busy())


def test_rows_stand_in_the_order_of_the_source_with_what_comes_next() -> None:
    source = FakeSource()
    source.tasks = [
        task(3, urgent_at=AT + 41 * S, urgent="Q7 lapses", needs="Q7"),
        task(1, urgent_at=AT + 700 * S, urgent="timeout", held=("operator",)),
        task(2, status="PENDING", agents=(), doing="waits for an hwd"),
    ]

    async def look(room: Room) -> None:
        at = room.lines.index("  TASK     STATUS           NEXT               AGENTS             DOES")
        assert room.lines[at + 1 : at + 4] == [
            "▶ PickUp-3 ● ACTIVE         0:41 Q7 lapses     hwd_3              NEEDS YOU: Q7 hwd_3 flies to camp",
            "  PickUp-1 ‖ ACTIVE HELD    11:40 timeout      hwd_1              hwd_1 flies to camp",
            "  PickUp-2 ○ PENDING                                              waits for an hwd",
        ]

    watching(look, source)


def test_the_choice_follows_a_row_that_changes_its_place() -> None:
    async def look(room: Room) -> None:
        await room.press("down")
        assert "▶ PickUp-2" in room.text
        room.source.tasks = [task(3), task(9), task(1), task(2)]
        await room.poll()
        assert "▶ PickUp-2" in room.text
        assert "▶ PickUp-9" not in room.text

    watching(look)


def test_a_row_that_is_gone_is_told_and_the_next_key_chooses_its_neighbour() -> None:
    async def look(room: Room) -> None:
        await room.press("down")
        room.source.tasks = [task(1), task(3)]
        await room.poll()
        assert room.lines[-1].startswith(" PickUp-2 is no longer here; choose again")
        assert "▶ PickUp" not in room.text
        await room.press("down")
        assert "▶ PickUp-3" in room.text

    watching(look)


def test_only_the_page_in_view_is_asked_for_and_all_are_reached() -> None:
    source = FakeSource()
    source.tasks = many(5000)

    async def look(room: Room) -> None:
        rows = room.app.board.tasks.room
        assert max(count for _, count, _, _ in source.asked) <= 3 * 30
        assert f" TASKS  1-{rows} of 5000 ─" in room.text
        await room.press("end")
        await room.poll()
        assert "▶ PickUp-5000" in room.text
        assert f" TASKS  {5001 - rows}-5000 of 5000 ─" in room.text
        await room.press("up", "up")
        assert "▶ PickUp-4998" in room.text
        await room.press("home")
        await room.poll()
        assert "▶ PickUp-1 " in room.text
        for _ in range(5):
            await room.press("pagedown")
            await room.poll()
        assert f"▶ PickUp-{5 * (rows - 1) + 1} " in room.text

    watching(look, source)


def test_an_answer_from_before_the_key_does_not_lead_astray() -> None:
    source = FakeSource()
    source.tasks = many(900)

    async def look(room: Room) -> None:
        pane = room.app.board.tasks
        await room.press("end")
        room.app.board.fill(source.now(count=50), (), base=0, find="", over=False)
        assert pane.selection.id == ""
        await room.press("h")
        assert room.sent == []
        await room.poll()
        assert pane.selection.id == "PickUp-900"

    watching(look, source)


def test_every_row_of_a_long_table_is_walked_through_one_by_one() -> None:
    source = FakeSource()
    source.tasks = many(120)

    async def look(room: Room) -> None:
        for number in range(5, 121, 4):
            await room.press("down", "down", "down", "down")
            await room.poll(0.1)
            assert room.app.board.tasks.selection.id == f"PickUp-{number}"
            assert f"▶ PickUp-{number} " in room.text

    watching(look, source)


def test_the_chosen_row_stays_in_view_when_its_page_moves() -> None:
    source = FakeSource()
    source.tasks = many(500)

    async def look(room: Room) -> None:
        await room.press("pagedown", "pagedown")
        chosen = room.app.board.tasks.selection.id
        source.tasks = source.tasks[3:]
        await room.poll()
        await room.poll()
        assert f"▶ {chosen} " in room.text

    watching(look, source)


def test_what_needs_a_person_stays_in_view_on_every_page() -> None:
    source = FakeSource()
    source.tasks = [task(0, held=("operator",), needs="continue or end it"), *many(500)]

    async def look(room: Room) -> None:
        for keys in (["end"], ["slash", *"400", "enter"]):
            await room.press(*keys)
            await room.poll()
            await room.poll()
            assert "▶ PickUp-0" not in room.text.partition("TASKS")[2]
            assert room.shows("HELD PickUp-0: continue or end it")

    watching(look, source)


def test_find_narrows_and_escape_shows_all() -> None:
    async def look(room: Room) -> None:
        await room.press("slash", "U", "p", "minus", "2")
        await room.poll()
        assert " TASKS with 'Up-2' ─" in room.text
        assert "find: Up-2_" in room.lines[-1]
        await room.press("enter")
        assert "PickUp-1" not in room.text.partition(" AGENTS ─")[0].partition("DOES")[2]
        await room.press("h")
        assert room.sent == ["hold PickUp-2"]
        await room.press("escape", "escape")
        await room.poll()
        assert room.shows("▶ PickUp-1")

    watching(look)


def test_what_is_found_nowhere_is_said() -> None:
    async def look(room: Room) -> None:
        await room.press("slash", "z", "enter")
        await room.poll()
        assert room.shows("no task has 'z'; Esc shows all")

    watching(look)


def test_ended_tasks_are_shown_on_demand() -> None:
    source = FakeSource()
    source.tasks.append(task(4, status="FAILED", ended_at=AT, code="timeout", reason="took longer than 2 min"))

    async def look(room: Room) -> None:
        assert "PickUp-4" not in room.text
        await room.press("o")
        await room.poll()
        assert room.shows("PickUp-4 ✗ FAILED hwd_4 timeout took longer than 2 min")

    watching(look, source)


def close_to() -> FakeSource:
    source = FakeSource()
    source.steps = (
        StepFact(path="steps/steps[0]", status="success", succeeded=1),
        StepFact(path="steps/steps[1]", status="running", running=1, note="hwd_1 40 %"),
    )
    source.goals = (
        GoalFact(
            id="g1",
            agent="hwd_1",
            action="GoTo",
            state="running",
            progress=0.4,
            since=AT - 9 * S,
            target="to 80 E 20 N 60 up",
        ),
        GoalFact(id="g2", agent="lwd_1", action="GoTo", state="gated", code="separation", text="hwd_2 is in the way"),
    )
    source.lines = [LineFact(at=AT - 5 * S, text="PickUp-1 starts")]
    return source


def test_a_task_close_by_has_its_tree_with_places_values_goals_and_events() -> None:
    async def look(room: Room) -> None:
        await room.press("enter")
        await room.poll()
        assert "PickUp-1 ● ACTIVE  hwd_1" in room.lines
        (row,) = [one for one in room.lines if "drone.GoTo" in one]
        assert row.startswith("▶ └─ ► drone.GoTo  hwd_1 40 %")
        assert row.endswith("pick_up.yaml:7")
        assert "├─ ✓ drone.TakeOff" in room.text
        for keys, words in (
            (["tab"], "hwd_1 GoTo running 40 % 0:09 to 80 E 20 N 60 up"),
            ([], "lwd_1 GoTo WAITS"),
            (["tab"], "hwd_1 AIRBORNE 71 %"),
            (["tab"], "height 60 m"),
            ([], "each[0] spot A"),
            (["tab"], "0:05 ago PickUp-1 starts"),
            (["w"], "hwd_1.GoTo waits: the way is taken -> formiga why hwd_1"),
            (["w"], "drone.GoTo"),
            (["escape"], "PickUp-2 ● ACTIVE"),
        ):
            await room.press(*keys)
            await room.poll()
            assert room.shows(words), room.text

    watching(look, close_to())


def test_a_wide_screen_shows_all_of_a_task_at_once() -> None:
    async def look(room: Room) -> None:
        for words in ("TREE", "GOALS", "ITS AGENTS", "VALUES", "ITS EVENTS", "hwd_1 40 %", "height", "PickUp-1 starts"):
            assert room.shows(words), words

    watching(look, close_to(), size=(160, 45), task="PickUp-1")


def test_the_watch_begins_with_the_task_it_is_given_and_goes_back_to_all() -> None:
    async def look(room: Room) -> None:
        assert room.shows("PickUp-2 ● ACTIVE hwd_2")
        assert room.shows("TREE")
        await room.press("escape")
        await room.poll()
        assert room.shows("TASKS")

    watching(look, task="PickUp-2")


def test_a_task_that_there_is_not_is_said_in_words() -> None:
    async def look(room: Room) -> None:
        assert room.shows("there is no task 'PickUp-77' (any more)")
        assert room.shows("TASKS")

    watching(look, task="PickUp-77")


def test_why_of_a_row_and_back() -> None:
    async def look(room: Room) -> None:
        await room.press("a", "w")
        await room.poll()
        assert " WHY hwd_1  (Esc: back)" in room.text
        assert room.shows("-> formiga why hwd_1")
        await room.press("escape")
        assert room.shows("TASKS")

    watching(look)


def test_an_agent_leads_to_its_task() -> None:
    async def look(room: Room) -> None:
        await room.press("a", "down", "enter")
        await room.poll()
        assert room.shows("PickUp-2 ● ACTIVE hwd_2")

    watching(look)


def test_an_engine_that_is_gone_is_said_in_red_with_the_age_and_comes_back() -> None:
    async def look(room: Room) -> None:
        room.source.gone = "the engine does not answer"
        await room.poll(5.0)
        assert room.lines[0].startswith("NO ENGINE: what you see is 0:05 old | AIRBORNE 0")
        assert room.lines[-1] == " the engine does not answer; trying again"
        assert any("NO ENGINE" in one.text and one.style.bgcolor.name == "red" for one in room.styled)
        assert room.shows("▶ PickUp-1")
        await room.tick(60.0)
        assert room.lines[0].startswith("NO ENGINE: what you see is 1:05 old")
        room.source.gone = ""
        room.source.tasks = [task(1), task(8)]
        await room.poll(1.0)
        assert room.lines[0].startswith("AIRBORNE 0")
        assert room.shows("PickUp-8")

    watching(look)


def test_an_answer_that_is_late_is_told_before_the_call_fails() -> None:
    async def look(room: Room) -> None:
        await room.tick(2.9)
        assert "NO ENGINE" not in room.text
        await room.tick(0.2)
        assert room.lines[0].startswith("NO ENGINE: what you see is 0:03 old")

    watching(look)


def test_no_engine_from_the_start() -> None:
    source = FakeSource()
    source.gone = "no engine runs"

    async def look(room: Room) -> None:
        assert room.lines[0].startswith("NO ENGINE: tried for 0:05")
        await room.press("h", "exclamation_mark", "enter", "w", "n")
        assert room.sent == []

    watching(look, source)


def test_a_resized_screen_is_laid_out_anew() -> None:
    async def look(room: Room) -> None:
        await room.press("down")
        for size in ((60, 16), (180, 50), (40, 10), (100, 30)):
            await room.resize(*size)
            assert room.text.startswith("AIRBORNE 7 | NEEDS YOU 2 (0:41)")
            assert room.shows("1 loaded 2 not_yet")
            if size[1] > 10:
                assert "▶ PickUp-2" in room.text

    watching(look, busy())


def test_without_colour_nothing_is_said_by_colour_and_no_colour_leaves() -> None:
    async def look(room: Room) -> None:
        for keys in (["n"], ["t", "enter"], ["question_mark"]):
            await room.press(*keys)
            await room.poll()
            styles = [one.style for one in room.styled if one.style is not None]
            assert {s.color.name for s in styles if s.color} | {s.bgcolor.name for s in styles if s.bgcolor} <= {
                "default"
            }
        assert room.lines[0].startswith("AIRBORNE 7 | NEEDS YOU 2 (0:41) | ALARM 1")

    watching(look, busy(), colour=False)


def test_ascii_draws_every_view_with_ascii_only() -> None:
    source = busy()
    source.questions[0] = replace(source.questions[0], text="Steht die Kiste für Käthe?")
    source.tasks.append(TaskFact(id="Ü-1", name="Ü", status="PENDING"))

    async def look(room: Room) -> None:
        for keys in ([], ["n"], ["t", "enter"], ["w"], ["question_mark"]):
            await room.press(*keys)
            await room.poll()
            assert room.text.isascii(), [c for c in room.text if not c.isascii()]
        assert "f\\xfcr" not in room.lines[0]

    watching(look, source, ascii_only=True)


def test_texts_from_outside_command_no_terminal() -> None:
    source = FakeSource()
    evil = "a\x1b]0;owned\x07b\x1b[2J\r\nc\u202ed"
    source.questions = [question(text=evil, options=(evil, "no"), if_no_answer=evil)]
    source.agents = [agent("hwd_1", quarantine=evil, order=evil, action=evil)]
    source.tasks = [task(1, doing=evil, urgent=evil, needs=evil)]
    source.lines = [LineFact(at=AT, text=evil, severity="alarm")]
    source.alarms = [alarm(1, evil, code=evil)]

    async def look(room: Room) -> None:
        for keys in ([], ["v"], ["t", "enter"]):
            await room.press(*keys)
            await room.poll()
            assert not [c for c in room.text if c != "\n" and not c.isprintable()]

    watching(look, source, size=(140, 50))


def test_nothing_is_drawn_again_where_nothing_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    async def look(room: Room) -> None:
        drawn: list[object] = []
        frame = room.app.frame
        for pane in (frame.top, *room.app.board.panes, frame.foot, frame.reply):
            monkeypatch.setattr(pane, "refresh", lambda *regions, **more: drawn.append(regions))
        await room.poll(0.5)
        assert drawn == []
        room.source.tasks[1] = task(2, doing="lands")
        await room.poll(0.5)
        assert [[region.height for region in regions] for regions in drawn] == [[1]]  # type: ignore[attr-defined]

    watching(look)


def test_the_newest_event_stays_on_top_until_one_is_chosen() -> None:
    source = FakeSource()
    source.lines = [LineFact(at=AT - n * S, text=f"event {n}") for n in range(40, 0, -1)]

    async def look(room: Room) -> None:
        await room.press("v")
        assert room.shows("▶ 0:01 ago event 1 ")
        source.lines.append(LineFact(at=AT, text="the newest"))
        await room.poll()
        assert room.shows("▶ 0:00 ago the newest")
        await room.press("down", "down")
        source.lines.append(LineFact(at=AT, text="another one"))
        await room.poll()
        assert room.shows("▶ 0:02 ago event 2 ")

    watching(look, source, size=(80, 24))


def test_few_tasks_leave_their_room_to_the_agents() -> None:
    source = FakeSource()
    source.agents = [agent(f"hwd_{n}") for n in range(1, 13)]

    async def look(room: Room) -> None:
        assert all(room.shows(f"hwd_{n} ") for n in range(1, 13))
        source.tasks = many(40)
        await room.poll()
        await room.poll()
        assert room.shows("PickUp-9 ")

    watching(look, source, size=(100, 34))


def test_what_is_cut_at_the_edge_has_a_mark_and_failures_are_told() -> None:
    source = FakeSource()
    source.tasks = [task(1, doing="a long way of words " * 9)]
    source.counts = {"FAILED": 2}

    async def look(room: Room) -> None:
        row = next(text for text in room.lines if "PickUp-1" in text)
        assert row.endswith("…")
        assert room.shows("TASKS 2 FAILED (o: ended ones)")

    watching(look, source)


def test_a_machine_to_hand_back_is_told_once_and_people_as_here_or_asked() -> None:
    source = FakeSource()
    source.agents = [
        agent("hwd_1", task="PickUp-1", taken=True),
        agent("eve", mobility="people", word="EXECUTING ACTION"),
    ]
    source.agents.append(agent("bob", mobility="people", word="STANDBY"))
    source.tasks = [task(1, held=("take-over:hwd_1",), needs="hand hwd_1 back")]

    async def look(room: Room) -> None:
        assert (
            room.text.count("hwd_1 back") + room.text.count("HAND BACK hwd_1") == 2
        )  # its own line, and its task's row
        assert not room.shows("HELD PickUp-1: hand hwd_1 back")
        assert room.shows("eve asked")
        assert room.shows("bob here")

    watching(look, source)


def test_the_speed_of_the_clock_is_said_where_it_is_not_that_of_the_wall() -> None:
    source = FakeSource()
    source.speed = 20.0

    async def look(room: Room) -> None:
        assert room.lines[0].endswith("meadow, clock x20")

    watching(look, source)


def test_what_needed_a_person_and_is_gone_is_called_by_its_name() -> None:
    source = FakeSource()
    source.agents = [agent("hwd_1", taken=True), agent("hwd_2")]

    async def look(room: Room) -> None:
        await room.press("n", "home")
        source.agents = [agent("hwd_1"), agent("hwd_2", taken=True)]
        await room.poll()
        assert room.lines[-1].startswith(" hwd_1 is no longer here; choose again")

    watching(look, source)


def test_of_many_that_wait_the_next_few_are_shown_until_a_person_asks_for_all() -> None:
    source = FakeSource()
    waiting = [task(n, status="PENDING", agents=()) for n in range(100, 298)]
    source.tasks = [task(1, urgent_at=AT + 90 * S, urgent="timeout"), task(2), *waiting]

    async def look(room: Room) -> None:
        assert room.shows("193 more wait")
        assert room.shows("PickUp-104")
        assert not room.shows("PickUp-105")
        await room.press("end")
        assert room.app.pane.selection.id == "PickUp-104"
        await room.press("p")
        await room.poll()
        assert not room.shows("more wait")
        await room.press("end")
        await room.poll()
        assert room.shows("PickUp-297")
        await room.press("p")
        await room.poll()
        assert room.shows("193 more wait")
        assert room.shows("PickUp-1 ")

    watching(look, source)


def test_a_few_that_wait_and_those_that_are_found_are_all_shown() -> None:
    source = FakeSource()
    source.tasks = [task(1), *(task(n, status="PENDING", agents=()) for n in range(2, 9))]

    async def look(room: Room) -> None:
        assert not room.shows("more wait")
        source.tasks += [task(n, status="PENDING", agents=()) for n in range(20, 40)]
        await room.poll()
        assert room.shows("22 more wait")
        await room.press("slash", "P", "i", "enter")
        await room.poll()
        assert not room.shows("more wait")
        assert room.app.pane.total == 28

    watching(look, source)
