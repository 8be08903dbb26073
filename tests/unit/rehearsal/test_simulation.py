"""Scenarios in virtual time: what they ship with ends as it says, faults come on time, equal seeds give equal runs."""

from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

from agents_sim.referee import Verdict
from agents_sim.world import grid_fleet
from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import horizontal_m
from formiga_bt.base.packaged import files, folder
from formiga_bt.engine.kernel.causes import LockdownHold
from formiga_bt.engine.kernel.inputs import Abort, LockdownOrder, NotifyPeople, Operator
from formiga_bt.engine.kernel.records import GoalRecord, TaskHold, TaskRecord, TaskRequest
from formiga_bt.engine.kernel.replies import Accepted
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.scenario import (
    LoadedScenario,
    Scenario,
    ScenarioFault,
    ScenarioOrder,
    load_scenario,
    load_scenario_text,
)
from formiga_bt.rehearsal.simulation import (
    Timetable,
    VirtualRun,
    describe,
    fleet_site,
    order_of,
    specs_of,
    waiting_for_people,
)
from formiga_bt.services.demo import ScenarioDemo
from formiga_bt.show.history.runlog import RunLog
from tests.golden import Wording


def shipped(name: str) -> Scenario:
    catalogue, _, _ = load_catalogue(files("actions"))
    loaded = load_scenario(folder("trees") / "scenarios" / f"{name}.yaml", catalogue=catalogue)
    assert loaded.scenario is not None, loaded.diagnostics
    return loaded.scenario


def run(name: str) -> tuple[VirtualRun, dict[str, str], Verdict]:
    virtual = VirtualRun(shipped(name))
    assert virtual.run()
    tasks = virtual.rehearsal.engine.state.tasks
    verdict = virtual.verdict()
    virtual.close()
    return virtual, {task.id: task.status for task in tasks.values()}, verdict


@pytest.mark.parametrize("name", ["demo", "frozen-and-back", "nonsense", "warehouse"])
def test_what_ships_succeeds_without_a_crash(name: str) -> None:
    virtual, statuses, verdict = run(name)
    assert set(statuses.values()) == {"SUCCEEDED"}
    assert len(statuses) == len(virtual.scenario.requests)
    assert not virtual.played.refused
    assert verdict.is_clean


def test_the_one_that_is_killed_is_found_and_brought_home() -> None:
    virtual, statuses, verdict = run("one-killed")
    assert statuses["PickUp-1"] == "FAILED"
    assert statuses["PickUp-2"] == "SUCCEEDED"
    assert [status for task, status in statuses.items() if task.startswith("Recover")] == ["SUCCEEDED"]
    drone = virtual.rehearsal.sim["hwd_1"].drone
    assert not drone.is_airborne
    assert drone.home is not None
    assert horizontal_m(drone.position(), drone.home) < 1.0
    assert verdict.is_clean


def test_faults_come_at_their_time() -> None:
    virtual, _, _ = run("nonsense")
    at = [(round((when - virtual.began) / SECOND, 3), fault.kind) for when, fault in virtual.played.faults]
    assert at == [(2.0, "nan"), (10.0, "nan"), (12.0, "wrong_id"), (20.0, "lose_result")]


def test_equal_seeds_give_equal_runs() -> None:
    first, second = run("demo")[0], run("demo")[0]
    assert first.steps == second.steps


def test_a_fault_in_words(wording: Wording) -> None:
    wording(describe(ScenarioFault(0, "hwd_1", "wrong_id", 2, as_id="x")))
    wording(describe(ScenarioFault(0, "hwd_1", "slow", delay_s=2.0)))


def test_orders_in_words(wording: Wording) -> None:
    assert describe(ScenarioOrder(0, "hold", "hwd_1", "agent", by="watcher_1")) == "watcher_1: hold hwd_1"
    assert describe(ScenarioOrder(0, "return")) == "operator: return all"
    wording(describe(ScenarioOrder(0, "handback", "hwd_1", "agent", "end")))
    assert describe(ScenarioOrder(0, "lockdown", of="site", how="land")) == "operator: lockdown land"
    wording(describe(ScenarioFault(0, "hwd_1", "battery", percent=26.0)))
    wording(describe(ScenarioFault(0, "hwd_1", "link_loss", vanishes=False)))
    wording(describe(ScenarioFault(0, "hwd_1", "link_loss", on=False)))
    assert describe(ScenarioFault(0, "hwd_1", "preflight", check="gnss")) == "hwd_1: preflight gnss"


def a_task(name: str, order: int, section: str = "steps") -> TaskRecord:
    return TaskRecord(id=f"{name}-{order}", name=name, order=order, request=TaskRequest(bundle=""), section=section)  # type: ignore[arg-type]


def test_an_order_for_a_task_is_for_the_newest_open_one_of_that_name(wording: Wording) -> None:
    tasks = {t.id: t for t in (a_task("Go", 1), a_task("Go", 2), a_task("Go", 3, "done"), a_task("Other", 4))}
    assert order_of(ScenarioOrder(0, "hold", "Go", "task", by="ann"), tasks) == Operator("hold", "Go-2", "ann")
    assert order_of(ScenarioOrder(0, "abort", "Go", "task", "now"), tasks) == Abort("Go-2", "now", by="operator")
    with pytest.raises(TaskError) as caught:
        order_of(ScenarioOrder(0, "hold", "Gone", "task"), tasks)
    wording(caught.value)
    assert caught.value.code == "unknown_task"


def test_orders_for_agents_all_and_the_site() -> None:
    assert order_of(ScenarioOrder(0, "handback", "d", "agent", "end", "ann"), {}) == Operator(
        "handback_end", "d", "ann"
    )
    assert order_of(ScenarioOrder(0, "land", by="ann"), {}) == Operator("land", "", "ann")
    assert order_of(ScenarioOrder(0, "lockdown", of="site", how="hold", by="ann"), {}) == LockdownOrder("hold", "ann")


def test_a_refused_order_is_noted_and_told_and_the_scenario_goes_on(wording: Wording) -> None:
    play = shipped("frozen-and-back")
    orders = (ScenarioOrder(5 * SECOND, "handback", "hwd_1", "agent", "continue", "watcher_1"),)
    virtual = VirtualRun(replace(play, orders=orders, faults=()))
    assert virtual.run()
    [(at, _, why)] = virtual.played.orders
    log = RunLog()
    for step in virtual.steps:
        log.feed(step)
    told = [line.text for line in log.lines if line.text.startswith("refused")]
    virtual.close()

    assert round((at - virtual.began) / SECOND) == 5
    assert why.startswith("not_taken_over: ")
    wording(told)
    assert virtual.rehearsal.engine.state.tasks["PickUp-1"].status == "SUCCEEDED"


def test_weather_and_load_reach_the_drones_and_not_the_people() -> None:
    play = shipped("bad-day")
    specs = {spec.id: spec for spec in specs_of(play)}
    assert (specs["hwd_1"].wind, specs["hwd_1"].on_link_loss, specs["hwd_1"].cut) == ((2.0, 1.0), "return", False)
    assert specs["picker_1"].wind == (0.0, 0.0)


def test_a_grid_of_any_size_has_room_for_everyone() -> None:
    specs = grid_fleet(60, 40, 10, 2)
    site = fleet_site(specs)
    assert len({spec.id for spec in specs}) == 112
    ports = [port.at for port in site.ports.values()]
    assert len(ports) == 100
    assert min(horizontal_m(a, b) for i, a in enumerate(ports) for b in ports[:i]) >= 20.0
    assert {agent.home for agent in site.agents.values() if agent.home} == set(site.ports)
    assert site.people["watchers"] == ("watcher_1", "watcher_2")


def test_agents_of_a_scenario_know_the_base_only_if_asked() -> None:
    assert {spec.base for spec in specs_of(shipped("demo"))} == {None}
    assert {spec.base for spec in specs_of(shipped("demo"), with_base=True)} == {(66.5, 25.7)}


def test_while_a_fault_makes_an_agent_silent_for_a_time_a_demo_runs_at_the_scenarios_own_speed() -> None:
    """Silence is wall time: at 20x the lost link of `bad-day` would last 1.3 s, and its orders would fit no more."""
    play = shipped("bad-day")
    demo = ScenarioDemo(play, speed=20.0)
    now = [0]
    demo.driver.now = lambda: now[0]  # type: ignore[method-assign]
    demo.driver.ask = lambda given, timeout_s=10.0: Accepted("A-1")  # type: ignore[method-assign]
    demo.fleet = Deaf()  # type: ignore[assignment]
    demo.begin()
    paces = {}
    for second in range(90):
        now[0] = second * SECOND
        demo.play_due()
        demo.keep_pace()
        paces[second] = demo.driver.speed
    demo.fleet = None
    demo.close()

    assert {second for second, pace in paces.items() if pace == play.speed} == set(range(50, 76))
    assert {second for second, pace in paces.items() if pace == 20.0} == {*range(50), *range(76, 90)}


def test_a_silence_that_nothing_ends_slows_nothing_down() -> None:
    table = Timetable(shipped("one-killed"))
    table.begin(0)
    kills = [one for one in table.due(10**12) if isinstance(one, ScenarioFault) and one.kind == "kill"]
    assert kills
    assert not any(table.silence_ends(one) for one in kills)


def test_what_waits_for_a_word_that_nobody_says_is_told_apart_from_what_goes_on() -> None:
    held = TaskRecord(
        id="A-1",
        name="A",
        order=1,
        request=TaskRequest(bundle=""),
        status="ACTIVE",
        section="steps",
        hold=TaskHold(causes=(LockdownHold(),)),
    )
    ended = TaskRecord(id="B-2", name="B", order=2, request=TaskRequest(bundle=""), status="SUCCEEDED", section="done")
    goal = GoalRecord(id="A-1/1/x", agent="lwd_1", action="GoTo", task="A-1", state="running")
    tasks = {"A-1": held, "B-2": ended}

    assert waiting_for_people(EngineState(tasks=tasks)) == [held]
    assert waiting_for_people(EngineState(tasks=tasks, goals={goal.id: goal})) == []
    assert waiting_for_people(EngineState(tasks={**tasks, "A-1": structs.replace(held, hold=TaskHold())})) == []
    assert waiting_for_people(EngineState(tasks={"B-2": ended})) == []


class Deaf:
    """A fleet on which faults have no effect."""

    def order(self, agent: str, order: object) -> None: ...


def counted(fields: str, folder_: Path) -> LoadedScenario:
    """A scenario in which a watcher fills in a form."""
    (folder_ / "count.yaml").write_text(
        "formiga: 1\ntask: Count\nagents: {watcher: {type: watcher}}\nsteps:\n"
        "  - ask: How many crates?\n    of: [watcher]\n    options: [found, none_left]\n    timeout: 5 min\n"
        "    form: {crates: {type: int, min: 0, max: 40}, spot: place}\n    save_as: seen\n"
        "  - notify: ${seen.crates} crates, ${distance(seen.spot, base)} away\n"
    )
    text = f"""scenario: try
site: demo-site.yaml
agents:
  - {{id: watcher_1, type: watcher, at: camp, person: {{answers: [{{options: [found], fields: {fields}}}]}}}}
tasks:
  - {{task: Count}}
"""
    return load_scenario_text(text, "x.yaml", folders=(folder_, folder("trees")))


def test_what_people_fill_in_stands_in_the_scenario(tmp_path: Path) -> None:
    scenario = counted("{crates: 12, spot: camp}", tmp_path).scenario
    assert scenario is not None
    virtual = VirtualRun(scenario)
    assert virtual.run()
    texts = [one.text for step in virtual.steps for one in step.effects if isinstance(one, NotifyPeople)]
    virtual.close()
    assert "12 crates, 50 m away" in texts


@pytest.mark.parametrize(
    ("fields", "code"), [("{crates: 41}", "E062"), ("{crate: 1}", "E022"), ("{spot: nowhere}", "E010")]
)
def test_what_no_form_asks_for_is_refused(fields: str, code: str, tmp_path: Path) -> None:
    assert [one.code for one in counted(fields, tmp_path).diagnostics] == [code]
