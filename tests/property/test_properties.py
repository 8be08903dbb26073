"""What holds in every mission, whatever the tree, the agents and the world do."""

import json
from collections import Counter
from itertools import chain
from typing import get_args

import msgspec
import pytest

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.timers import GoalTimer
from formiga_bt.lang.kinds import KINDS
from formiga_bt.lang.model import Task
from formiga_bt.lang.places import steps_around
from formiga_bt.nodes.memory import Mem
from tests.property.strategies import Mission, load, missions
from tests.property.test_differential import fly
from tests.property.world import START, Event, World, yard
from tests.reloading import loaded, written
from tests.shares import some

ENCODER = msgspec.json.Encoder()


def sections(world: World, task: str) -> set[str]:
    """Return the sections of the nodes that run, each `finally` of a stopped sequence left out."""
    tidied = [cleanup.path for cleanup in world.engine.state.tasks[task].ending.cleanups if cleanup.state == "running"]
    keys = (key for key in world.engine.statuses(task) if not any(below(key, path) for path in tidied))
    return {key.split("/", 1)[0] for key in keys}


def below(key: str, path: str) -> bool:
    return key == path or key.startswith(f"{path}.finally[")


def only_its_section_runs(world: World, step: inp.EngineStep) -> None:
    for task in world.engine.state.tasks.values():
        ways_home = {r.section for r in task.agents.recovering if r.state == "running"}
        may_run = set() if task.section == "recover" or task.ending.stopping else {task.section}
        assert sections(world, task.id) <= may_run | ways_home, (
            task,
            step.input,
        )  # who is released flies home meanwhile


def test_no_node_runs_after_its_section_ended_and_every_memory_belongs_to_a_running_node() -> None:
    def watch(world: World, step: inp.EngineStep) -> None:
        only_its_section_runs(world, step)
        for task in world.open_tasks():
            kept = {key.removesuffix(":items") for key in world.engine.state.memory.get(task, {})}
            assert kept == set(world.engine.statuses(task)), step.input

    for mission in missions(some(35, 70), 1000, tasks=2):
        World(mission.tasks(), mission.deeds, mission.events, watch=watch).run()


@pytest.fixture(scope="module")
def flown() -> list[World]:
    return [fly(mission) for mission in missions(some(50, 100), 2000, tasks=2)]


def test_a_goal_is_sent_again_only_when_its_agent_never_had_it(flown: list[World]) -> None:
    for world in flown:
        assert_sent_once(world)


def assert_sent_once(world: World) -> None:
    sent: set[str] = set()
    lost: set[str] = set()
    for step in world.steps:
        match step.input:
            case inp.EffectFailed(_, "goal", goal_id):
                lost.add(goal_id)
            case inp.QueryReplyInput(_, _, goals):
                lost.update(goal.goal_id for goal in goals if goal.state == "unknown")
        for effect in step.effects:
            if isinstance(effect, inp.SendGoal):
                shown_again = effect.action == "Confirm"  # a person's app was started again
                assert effect.goal_id not in sent or effect.goal_id in lost or shown_again, effect
                sent.add(effect.goal_id)
    for body in world.bodies.values():
        started = [goal for what, goal in body.log if what == "start"]
        assert len(started) == len(set(started)), started


def test_when_all_tasks_have_ended_nothing_of_them_is_left(flown: list[World]) -> None:
    for world in flown:
        assert_nothing_left(world)


def assert_nothing_left(world: World) -> None:
    state = world.engine.state
    assert not world.open_tasks(), [state.tasks[t] for t in world.open_tasks()]
    assert not any(state.memory.values())
    assert not any(state.scopes.values())
    assert not state.questions
    assert not state.requests
    assert not [goal for goal in state.goals.values() if goal.task and goal.ended]
    assert not [due for due, deadline in state.deadlines.items() if deadline.task]
    assert not world.engine.runs.open
    for agent in state.agents.values():
        assert not agent.task, agent
        assert agent.pool not in ("ASSIGNED", "EXECUTING ACTION"), agent
    open_goals = {goal.id for goal in state.goals.values() if not goal.ended}
    timers = [due for due in state.wall if isinstance(due, GoalTimer) and due.goal not in open_goals]
    assert not timers


AT_ONCE = frozenset({"check", "set", "notify", "fail", "break_if"})
"""Kinds of steps that end as they begin: they are in no snapshot."""


def test_the_snapshot_after_any_step_goes_on_to_the_same_steps() -> None:
    for mission in missions(40, 3000):
        world, shots = snapped(mission)
        for index in range(len(shots) // 9, len(shots), len(shots) // 9 + 1):
            goes_on(world, shots, index)


def test_a_snapshot_in_which_a_step_of_any_kind_waits_goes_on_to_the_same_steps() -> None:
    seen: Counter[str] = Counter()
    wanted = (KINDS.keys() - AT_ONCE) | {mem.__struct_config__.tag for mem in get_args(Mem)}
    for mission in chain((given_back(),), missions(120, 3100)):
        waiting: list[set[str]] = []
        world, shots = snapped(mission, waiting)
        for index, kinds in enumerate(waiting):
            if any(seen[kind] < TIMES for kind in kinds):
                goes_on(world, shots, index)
                seen.update(kinds)
        if all(seen[kind] >= TIMES for kind in wanted):
            return
    pytest.fail(f"too few snapshots of {[kind for kind in sorted(wanted) if seen[kind] < TIMES]}")


def given_back() -> Mission:
    """Return the mission of a machine that is given back in the air: of the drawn ones nearly none waits for that."""
    steps = [{"do": "one.Haul"}, {"release": "one"}, {"wait": "1 s"}]
    task = {"formiga": 1, "task": "Random0", "agents": {"one": {"type": "cart"}}, "steps": steps}
    return Mission((json.dumps(task),), {}, (Event(1.0, "submit", "Random0"),))


TIMES = 2
"""In how many snapshots each kind is at least."""


def snapped(mission: Mission, waiting: list[set[str]] | None = None) -> tuple[World, list[bytes]]:
    """Fly a mission; return its snapshots after each step, and note in `waiting` what is in each."""
    shots: list[bytes] = []

    def watch(world: World, _: inp.EngineStep) -> None:
        shots.append(shot(world))
        if waiting is not None:
            waiting.append(kinds_in(world))

    world = World(mission.tasks(), mission.deeds, mission.events, watch=watch)
    world.run()
    return world, shots


def kinds_in(world: World) -> set[str]:
    """Return the kinds of the steps that run, and of the memory of their nodes."""
    found: set[str] = set()
    for task, memory in world.engine.state.memory.items():
        model = world.models.get(task.rsplit("-", 1)[0])
        for key, mem in memory.items():
            found.add(str(mem.__struct_config__.tag))
            around = steps_around(model, key) if model is not None else ()
            found.update(step.kind for step in around[-1:])
    return found


def goes_on(world: World, shots: list[bytes], index: int) -> None:
    steps = world.steps[len(world.steps) - len(shots) :]
    engine = Engine(*yard(), world.models, state=loaded(shots[index]))
    assert written(engine.state) == shots[index]
    for step in steps[index + 1 : index + 60]:
        again = engine.handle(step.at, step.input)
        assert ENCODER.encode(again) == ENCODER.encode(step), (steps[index], step)


def shot(world: World) -> bytes:
    return written(world.engine.state)


def two_of_one_file() -> Task:
    body = [
        {"set": {"seen": "${seen + number}"}},
        {"wait": "1 s"},
        {"call": "Tell", "with": {"number": "${number}"}, "save_as": "told"},
        {"notify": "${task.id} ${seen} ${told}"},
    ]
    task = {
        "formiga": 1,
        "task": "Twin",
        "params": {"number": "int"},
        "vars": {"seen": "${0}"},
        "agents": {"cart": {"type": "cart"}},
        "steps": [*body, {"do": "cart.Move", "with": {"far": "${number}"}}, *body],
        "subtrees": {
            "Tell": {"params": {"number": "int"}, "steps": [{"wait": "1 s"}], "returns": "${number}"},
        },
    }
    text = json.dumps(task).replace('"told"', '"told1"', 1).replace("${told}", "${told1}", 1)
    loaded = load(text)
    assert loaded is not None
    return loaded


def test_two_tasks_of_one_file_never_see_each_others_names() -> None:
    world = World([two_of_one_file()], {}, ())
    for number in (3, 40):
        world.scheduler.call_at(START, lambda n=number: world.driver.feed(inp.Submit("Twin", {"number": n})))  # type: ignore[misc]
    world.run()
    effects = [effect for step in world.steps for effect in step.effects]
    told = sorted(effect.text for effect in effects if isinstance(effect, inp.NotifyPeople))
    assert told == ["Twin-1 3 3", "Twin-1 6 3", "Twin-2 40 40", "Twin-2 80 40"]
    far = {effect.goal_id: effect.fields["far"] for effect in effects if isinstance(effect, inp.SendGoal)}
    assert far == {"Twin-1/1/steps/steps[4]": 3, "Twin-2/1/steps/steps[4]": 40}
