"""The tables of life cycles name every state that the engine's records declare, and a transition beside them is found."""

from typing import Any, get_args, get_type_hints

import pytest
from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel import records as rec
from formiga_bt.engine.kernel.inputs import EngineStep, TimerDue
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.engine.kernel.timers import AllocationDue
from formiga_bt.engine.restart.journal_backpressure import LEVELS
from tests.simulation.lifecycle import LIFE, TABLES, Recorder, unseen
from tests.simulation.runs import play


def states(machine: str) -> set[str]:
    """Return the states that a table names."""
    table = TABLES[machine]
    return {state for was, nexts in table.items() for state in (was, *nexts)} - {"-"}


def declared(record: Any, field: str) -> set[str]:
    """Return the states that a record declares."""
    hint = get_type_hints(record)[field]
    return set(get_args(hint))


@pytest.mark.parametrize(
    ("machine", "names"),
    [
        ("task", declared(rec.TaskRecord, "status")),
        ("section", declared(rec.TaskRecord, "section") - {""} | {"waits"}),
        ("again", declared(rec.TaskRestart, "why") - {""} | {"no"}),
        ("goal", declared(rec.GoalRecord, "state")),
        ("machine liveness", declared(rec.AgentRecord, "liveness")),
        ("machine pool", declared(rec.AgentRecord, "pool")),
        ("clearance", declared(rec.ClearanceRecord, "state")),
        ("lockdown", declared(rec.Lockdown, "how")),
        ("resume", declared(rec.Resuming, "phase")),
        ("way home", declared(rec.Recovering, "state")),
        ("finally", declared(rec.Cleanup, "state")),
        ("journal", set(LEVELS)),
    ],
)
def test_a_table_names_every_state_that_its_record_declares(machine: str, names: set[str]) -> None:
    assert states(machine) == names


def test_every_order_that_stands_is_in_its_table() -> None:
    stops, how = declared(rec.StandingOrder, "stop"), declared(rec.StandingOrder, "state")

    assert states("order") <= {f"{stop} {state}" for stop in stops for state in how}
    assert {state.split()[0] for state in states("order")} == stops


def test_every_state_can_be_reached_and_left() -> None:
    final = {"SUCCEEDED", "FAILED", "CANCELED", "done"}
    for machine, table in TABLES.items():
        reached = {now for nexts in table.values() for now in nexts}

        assert set(table) - {"-", "ok"} <= reached, machine
        assert reached - set(table) <= {"-", *final, *(("STANDBY",) if machine == "person pool" else ())}, machine


def test_a_transition_beside_the_tables_is_told() -> None:
    task = rec.TaskRecord(id="A-1", name="A", order=1, request=rec.TaskRequest(bundle=""))
    recorder = Recorder()

    fine = recorder.look(step(task, replace(task, status="ASSIGNED")))
    strange = recorder.look(step(replace(task, status="PENDING")))

    assert fine == ()
    assert strange == (("task", "ASSIGNED", "PENDING"),)
    assert ("task", "PENDING", "ASSIGNED") not in unseen(recorder.seen)


def test_what_a_killed_engine_had_not_kept_never_was() -> None:
    task = rec.TaskRecord(id="A-1", name="A", order=1, request=rec.TaskRequest(bundle=""))
    recorder = Recorder()
    recorder.look(step(task, replace(task, status="ASSIGNED")))

    recorder.load(EngineState(tasks={"A-1": task}))

    assert recorder.look(step(replace(task, status="ASSIGNED"))) == ()


def test_a_run_tells_what_it_took() -> None:
    report = play(3)

    assert report.transitions <= LIFE
    assert ("task", "ACTIVE", "ENDING") in report.transitions
    assert {"goal.running", "agents"} <= report.causes


def step(*tasks: rec.TaskRecord) -> EngineStep:
    """Return a step that puts these records."""
    return EngineStep(1, 0, TimerDue(AllocationDue()), tuple(ch.TaskPut(task) for task in tasks), ())
