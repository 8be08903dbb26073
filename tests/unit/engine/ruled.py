"""A site with standing rules, for tests: the demo site's places, pickers that the test moves, and tasks without machines."""

from pathlib import Path
from typing import Any

from formiga_bt.base.geo import Position
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import AgentEventInput, EngineStep
from formiga_bt.engine.kernel.rule_records import RuleRecord
from formiga_bt.lang.compose import Composed, compose
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Task
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent
from formiga_bt.transport.messages import AgentEvent

HELP = """\
formiga: 1
task: Help
params: {who: {type: agent, of: [picker, drone]}, spot: {type: place, optional: true}}
agents: {watcher: {type: watcher}}
steps:
  - notify: "${who} needs help"
    to: [watcher]
  - wait: 30 s
"""
SOS = "sos: {on: picker.sos, request: Help, with: {who: '${event.agent}', spot: '${ground(event.agent.position)}'}}"
LEFT = """left:
    on: leaves(picker, regions.square)
    for: 10 s
    request: Help
    with: {who: '${event.agent}', spot: '${ground(event.position)}'}"""
SQUARE = "[{east: 0 m, north: 0 m}, {east: 100 m, north: 0 m}, {east: 100 m, north: 100 m}, {east: 0 m, north: 100 m}]"
REAL = "mode: real\npilots: [{id: pia, max_airborne: 3}]\n"


def text_of(*rules: str, mode: str = "mode: simulation\n") -> str:
    """Return the text of a site with these rules."""
    base = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8").replace("mode: simulation\n", mode)
    base = base.replace("people: {watchers: [watcher_1]}", "people: {watchers: [watcher_1], approvers: [ann, bob]}")
    base = base.replace("regions:\n", f"regions:\n  square: {SQUARE}\n")
    return base + ("rules:\n" + "".join(f"  {rule}\n" for rule in rules) if rules else "")


def site_in(here: Path, *rules: str, tasks: tuple[str, ...] = (HELP,), mode: str = "mode: simulation\n") -> Composed:
    """Write a site with its tasks into a folder, and read it."""
    (here / "trees").mkdir(parents=True, exist_ok=True)
    for text in tasks:
        name = text.partition("task: ")[2].partition("\n")[0]
        (here / "trees" / f"{name}.yaml").write_text(text, encoding="utf-8")
    (here / "site.yaml").write_text(text_of(*rules, mode=mode), encoding="utf-8")
    return compose(here / "site.yaml")


def tasks_in(here: Path, world: Composed) -> list[Task]:
    """Return the checked tasks of a folder."""
    found = []
    for path in sorted((here / "trees").glob("*.yaml")):
        loaded = load_task(path, catalogue=world.catalogue, site=world.site)
        assert loaded.task is not None, loaded.diagnostics
        found.append(loaded.task)
    return found


class Ruled(Bench):
    """A bench of a site with rules: picker_1 in the square, watcher_1, and the tasks of its folder."""

    def __init__(
        self, here: Path, *rules: str, tasks: tuple[str, ...] = (HELP,), mode: str = "mode: simulation\n"
    ) -> None:
        world = site_in(here, *rules, tasks=tasks, mode=mode)
        assert world.site is not None, world.diagnostics
        super().__init__(world.site, world.catalogue, tasks_in(here, world))
        self.n = 0
        self.picker = self.agent("picker_1", "picker", at=Position(50.0, 50.0, 0.0))
        self.watcher = self.agent("watcher_1", "watcher")
        self.run_for(1)

    def press(self, agent: str = "picker_1", event: str = "sos", n: int = 0) -> EngineStep:
        """Have an agent report an event; a new one unless `n` says which."""
        self.n += 1
        step = self.driver.feed(AgentEventInput(AgentEvent(agent=agent, event=event, boot_id="b", n=n or self.n)))
        self.driver.drain()
        return step

    def walk(self, east_m: float, north_m: float = 50.0, who: ScriptedAgent | None = None) -> None:
        """Put the picker there, and have them say so."""
        (who or self.picker).say(position=Position(east_m, north_m, 0.0))
        self.run_for(0.3)

    def rule(self, name: str) -> RuleRecord:
        """Return what the engine knows of a rule."""
        return self.engine.state.rules[name]

    def outcomes(self, name: str) -> list[str]:
        """Return what became of each thing that happened, oldest first."""
        return [one.outcome for one in self.rule(name).last]

    def tasks_of(self, name: str) -> list[Any]:
        """Return the tasks that a rule requested."""
        return [t for t in self.engine.state.tasks.values() if t.request.cause and t.request.cause.rule == name]
