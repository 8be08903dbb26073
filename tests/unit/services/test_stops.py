"""What people read after an order: who got it, who did not and why, what happens now, what they must do next."""

from collections.abc import Iterator
from typing import Any

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.engine.kernel.causes import HoldCause, LockdownHold, OperatorHold, ResumeHold, TakeOverHold
from formiga_bt.engine.kernel.changes import AgentPut, DeadlineSet, GoalPut, LockdownPut, OrderPut, TaskPut
from formiga_bt.engine.kernel.inputs import LockdownOrder, Operator
from formiga_bt.engine.kernel.records import Deadline, GoalRecord, Lockdown, SystemOrder, TaskFamily, TaskHold
from formiga_bt.engine.kernel.timers import OrderDue
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.transport.messages import PreflightCheck
from tests.golden import Wording
from tests.unit.services.fakes import NOW, Paper, machine, order, raised, task


@pytest.fixture
def paper() -> Iterator[Paper]:
    made = Paper()
    made.put(AgentPut(machine("hwd_1")), TaskPut(task("PickUp-3", "hwd_1")))
    yield made
    made.view.stop()


INTERRUPTED = GoalRecord(
    id="g", agent="hwd_1", action="GoTo", task="PickUp-3", section="steps", state="interrupted", code="taken_over"
)


def held(*causes: HoldCause) -> TaskPut:
    return TaskPut(task("PickUp-3", "hwd_1", hold=TaskHold(causes=causes)))


# -- stops -----------------------------------------------------------------------------------------------------------------
def test_a_hold_tells_how_long_the_machine_hovers_and_what_to_say_then(paper: Paper, wording: Wording) -> None:
    deadline = DeadlineSet(OrderDue("hwd_1"), Deadline(NOW + 660 * SECOND, 1))
    paper.then(OrderPut("hwd_1", order("hwd_1", "hold")), held(OperatorHold("hwd_1")), deadline)

    reply = paper.stops.agent("hwd_1", "hold", "eve")

    assert paper.asked == [Operator("hold", "hwd_1", "eve")]
    wording(reply.text, [one.text for one in reply.ordered])
    assert reply.next == ("formiga continue PickUp-3", "formiga abort PickUp-3")
    assert (reply.stands_already, reply.skipped) == (False, ())


def test_the_same_order_again_stands_already(paper: Paper, wording: Wording) -> None:
    paper.put(OrderPut("hwd_1", order("hwd_1", "hold")), held(OperatorHold("hwd_1")))

    reply = paper.stops.agent("hwd_1", "hold", "adam")

    assert reply.stands_already
    wording(reply.text)
    assert len(reply.ordered) == 1


@pytest.mark.parametrize("landed", ["airborne", "grounded"])
def test_an_order_to_a_machine_that_is_not_heard_of_is_not_told_as_done(
    paper: Paper, landed: str, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("time.clock_gettime_ns", lambda _: 12_000_000_000)
    silent = machine("hwd_1", liveness="SUSPECT", heard_wall=7 * SECOND, landed=landed)
    paper.then(AgentPut(silent), OrderPut("hwd_1", order("hwd_1", "hold")), held(OperatorHold("hwd_1")))

    reply = paper.stops.agent("hwd_1", "hold", "eve")

    wording(reply.text)
    assert reply.ordered == ()
    assert [(one.code, one.may_be_airborne) for one in reply.skipped] == [("suspect", landed == "airborne")]
    wording([one.text for one in reply.skipped])


@pytest.mark.parametrize(
    ("stop", "landed", "was"),
    [
        ("hold", "grounded", "stood on the ground; nothing is sent to it"),
        ("return", "grounded", "stood on the ground; nothing is sent to it"),
        ("hold", "airborne", "hovered; it returns by itself before its reserve is reached"),
    ],
)
def test_an_order_for_which_nothing_is_sent_tells_that_its_machine_is_silent(
    paper: Paper, stop: Any, landed: str, was: str, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("time.clock_gettime_ns", lambda _: 12_000_000_000)
    silent = machine("hwd_1", liveness="SUSPECT", heard_wall=6 * SECOND, landed=landed)
    paper.then(AgentPut(silent), OrderPut("hwd_1", order("hwd_1", stop, state="done")))
    told = f"hwd_1 has not been heard of for 6 s; when it was, it {was}"

    reply = paper.stops.agent("hwd_1", stop, "eve")

    assert reply.ordered == ()
    wording(reply.text)
    assert [(one.code, one.text, one.may_be_airborne) for one in reply.skipped] == [
        ("suspect", told, landed == "airborne")
    ]
    paper.then()

    again = paper.stops.agent("hwd_1", stop, "eve")  # it was heard of when it got it, or it is told as above

    assert (again.stands_already, [one.text for one in again.ordered]) == (True, [told])


@pytest.mark.parametrize(
    ("stop", "machine_is", "order_is", "text"),
    [
        ("return", {}, {}, "hwd_1 flies home to p3"),
        ("return", {"landed": "grounded"}, {"state": "done"}, "hwd_1 stands on the ground; nothing is sent to it"),
        ("return", {"landed": "grounded"}, {}, "hwd_1 is about to start for its port"),
        ("return", {}, {"task": "PickUp-3"}, "hwd_1 is on its way home with PickUp-3"),
        ("return", {}, {"state": "failed"}, "hwd_1 did not carry out `return`: look at it"),
        ("land", {}, {}, "hwd_1 lands where it is"),
        ("hold", {}, {}, "hwd_1 hovers; it returns by itself before its reserve is reached"),
        ("cut", {}, {}, "hwd_1: its motors are ordered to stop; in the air it falls"),
        ("cut", {"landed": "grounded"}, {"state": "done"}, "hwd_1: its motors are off"),
        (
            "hold", {"control": "pilot", "taken": True}, {},
            "hwd_1 is in the hands of its pilot; `hold` stands for when its pilot has given it back",
        ),
        (
            "land", {"taken": True}, {},
            "hwd_1 was taken over and nobody has handed it back yet; `land` stands for when that is done",
        ),
    ],
)  # fmt: skip
def test_an_order_tells_what_its_machine_does(
    paper: Paper, stop: str, machine_is: dict[str, object], order_is: dict[str, object], text: str
) -> None:
    paper.then(AgentPut(machine("hwd_1", **machine_is)), OrderPut("hwd_1", order("hwd_1", stop, **order_is)))

    reply = paper.stops.agent("hwd_1", stop, "eve", confirmed="hwd_1")  # type: ignore[arg-type]

    assert [one.text for one in reply.ordered] == [text]


def test_a_stop_of_a_task_tells_of_the_machines_of_those_that_it_requested(paper: Paper, wording: Wording) -> None:
    paper.put(
        TaskPut(task("Tour-1", family=TaskFamily(children=("PickUp-3", "Look-4")))),
        TaskPut(task("PickUp-3", "hwd_1", family=TaskFamily(parent="Tour-1"))),
        TaskPut(task("Look-4", "lwd_1", family=TaskFamily(parent="Tour-1", detached=True))),
        AgentPut(machine("lwd_1", task="Look-4", order=2)),
    )
    paper.then(OrderPut("hwd_1", order("hwd_1", "land", scope="task")))

    reply = paper.stops.task("Tour-1", "land", "eve")

    wording(reply.text, [one.text for one in reply.ordered])


def test_an_order_carried_out_by_a_system_task_names_it(paper: Paper, wording: Wording) -> None:
    own = TaskPut(task("Return-4", system=SystemOrder(agent="hwd_1", stop="return")))
    paper.then(own, OrderPut("hwd_1", order("hwd_1", "return", task="Return-4")))

    wording(paper.stops.agent("hwd_1", "return").ordered[0].text)


def test_a_stop_of_all_names_who_did_not_get_it_and_why(paper: Paper, wording: Wording) -> None:
    paper.put(
        AgentPut(machine("hwd_2", liveness="LOST", pool="QUARANTINED", task="", order=2)),
        AgentPut(machine("lwd_1", landed="grounded", task="", pool="STANDBY", order=3)),
        AgentPut(machine("lwd_2", control="pilot", order=4)),
        AgentPut(machine("picker_1", mobility="people", order=5)),
    )
    paper.then(OrderPut("hwd_1", order("hwd_1", "land", scope="all")))

    reply = paper.stops.all("land", "eve")

    assert paper.asked == [Operator("land", "", "eve")]
    wording(reply.text, [one.text for one in reply.ordered])
    assert [(one.who, one.code, one.may_be_airborne) for one in reply.skipped] == [
        ("hwd_2", "agent_lost", True),
        ("lwd_2", "not_in_command", True),
    ]
    wording(reply.skipped[0].text, reply.skipped[1].hint)
    assert reply.next == ("formiga agents", "formiga tasks")  # what lands cannot be continued yet


def test_a_stop_never_takes_a_cut_back(paper: Paper, wording: Wording) -> None:
    paper.put(OrderPut("hwd_1", order("hwd_1", "cut")))

    (skipped,) = paper.stops.all("hold").skipped

    assert skipped.code == "ordered"
    wording(skipped.text)


def test_a_hold_without_the_charge_for_it_is_a_return_and_says_so(paper: Paper, wording: Wording) -> None:
    paper.then(OrderPut("hwd_1", order("hwd_1", "return")))

    reply = paper.stops.agent("hwd_1", "hold")

    wording([one.text for one in reply.ordered])
    assert reply.skipped == ()


def test_a_stop_of_a_task_goes_to_its_machines_only(paper: Paper) -> None:
    paper.put(AgentPut(machine("hwd_2", task="PickUp-4")))
    paper.then(OrderPut("hwd_1", order("hwd_1", "return", scope="task")), held(OperatorHold()))

    reply = paper.stops.task("PickUp-3", "return")

    assert [one.who for one in reply.ordered] == ["hwd_1"]
    assert reply.next == ("formiga why PickUp-3", "formiga abort PickUp-3")  # on its way, `continue` would be refused


@pytest.mark.parametrize("confirmed", ["", "yes", "hwd_2", "HWD_1"])
def test_a_cut_must_repeat_the_machines_name(paper: Paper, confirmed: str, wording: Wording) -> None:
    refused = raised(lambda: paper.stops.agent("hwd_1", "cut", "eve", confirmed))

    assert refused.code == "not_confirmed"
    wording(refused.text)
    assert '"confirmed": "hwd_1"' in refused.help
    assert paper.asked == []


def test_orders_for_what_is_not_there_do_not_reach_the_engine(paper: Paper, wording: Wording) -> None:
    assert raised(lambda: paper.stops.agent("hwd_9", "hold")).code == "unknown_agent"
    wrong = raised(lambda: paper.stops.task("hwd_1", "hold"))
    assert (wrong.code, wrong.help) == ("unknown_task", "formiga hold hwd_1")
    wording(wrong.text)
    assert paper.asked == []


@pytest.mark.parametrize(
    ("code", "hint"),
    [
        ("cannot_continue", ""),  # its text names the task, and the commands
        ("not_started", "formiga abort PickUp-3"),
        ("order_under_way", "let it come to its end, or: formiga hold PickUp-3"),
        ("lockdown", "formiga lockdown release"),
        ("human", "speak to them"),
        ("not_held", "formiga tasks shows what is held"),
    ],
)
def test_each_refusal_says_what_helps(paper: Paper, code: str, hint: str) -> None:
    paper.refuse(code)
    refused = raised(lambda: paper.stops.task("PickUp-3", "continue"))
    assert (refused.code, refused.help) == (code, hint)


# -- going on ----------------------------------------------------------------------------------------------------------------
def test_continue_tells_what_goes_on(paper: Paper, wording: Wording) -> None:
    paper.put(OrderPut("hwd_1", order("hwd_1", "hold", scope="task")), held(OperatorHold()))
    paper.then(OrderPut("hwd_1", None), held())

    reply = paper.stops.task("PickUp-3", "continue")

    wording(reply.text)
    assert reply.next == ("formiga tasks",)


def test_continue_of_one_cause_tells_the_others(paper: Paper, wording: Wording) -> None:
    paper.put(OrderPut("hwd_1", order("hwd_1", "hold")), held(OperatorHold("hwd_1"), TakeOverHold("hwd_2")))
    paper.then(OrderPut("hwd_1", None), held(TakeOverHold("hwd_2")))

    (left,) = paper.stops.agent("hwd_1", "continue").skipped

    assert left.hint == "formiga why PickUp-3"
    wording(left.text)


def test_continue_of_all_names_the_tasks_that_it_passed_over(paper: Paper) -> None:
    paper.put(held(OperatorHold()))

    reply = paper.stops.all("continue")

    assert reply.text == "nothing goes on"
    assert [(one.who, one.code) for one in reply.skipped] == [("PickUp-3", "cannot_continue")]
    assert reply.next == ("formiga why PickUp-3",)


def test_continue_of_all_tells_a_task_that_ended_at_once(paper: Paper, wording: Wording) -> None:
    paper.put(held(ResumeHold()))
    paper.then(TaskPut(task("PickUp-3", "hwd_1", section="done", status="SUCCEEDED")))

    wording(paper.stops.all("continue").text)


def test_continue_of_all_names_the_way_home_that_it_does_not_end(paper: Paper, wording: Wording) -> None:
    paper.put(OrderPut("hwd_1", order("hwd_1", "return", state="open")))

    reply = paper.stops.all("continue")

    (kept,) = reply.skipped
    assert (kept.who, kept.code) == ("hwd_1", "order_under_way")
    wording(kept.text)
    assert reply.next == ("formiga tasks",)


def test_continue_of_all_says_that_nothing_was_stopped(paper: Paper, wording: Wording) -> None:
    reply = paper.stops.all("continue")

    wording(reply.text)
    assert (reply.ordered, reply.skipped, reply.next) == ((), (), ("formiga tasks",))


def test_a_restart_says_that_the_task_begins_anew(paper: Paper, wording: Wording) -> None:
    reply = paper.stops.task("PickUp-3", "restart", "eve")
    assert paper.asked == [Operator("restart", "PickUp-3", "eve")]
    wording(reply.text)
    assert reply.skipped == ()


def test_a_restart_tells_of_a_machine_that_was_ordered_by_itself(paper: Paper, wording: Wording) -> None:
    paper.put(AgentPut(machine("hwd_1", landed="grounded")), OrderPut("hwd_1", order("hwd_1", "return", state="done")))

    (kept,) = paper.stops.task("PickUp-3", "restart", "eve").skipped

    wording(kept.text)
    assert kept.may_be_airborne is False
    wording(kept.hint)


def test_continue_of_all_tells_why_a_task_stays_held(paper: Paper, wording: Wording) -> None:
    paper.put(AgentPut(machine("hwd_1", taken=True)), held(OperatorHold(), TakeOverHold("hwd_1")))

    (left,) = paper.stops.all("continue").skipped

    wording(left.text, left.hint)


def test_after_a_release_what_cannot_go_on_is_not_proposed_to(paper: Paper, wording: Wording) -> None:
    paper.stops._catalogue = packaged_world()[1]
    goal = GoalRecord(
        id="g", agent="hwd_1", action="GoTo", task="PickUp-3", section="steps", state="interrupted", code="stopped"
    )
    paper.put(LockdownPut(Lockdown("return", "eve", NOW)), held(LockdownHold()), GoalPut(goal))
    paper.then(LockdownPut(None), held(OperatorHold()), AgentPut(machine("hwd_1", landed="grounded")))

    reply = paper.stops.lockdown("release", "eve")

    wording(reply.skipped[0].text)
    assert reply.next == ("formiga restart PickUp-3", "formiga abort PickUp-3")


# -- lockdown ----------------------------------------------------------------------------------------------------------------
def test_lockdown_tells_of_each_machine_in_the_air(paper: Paper, wording: Wording) -> None:
    paper.put(
        AgentPut(machine("lwd_1", landed="grounded", task="", order=2)),
        AgentPut(machine("lwd_2", control="pilot", task="", order=3)),
        AgentPut(machine("lwd_3", task="PickUp-5", order=4)),
        TaskPut(task("PickUp-5", "lwd_3", section="recover")),
    )
    paper.then(
        LockdownPut(Lockdown("return", "eve", NOW)), OrderPut("hwd_1", order("hwd_1", "return", scope="lockdown"))
    )

    reply = paper.stops.lockdown("return", "eve")

    assert paper.asked == [LockdownOrder("return", "eve")]
    wording(reply.text, [one.text for one in reply.ordered], [one.text for one in reply.skipped])
    assert reply.next == ("formiga lockdown release",)
    shown = paper.stops.lockdown_now()
    assert (shown.on, shown.how, shown.by) == (True, "return", "eve")
    wording(shown.text)


def test_the_same_lockdown_again_stands_already(paper: Paper) -> None:
    paper.put(LockdownPut(Lockdown("hold", "eve", NOW)))
    again = paper.stops.lockdown("hold", "adam")
    assert (again.stands_already, again.text) == (True, "lockdown stands already")
    assert not paper.stops.lockdown("land").stands_already


def test_a_second_lockdown_lists_all_machines_under_its_order_also_those_that_stand(
    paper: Paper, wording: Wording
) -> None:
    stands = machine("hwd_1", landed="grounded")
    paper.put(LockdownPut(Lockdown("return", "eve", NOW)), AgentPut(stands))
    paper.put(OrderPut("hwd_1", order("hwd_1", "return", scope="lockdown", state="done")))

    reply = paper.stops.lockdown("return", "adam")

    wording([one.text for one in reply.ordered])


def test_a_release_names_the_tasks_that_wait_for_a_word(paper: Paper, wording: Wording) -> None:
    paper.put(LockdownPut(Lockdown("return", "eve", NOW)), held(LockdownHold()))
    paper.then(LockdownPut(None), held(OperatorHold()))

    reply = paper.stops.lockdown("release", "eve")

    wording(reply.text, [one.text for one in reply.skipped])
    assert reply.next == ("formiga continue --all", "formiga abort PickUp-3")
    assert not paper.stops.lockdown_now().on


def test_a_release_without_lockdown_is_no_error(paper: Paper) -> None:
    reply = paper.stops.lockdown("release")
    assert (reply.stands_already, reply.text) == (True, "no lockdown stands")
    assert paper.asked == []


# -- hand-back ---------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("how", "held_by", "text", "following"),
    [
        ("continue", (), "hwd_1 is the engine's again; PickUp-3 goes on", "formiga agents"),
        ("end", (), "hwd_1 is the engine's again; its interrupted step fails (taken_over)", "formiga agents"),
        (
            "end", (ResumeHold(),),
            "hwd_1 is the engine's again; its interrupted step fails (taken_over), and PickUp-3 waits for your word",
            "formiga continue PickUp-3",
        ),
        (
            "return", (OperatorHold("hwd_1"),),
            "hwd_1 is the engine's again; it flies to its port, then PickUp-3 waits for your word",
            "formiga continue PickUp-3",
        ),
    ],
)  # fmt: skip
def test_a_handback_says_what_becomes_of_the_task(
    paper: Paper, how: str, held_by: tuple[HoldCause, ...], text: str, following: str
) -> None:
    paper.put(AgentPut(machine("hwd_1", taken=True)), held(TakeOverHold("hwd_1")), GoalPut(INTERRUPTED))
    paper.then(AgentPut(machine("hwd_1")), held(*held_by))

    reply = paper.stops.hand_back("hwd_1", how, "eve")

    assert paper.asked == [Operator(f"handback_{how}", "hwd_1", "eve")]  # type: ignore[arg-type]
    assert (reply.text, reply.next[0]) == (text, following)


@pytest.mark.parametrize(
    ("held_by", "following"),
    [
        ((), ["formiga abort PickUp-3"]),
        (("resume",), ["formiga abort PickUp-3", "formiga continue PickUp-3"]),
    ],
)
def test_a_handback_that_ends_nothing_says_so_and_how_to_end_the_task(
    paper: Paper, held_by: tuple[HoldCause, ...], following: list[str], wording: Wording
) -> None:
    home = GoalRecord(id="h", agent="hwd_1", action="LandIn", task="PickUp-3", section="recover", state="interrupted")
    paper.put(AgentPut(machine("hwd_1", taken=True)), held(TakeOverHold("hwd_1"), *held_by), GoalPut(home))
    paper.then(AgentPut(machine("hwd_1")), held(*held_by))

    reply = paper.stops.hand_back("hwd_1", "end", "eve")

    wording(reply.text)
    assert list(reply.next) == following


def test_a_handback_does_not_promise_what_an_order_forbids(paper: Paper, wording: Wording) -> None:
    paper.put(AgentPut(machine("hwd_1", taken=True)), held(OperatorHold("hwd_1"), TakeOverHold("hwd_1")))
    paper.then(AgentPut(machine("hwd_1")), held(OperatorHold("hwd_1")), OrderPut("hwd_1", order("hwd_1", "hold")))

    reply = paper.stops.hand_back("hwd_1", "continue", "eve")

    wording(reply.text)


# -- preflight ---------------------------------------------------------------------------------------------------------------
def test_preflight_lists_the_checks_and_what_is_wrong(paper: Paper, wording: Wording) -> None:
    checks = (PreflightCheck("armable", True), PreflightCheck("gnss", False, "4 satellites"))
    paper.put(
        AgentPut(machine("hwd_1", landed="grounded", checks=checks)), AgentPut(machine("picker_1", mobility="people"))
    )

    found = paper.stops.preflight("hwd_1")

    assert (found.ok, found.required) == (False, False)
    wording(found.text)
    assert [(one.check, one.ok) for one in found.checks] == [("armable", True), ("gnss", False)]
    assert raised(lambda: paper.stops.preflight("picker_1")).code == "human"
    assert raised(lambda: paper.stops.preflight("nobody")).code == "unknown_agent"


def test_one_in_the_air_was_looked_at_before(paper: Paper, wording: Wording) -> None:
    paper.put(AgentPut(machine("hwd_1", checks=(PreflightCheck("armable", True),))))
    found = paper.stops.preflight("hwd_1")
    assert found.airborne is True
    wording(found.text)


def test_a_machine_that_told_nothing_is_not_ready() -> None:
    paper = Paper(preflight=True)
    paper.put(AgentPut(machine("hwd_1")))
    found = paper.stops.preflight("hwd_1")
    assert (found.ok, found.required, found.checks) == (False, True, ())
    paper.view.stop()
