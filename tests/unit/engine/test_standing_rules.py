"""Standing rules at work: what happens to an agent has one outcome, whatever the engine or its fixes do meanwhile."""

from pathlib import Path

import pytest

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import (
    AgentEventInput,
    Alarm,
    Approve,
    EngineStep,
    JournalState,
    LockdownOrder,
    Resumed,
    RuleOrder,
    TimerDue,
)
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.engine.kernel.timers import RuleDue
from formiga_bt.engine.rules.borders import BAND_M
from formiga_bt.engine.rules.starting import MOST_STARTS
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.testing import alarms, effects
from formiga_bt.safety.approval import RULES, approval_digest, rules_digest
from formiga_bt.transport.messages import AgentEvent
from tests.reloading import reloaded
from tests.unit.engine.ruled import HELP, LEFT, REAL, SOS, Ruled

NOW = LEFT.replace("    for: 10 s\n", "")
ENTERS = NOW.replace("leaves", "enters").replace("left:", "came:")
CROSSES = NOW.replace("leaves(picker, regions.square)", "crosses(picker, fence)").replace("left:", "fence:")
SILENT = "quiet: {on: silent(picker), for: 60 s, request: Help, with: {who: '${event.agent}'}}"
MOVE = """\
formiga: 1
task: Fetch
params: {who: {type: agent, of: [drone]}}
agents: {drone: {type: drone, id: '${who}'}}
steps: [{wait: 5 min}]
"""


# -- events ------------------------------------------------------------------------------------------------------------
def test_an_event_requests_its_task_with_what_it_says(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.press()

    (task,) = bench.tasks_of("sos")
    assert task.request.by == "rule:sos"
    assert task.request.params == {"who": AgentRef("picker_1"), "spot": Place(50.0, 50.0)}
    assert (task.request.cause.agent, task.request.cause.what) == ("picker_1", "sos")
    bench.run_until_ended()
    assert bench.task(task.id).status == "SUCCEEDED"
    bench.check()


def test_one_event_starts_one_task_however_often_it_is_told(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    for _ in range(3):
        bench.press(n=7)
    assert bench.outcomes("sos") == ["started"]


def test_while_its_task_runs_the_next_event_starts_none_and_after_it_one(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.agent("picker_2", "picker", at=Place(10.0, 10.0))
    bench.press()
    bench.press()
    bench.press("picker_2")
    assert bench.outcomes("sos") == ["started", "running", "started"]
    assert bench.rule("sos").last[1].task == bench.rule("sos").last[0].task

    bench.run_until_ended()
    bench.press()
    assert bench.outcomes("sos")[-1] == "started"


def test_at_most_may_count_for_all_agents_together(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS.replace("request:", "at_most: 1 running, request:"))
    bench.agent("picker_2", "picker", at=Place(10.0, 10.0))
    bench.press()
    bench.press("picker_2")
    assert bench.outcomes("sos") == ["started", "running"]


def test_a_rule_of_some_agents_is_of_no_other(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS.replace("request:", "of: [picker_2], request:"))
    bench.press()
    assert bench.outcomes("sos") == []


def test_an_event_that_a_rule_is_on_was_heard(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    for _ in range(250):
        bench.press()
    assert "events_unheard" not in alarms(bench)


# -- borders -----------------------------------------------------------------------------------------------------------
def test_who_leaves_is_gone_only_after_the_time_of_for(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT)
    bench.walk(100 + BAND_M + 1)
    bench.run_for(9)
    assert bench.outcomes("left") == []
    bench.run_for(2)

    assert bench.outcomes("left") == ["started"]
    (task,) = bench.tasks_of("left")
    assert task.request.params["spot"] == Place(100 + BAND_M + 1, 50.0)


def test_who_is_back_in_time_has_not_left(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT)
    bench.walk(120)
    bench.run_for(5)
    bench.walk(99)
    bench.run_for(60)
    assert bench.outcomes("left") == []
    assert not [due for due in bench.engine.state.deadlines if isinstance(due, RuleDue)]


def test_the_band_beyond_a_border_is_neither_side(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, NOW)
    for east in (100, 105, 100 + BAND_M - 0.1, 99, 104):
        bench.walk(east)
    assert bench.outcomes("left") == []
    bench.walk(100 + BAND_M + 0.1)
    for east in (105, 112, 101, 130):  # not inside again: it has left once
        bench.walk(east)
    assert bench.outcomes("left") == ["started"]
    bench.walk(100)
    bench.walk(130)
    assert bench.outcomes("left") == ["started", "running"]


def test_who_begins_outside_has_not_left_and_may_enter(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, NOW, ENTERS)
    other = bench.agent("picker_2", "picker", at=Place(300.0, 300.0))
    bench.run_for(2)
    assert (bench.outcomes("left"), bench.outcomes("came")) == ([], [])
    bench.walk(50, who=other)
    assert (bench.outcomes("left"), bench.outcomes("came")) == ([], ["started"])


def test_a_fence_is_crossed_both_ways(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, CROSSES)
    bench.walk(700)
    bench.run_until_ended()
    bench.walk(500)
    assert bench.outcomes("fence") == ["started", "started"]


def test_a_late_position_says_nothing(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, NOW)
    bench.picker.silent = True
    bench.picker.tell(position=Position(200.0, 50.0, 0.0), stamp=bench.now - 61_000_000)
    bench.run_for(1)
    assert bench.record("picker_1").position == Position(200.0, 50.0, 0.0)
    assert bench.outcomes("left") == []
    for _ in range(2):  # the first has the number of the status before
        bench.walk(200)
    assert bench.outcomes("left") == ["started"]


def test_a_missing_position_says_nothing(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, NOW)
    bench.picker.silent = True
    bench.picker.tell(position=None)
    bench.run_for(1)
    bench.picker.tell(seq=10_000, position=Position(50.0, 50.0, 0.0))
    bench.run_for(1)
    assert bench.outcomes("left") == []


def test_who_falls_silent_outside_has_left_when_they_are_seen_there_again(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT.replace("10 s", "90 s"))
    bench.walk(150)
    bench.picker.silent = True
    bench.run_for(120)
    assert bench.outcomes("left") == [], "the position was too old when the time was over"
    bench.picker.silent = False
    bench.walk(151)
    assert bench.outcomes("left") == ["started"]


def test_machines_pass_borders_too(tmp_path: Path) -> None:
    rule = "away: {on: 'leaves(drone, regions.square)', request: Help, with: {who: '${event.agent}'}}"
    bench = Ruled(tmp_path, rule)
    drone = bench.agent("lwd_1", "lwd", at=Place(90.0, 40.0))
    bench.run_for(1)
    drone.say(position=Position(112.0, 40.0, 0.0))
    bench.run_for(1)
    assert bench.outcomes("away") == ["started"]


# -- silence -----------------------------------------------------------------------------------------------------------
def test_silence_is_noted_once_and_anew_after_a_word(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SILENT)
    bench.run_for(200)
    assert bench.outcomes("quiet") == []
    for _ in range(2):
        bench.picker.silent = True
        bench.run_for(300)
        bench.picker.silent = False
        bench.run_for(5)
    assert bench.outcomes("quiet") == ["started", "started"]


# -- what cannot start -------------------------------------------------------------------------------------------------
def test_in_lockdown_it_waits_for_a_person(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("return", "ann"))
    bench.press()
    bench.press()
    assert bench.outcomes("sos") == ["waits", "waits"]
    assert alarms(bench).count("rule_waits") == 2
    with pytest.raises(TaskError, match="locked down"):
        bench.ask(RuleOrder("sos", "start", by="ann"))

    bench.ask(LockdownOrder("release", "ann"))
    bench.run_for(10)
    assert not bench.tasks_of("sos"), "a person decides"
    assert bench.rule("sos").waits["picker_1"].times == 2
    bench.picker.say(position=Position(60.0, 50.0, 0.0))
    bench.run_for(1)
    reply = bench.ask(RuleOrder("sos", "start", by="ann"))

    assert isinstance(reply, Accepted)
    task = bench.task(reply.task)
    assert task.request.cause is not None
    assert (task.request.by, task.request.cause.by) == ("rule:sos", "ann")
    assert task.request.params["spot"] == Place(60.0, 50.0)
    assert not bench.rule("sos").waits
    with pytest.raises(TaskError) as caught:
        bench.ask(RuleOrder("sos", "start", by="ann"))
    assert caught.value.code == "not_waiting"


def test_what_waits_can_be_dismissed(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("return", "ann"))
    bench.press()
    bench.ask(RuleOrder("sos", "dismiss", "picker_1", by="ann"))
    assert not bench.rule("sos").waits
    assert bench.rule("sos").last[-1].by == "ann"
    with pytest.raises(TaskError) as caught:
        bench.ask(RuleOrder("other", "dismiss"))
    assert caught.value.code == "unknown_rule"


def test_what_is_not_known_yet_waits_for_a_person(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.picker.silent = True
    bench.picker.tell(position=None)
    bench.run_for(1)
    bench.press()
    assert bench.rule("sos").last[-1].code == "unknown_state"
    assert alarms(bench) == ["rule_waits"]


def test_nothing_starts_while_the_journal_is_full(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(JournalState("full"))
    bench.press()
    assert bench.rule("sos").last[-1].code == "journal_full"


def test_in_mode_real_rules_and_task_are_approved(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS, mode=REAL)
    model = bench.engine.core.models["Help"]
    bench.press()
    assert "formiga approve rules" in bench.rule("sos").waits["picker_1"].text
    bench.ask(Approve(rules_digest(bench.site), RULES, "ann"))
    bench.press()
    assert "formiga approve Help" in bench.rule("sos").waits["picker_1"].text
    bench.ask(Approve(approval_digest(model, bench.site), "Help", "ann"))
    assert not bench.tasks_of("sos"), "what waited, waits"
    bench.press()
    assert bench.outcomes("sos") == ["waits", "waits", "started"]
    assert not bench.rule("sos").waits


def test_who_approved_the_rules_is_no_other_person_than_the_requester(tmp_path: Path) -> None:
    away = """\
formiga: 1
task: Away
agents: {drone: {type: lwd}}
steps:
  - do: drone.TakeOff
  - do: drone.LandIn
    with: {at: camp}
"""
    bench = Ruled(tmp_path, "sos: {on: picker.sos, request: Away}", tasks=(away,), mode=REAL)
    model = bench.engine.core.models["Away"]
    bench.ask(Approve(rules_digest(bench.site), RULES, "ann"))
    bench.ask(Approve(approval_digest(model, bench.site), "Away", "ann"))
    bench.press()
    assert "another person" in bench.rule("sos").waits["picker_1"].text
    bench.ask(Approve(approval_digest(model, bench.site), "Away", "bob"))
    bench.press()
    assert bench.outcomes("sos") == ["waits", "started"]


def test_approval_of_rules_is_void_when_a_rule_changes(tmp_path: Path) -> None:
    one = Ruled(tmp_path / "a", SOS).site
    same = Ruled(tmp_path / "b", SOS.replace("{on: picker.sos, request: Help", "{request: Help,   on: picker.sos")).site
    other = Ruled(tmp_path / "c", SOS.replace("request:", "priority: high, request:")).site
    assert one.rules_digest == same.rules_digest != other.rules_digest


# -- rules that lead to themselves -------------------------------------------------------------------------------------
def test_a_rule_does_not_request_itself_by_the_machine_that_it_moves(tmp_path: Path) -> None:
    rule = "away: {on: 'crosses(drone, regions.square)', at_most: 5 running, request: Fetch, with: {who: '${event.agent}'}}"
    bench = Ruled(tmp_path, rule, tasks=(MOVE,))
    drone = bench.agent("hwd_1", "hwd", at=Place(-14.0, 40.0))
    bench.run_for(1)
    for east in (15.0, -14.0, 15.0):  # its port lies inside
        drone.say(position=Position(east, 40.0, 0.0))
        bench.run_for(2)
    assert bench.outcomes("away")[:3] == ["started", "own", "own"]


def test_a_rule_in_haste_waits_for_a_person(tmp_path: Path) -> None:
    quick = HELP.replace("  - wait: 30 s\n", "")
    bench = Ruled(tmp_path, SOS, tasks=(quick,))
    for _ in range(MOST_STARTS + 1):
        bench.press()
        bench.run_for(2)
    assert bench.outcomes("sos") == ["started"] * MOST_STARTS + ["waits"]
    assert bench.rule("sos").last[-1].code == "rule_in_haste"
    bench.run_for(60)
    bench.press()
    assert bench.outcomes("sos")[-1] == "started"


# -- a restart in the middle -------------------------------------------------------------------------------------------
def again(bench: Ruled, downtime_s: float, site: object = None) -> tuple[Engine, int]:
    """Return an engine that goes on from what was kept, after so long, and its time."""
    old = bench.engine
    state = reloaded(old.state)
    engine = Engine(site or bench.site, bench.catalogue, dict(old.core.models), state=state, resumes=True)  # type: ignore[arg-type]
    now = bench.now + round(downtime_s * 1e6)
    engine.handle(now, Resumed(epoch=2, at=bench.now, since=bench.now, wall=now))
    return engine, now


def drive(engine: Engine, until: int) -> list[EngineStep]:
    """Give all deadlines up to an instant, and end the time in which agents are asked."""
    steps = []
    while (due := engine.next_deadline()) is not None and due[0] <= until:
        steps.append(engine.handle(max(due[0], engine.state.now), TimerDue(due[1])))
    return steps


def told(engine: Engine, name: str) -> list[str]:
    return [one.outcome for one in engine.state.rules[name].last]


def test_a_pending_for_and_the_running_tasks_outlive_the_engine(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT, SOS)
    bench.press()
    bench.walk(150)
    bench.run_for(2)
    engine, now = again(bench, 1)
    assert RuleDue("left", "picker_1") in engine.state.deadlines
    engine.handle(now, AgentEventInput(AgentEvent(agent="picker_1", event="sos", boot_id="b", n=1)))
    assert told(engine, "sos") == ["started"], "the same event once more"
    engine.handle(now, AgentEventInput(AgentEvent(agent="picker_1", event="sos", boot_id="b", n=2)))
    assert told(engine, "sos") == ["started", "running"]


def test_what_waits_for_a_person_outlives_the_engine(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT)
    bench.ask(LockdownOrder("return", "ann"))
    bench.walk(150)
    bench.run_for(11)
    engine, now = again(bench, 1)
    engine.handle(now, LockdownOrder("release", "ann"))
    reply = engine.handle(now, RuleOrder("left", "start", by="ann")).reply
    assert isinstance(reply, Accepted)
    assert engine.state.tasks[reply.task].request.params["spot"] == Place(150.0, 50.0)


def test_a_rule_that_watches_something_else_forgets_what_it_saw(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, LEFT, SOS)
    bench.walk(150)
    other = Ruled(tmp_path / "other", LEFT.replace("10 s", "20 s")).site
    engine, _ = again(bench, 1, other)
    assert not engine.state.rule_watches["left"]
    assert "sos" not in engine.state.rules
    assert not [due for due in engine.state.deadlines if isinstance(due, RuleDue)]


def test_alarms_name_the_agent(tmp_path: Path) -> None:
    bench = Ruled(tmp_path, SOS)
    bench.ask(LockdownOrder("return", "ann"))
    bench.press()
    assert [one.agent for one in effects(bench, Alarm) if one.code == "rule_waits"] == ["picker_1"]
