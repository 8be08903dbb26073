"""A snapshot after any step is enough to go on, in another process and under another hash seed, byte for byte."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from formiga_bt.nodes.ends import AgentReleased, ChildEnd, GoalEnd
from formiga_bt.nodes.memory import (
    AskMem,
    CallMem,
    CleanupMem,
    DoMem,
    FallbackMem,
    GatherMem,
    ItemsMem,
    LiveMem,
    LoopMem,
    PassMem,
    RequestMem,
    RetryMem,
    SequenceMem,
    SwitchMem,
    TimeoutMem,
    WaitMem,
    WithMem,
)  # fmt: skip
from tests.reloading import loaded
from tests.replay.missions import MISSIONS, Recorded, record, replay, save

ROOT = Path(__file__).parents[2]


def run(*arguments: str, seed: str) -> subprocess.CompletedProcess[bytes]:
    env = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.replay.missions", *arguments]
    return subprocess.run(command, env=env, cwd=ROOT, capture_output=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def films() -> dict[str, tuple[list[Recorded], list[bytes]]]:
    return {name: record(name) for name in MISSIONS}


def test_the_missions_pass_through_what_must_be_restored(films: dict[str, tuple[list[Recorded], list[bytes]]]) -> None:
    states = [loaded(shot) for _, shots in films.values() for shot in shots]
    tasks = [task for state in states for task in state.tasks.values()]
    mems = [mem for state in states for memory in state.memory.values() for mem in memory.values()]
    assert {"steps", "on_abort", "finally", "recover"} <= {task.section for task in tasks}
    kinds = {
        SequenceMem,
        FallbackMem,
        SwitchMem,
        CallMem,
        DoMem,
        AskMem,
        WaitMem,
        PassMem,
        TimeoutMem,
        RetryMem,
        CleanupMem,
    }
    kinds |= {LiveMem, GatherMem, LoopMem, ItemsMem, WithMem, RequestMem}
    assert kinds <= {type(mem) for mem in mems}
    drains = [
        *(task.ending.drain for task in tasks),
        *(m.drain for m in mems if isinstance(m, TimeoutMem | LiveMem | GatherMem)),
    ]
    ends = {type(end) for drain in drains for end in drain}
    assert {GoalEnd, AgentReleased, ChildEnd} <= ends
    assert any(isinstance(mem, LiveMem) and mem.halting and mem.drain for mem in mems)
    assert any(isinstance(mem, LoopMem | RetryMem) and mem.waiting for mem in mems)
    assert any(isinstance(mem, RetryMem) and mem.failed for mem in mems)
    assert any(isinstance(mem, GatherMem) and mem.states.startswith("RR.") for mem in mems)
    assert {"runs", "releases"} <= {mem.state for mem in mems if isinstance(mem, WithMem)}
    assert {"place", "fix", "drone"} <= {name for mem in mems if isinstance(mem, ItemsMem) for name in mem.items[0]}
    assert any(goal.state == "canceling" for state in states for goal in state.goals.values())
    assert any(task.ending.stopping for task in tasks)
    assert any(task.agents.releasing for task in tasks)
    assert any(cause.startswith("take-over:") for task in tasks for cause in task.hold.words)
    assert {"running", "waiting"} <= {cleanup.state for task in tasks for cleanup in task.ending.cleanups}


@pytest.mark.parametrize("name", MISSIONS)
def test_every_snapshot_goes_on_to_the_same_steps_in_a_new_process(
    name: str, films: dict[str, tuple[list[Recorded], list[bytes]]], tmp_path: Path
) -> None:
    film = tmp_path / name
    film.write_bytes(save(*films[name]))
    done = run(str(film), seed="4711")
    assert done.returncode == 0, (done.stdout + done.stderr).decode()[-6000:]


def test_a_changed_record_is_noticed(films: dict[str, tuple[list[Recorded], list[bytes]]]) -> None:
    steps, shots = films["move_task"]
    changed = [*steps[:9], Recorded(steps[9].at, steps[9].given, steps[9].out + b" "), *steps[10:]]
    assert replay(changed, shots)


def test_two_hash_seeds_give_byte_equal_steps() -> None:
    one, other = run("--fly", seed="1"), run("--fly", seed="2")
    assert one.returncode == other.returncode == 0, (one.stderr + other.stderr).decode()
    assert one.stdout.count(b"\n") > 1000
    assert one.stdout == other.stdout
