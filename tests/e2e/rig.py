"""A demo run under test: real processes, real Zenoh, conditions with deadlines instead of sleeps, and nothing left over."""

import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.engine.kernel.inputs import Abort, EngineStep, Submit
from formiga_bt.engine.kernel.records import AgentRecord, GoalRecord, TaskRecord
from formiga_bt.lang.loader import load_catalogue, load_site, load_task
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import fleet_of
from formiga_bt.services.demo import Demo

ROOT = Path(__file__).parents[2]


SCRIPTS: Mapping[str, Sequence[Mapping[str, Any]]] = {
    "picker_1": [
        {"match": "loaded", "options": ["not_yet", "loaded"], "after": "4 s"},
        {"match": "clear", "options": ["clear"] * 9, "after": "5 s"},
    ],
    "picker_2": [
        {"match": "loaded", "options": ["loaded"], "after": "20 s"},
        {"match": "clear", "options": ["clear"] * 9, "after": "6 s"},
    ],
    "watcher_1": [{"match": "*", "never": True}],
}
"""What the demo's people say: one picker is not ready at first; the watcher leaves it to the pickers."""


def people_placed(site: Site, catalogue: Catalogue) -> list[AgentSpec]:
    """Return the site's agents, people where the missions need them."""
    return [_placed(spec, site) for spec in fleet_of(site, catalogue, scripts=SCRIPTS)]


def missions(site: Site) -> list[Submit]:
    """Return what the demo flies: T1 and two T3 at once."""
    return [
        Submit("PickUp", {"target": site.places["north_field"], "user": AgentRef("picker_1")}, by="demo"),
        Submit("PickUp", {"target": site.places["east_field"], "user": AgentRef("picker_2")}, by="demo"),
        Submit("MoveTask", {"robot": AgentRef("lwd_1")}, by="demo"),
    ]


PLACES: Mapping[str, str] = {"picker_1": "north_field", "picker_2": "east_field", "watcher_1": "camp"}
"""Where the demo's people stand."""


def _placed(spec: AgentSpec, site: Site) -> AgentSpec:
    return replace(spec, at=site.places[PLACES[spec.id]]) if spec.id in PLACES else spec


def world(folder: Path, replacements: Mapping[str, str]) -> tuple[Site, Catalogue, list[Task]]:
    """Load the shipped site, catalogue and tasks; in a copy of the catalogue the texts `replacements` names are changed."""
    text = (ROOT / "actions" / "base.yaml").read_text()
    for old, new in replacements.items():
        assert old in text
        text = text.replace(old, new)
    path = folder / "actions.yaml"
    path.write_text(text)
    catalogue, problems, _ = load_catalogue([path])
    assert problems == []
    site, problems, _ = load_site(ROOT / "trees" / "demo-site.yaml")
    assert problems == []
    assert site is not None
    loaded = [
        load_task(ROOT / "trees" / name, catalogue=catalogue, site=site) for name in ("pick_up.yaml", "move_task.yaml")
    ]
    tasks = [one.task for one in loaded if one.task is not None]
    assert len(tasks) == 2
    return site, catalogue, tasks


def agent_pid(parent: int, agent: str) -> int:
    """Return the pid of a simulated agent that this process started."""
    for pid in children(parent):
        words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        if b"--id" in words and words[words.index(b"--id") + 1] == agent.encode():
            return pid
    raise AssertionError(f"no process of {agent}")


def children(pid: int) -> set[int]:
    """Return the pids of a process's children, the ended but not yet waited for among them."""
    found = set()
    for path in Path("/proc").iterdir():
        if path.name.isdigit():
            try:
                parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError):
                continue  # gone meanwhile
            if parent == pid:
                found.add(int(path.name))
    return found


def is_running(pid: int) -> bool:
    """Return whether a process runs (a zombie does not)."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(is_met: Callable[[], object], within_s: float = 20.0, what: str = "") -> None:
    """Wait for a condition of the outside world."""
    end = time.monotonic() + within_s
    while not is_met():
        assert time.monotonic() < end, f"waited {within_s:g} s in vain: {what}"
        time.sleep(0.02)


class Rig(Demo):
    """A `Demo` whose processes may die; it keeps the steps it saw."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.steps: list[EngineStep] = []
        self.driver.listeners.append(self.steps.append)
        self.pids: set[int] = set()

    def __enter__(self) -> "Rig":
        super().__enter__()
        try:
            self.pids |= children(os.getpid())
            self.wait(lambda: not self.missing(), what="all agents are there")
        except BaseException:
            self.close()
            raise
        return self

    def wait(self, is_met: Callable[[], object], within_s: float = 25.0, what: str = "") -> None:
        """Follow the engine until a condition holds."""
        end = time.monotonic() + within_s
        while not is_met():
            assert time.monotonic() < end, f"waited {within_s:g} s in vain: {what}\n" + self.story()
            self.take(0.02)

    def story(self) -> str:
        """Return what happened, for the message of a failed test."""
        lines = [f"{self.log.since_start(line.at):8.1f} {line.text}" for line in self.log.lines]
        lines += [f"{a.id} {a.liveness} {a.pool} {a.landed} {a.quarantine}" for a in self.log.state.agents.values()]
        return "\n".join(lines)

    def task(self, task_id: str) -> TaskRecord:
        return self.log.state.tasks[task_id]

    def agent(self, agent: str) -> AgentRecord:
        return self.log.state.agents[agent]

    def flying(self, task_id: str, action: str = "GoTo") -> GoalRecord | None:
        """Return the goal of this action that a task has running, if any."""
        goals = self.log.state.goals.values()
        return next((g for g in goals if g.task == task_id and g.action == action and g.state == "running"), None)

    def pick_up(self, place: str = "north_field", user: str = "picker_1") -> str:
        from formiga_bt.lang.types import AgentRef

        return self.submit([Submit("PickUp", {"target": self.site.places[place], "user": AgentRef(user)})])[0]

    def move(self, robot: str) -> str:
        from formiga_bt.lang.types import AgentRef

        return self.submit([Submit("MoveTask", {"robot": AgentRef(robot)})])[0]

    def abort(self, task_id: str) -> None:
        self.driver.ask(Abort(task_id, by="test"))

    def high(self, agent: str, up_m: float = 50.0) -> bool:
        """Return whether a drone is well up."""
        position = self.agent(agent).position
        return position is not None and position.up_m > up_m

    def far(self, agent: str, north_m: float) -> bool:
        """Return whether a drone has come so far to the north."""
        position = self.agent(agent).position
        return position is not None and position.north_m > north_m

    def at_rest(self, agents: Sequence[str]) -> bool:
        return all(self.agent(a).pool == "STANDBY" and self.agent(a).landed == "grounded" for a in agents)

    def texts(self, pattern: str) -> list[str]:
        return [line.text for line in self.log.lines if re.search(pattern, line.text)]
