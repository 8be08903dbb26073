"""Good tasks by seed: drones that take off, fly and land as they should, in every kind of step. The checker must let them pass.

A task is written piece by piece; each piece begins and ends with its drone as the pieces around it need it. With people who
agree and machines that do what they are told, every task succeeds.
"""

import json
from random import Random
from typing import Any, Final

from tests.property.sound_kinds import InTheAir, Steps

CHILD: Final = """\
formiga: 1
task: Look
imports: [lib/flying.yaml]
params: {spot: place, how: {type: agent, of: [picker], optional: true}}
agents:
  eye: {any_of: [lwd, hwd], near: "${spot}", wait: 40 min}
steps:
  - call: FlyTo
    with: {drone: "${eye}", to: "${spot}", height: 110 m}
  - notify: "${how.id} waits there."
    when: is_set(how)
  - call: ReturnHome
    with: {drone: "${eye}"}
"""
"""A task that others request."""


class Good(InTheAir):
    """Writes one task."""

    def task(self) -> str:
        """Return the text of a task (JSON is YAML)."""
        drones = ["drone", "who", "drone3"][: self.dice.randint(0, 3)]  # as params of subtrees are called, too
        types = {name: self.dice.choice(("lwd", "hwd")) if at < 2 else "lwd" for at, name in enumerate(drones)}
        self.agents = {name: {"type": of} for name, of in types.items()}
        for role in self.agents.values():
            role["near"] = self.dice.choice(("${target}", "${base}"))
            if self.dice.random() < 0.1:
                role["wait"] = "30 min"
        self.agents["watcher"] = {"type": "watcher"}
        spare = sorted({"lwd", "hwd"} - set(types.values()))
        steps: Steps = [
            {"ask": "Shall we begin?", "of": ["watcher"], "timeout": "10 min", "expect": "result.answer == 'yes'"}
        ]
        if len(drones) > 1 and self.dice.random() < 0.5:
            steps.append({"parallel": [{"sequence": self.mission(one, at)} for at, one in enumerate(drones)]})
        else:
            for at, one in enumerate(drones):
                steps += self.mission(one, at)
        if self.dice.random() < 0.4 or not drones:
            steps += self.dice.choice((self.helped, self.others, self.team, self.asked_for, self.found))(spare)
        if drones and self.dice.random() < 0.1:
            steps.append({"release": drones[0]})
        steps.append({"notify": "Done at ${target}"})
        return json.dumps(self.file(steps), indent=1)

    def file(self, steps: Steps) -> dict[str, Any]:
        """Return the whole file, with what the pieces need."""
        file: dict[str, Any] = {"formiga": 1, "task": "Good"}
        for lane, name in enumerate(("drone", "who", "drone3")):
            if name in self.agents and lane in self.first:
                self.agents[name]["near"] = f"${{{self.first[lane]}}}"
        if any(f'"{name}"' in json.dumps(steps) for name in ("ReturnHome", "FlyTo", "FlyAndLand", "FetchHome")):
            file["imports"] = ["lib/flying.yaml"]
        file |= {
            "params": self.params,
            **({"vars": self.vars} if self.vars else {}),
            "agents": self.agents,
            "steps": steps,
        }
        if self.dice.random() < 0.2:
            file["on_failure"] = [{"notify": "It failed: ${error.reason}", "severity": "warning"}]
        if self.dice.random() < 0.2:
            file["finally"] = [{"notify": "That was ${task.name}."}]
        return file | ({"subtrees": self.subtrees} if self.subtrees else {})

    # --- on the ground at the beginning and at the end ---------------------------------------------------------------

    def mission(self, drone: str, lane: int) -> Steps:
        """Return steps that begin and end with a drone at its port."""
        found: Steps = []
        for _ in range(self.dice.randint(1, 2)):
            found += self.dice.choice((self.round, self.round, self.there_and_back, self.brought_home, self.perhaps))(
                drone, lane
            )
        return found

    def there_and_back(self, drone: str, lane: int) -> Steps:
        """Fly somewhere, land, come home."""
        return [
            {"call": "FlyAndLand", "with": {"drone": f"${{{drone}}}", "at": self.place(lane)}},
            *self.ground(drone),
            {"call": "FetchHome", "with": {"drone": f"${{{drone}}}"}},
        ]

    def round(self, drone: str, lane: int) -> Steps:
        """Fly somewhere, do things in the air, come home."""
        whole: Steps = [{"do": f"{drone}.TakeOff"}]
        for _ in range(self.dice.randint(1, 3)):
            whole += self.air(drone, lane, 2)
        whole.append({"call": "ReturnHome", "with": {"drone": f"${{{drone}}}"}})
        if self.dice.random() < 0.2:
            return [{"if": f"{drone}.battery > 50 %", "then": whole, "else": [{"notify": "Too weak."}]}]
        return whole

    def brought_home(self, drone: str, lane: int) -> Steps:
        """Fly; it is brought home whatever comes of that."""
        home = {"call": "ReturnHome", "with": {"drone": f"${{{drone}}}"}, "when": f"{drone}.airborne"}
        return [{"sequence": [{"do": f"{drone}.TakeOff"}, *self.air(drone, lane, 1)], "finally": [home]}]

    def perhaps(self, drone: str, lane: int) -> Steps:
        """Fly under a condition that each of the steps asks for itself."""
        cond = self.dice.choice((f"{self.mode()} == 'quick'", "mode != 'usual'", "mode in ['quick', 'usual']"))
        home = {"call": "ReturnHome", "with": {"drone": f"${{{drone}}}"}}
        air = {"sequence": self.air(drone, lane, 1), "when": cond}
        last = {**home, "when": cond} if self.dice.random() < 0.5 else {"if": cond, "then": [home]}
        return [{"do": f"{drone}.TakeOff", "when": cond}, air, last]

    def ground(self, drone: str) -> Steps:
        """Return steps for a drone that stands."""
        self.count += 1
        ask = {
            "ask": f"Loaded ({self.count})?",
            "of": ["watcher", "watchers"],
            "options": ["yes", "later"],
            "timeout": "15 min",
        }
        said = f"said{self.count}"
        return self.dice.choice((
            [{"wait": "20 s"}],
            [{**ask, "expect": "result.answer == 'yes'", "retry": {"attempts": 3, "delay": "1 min"}}],
            [{**ask, "save_as": said, "escalate_after": "2 min"},
             {"notify": f"They said ${{{said}.answer}}", "when": f"{said}.answer == 'yes'"}],
            [{**ask, "save_as": said},
             {"switch": f"{said}.answer", "cases": {"yes": [{"notify": "Good."}], "later": [{"wait": "30 s"}]}}],
            [{**ask, "save_as": said, "ignore_failure": True},
             {"notify": f"They said ${{{said}.answer}}", "when": f"is_set({said})"}],
            [{**ask, "clears": {"role": drone, "on": ["yes"]}}],
            [{"wait_until": f"not {drone}.airborne and {drone}.battery > 10 %", "timeout": "5 min"}],
            [{"check": f"not {drone}.airborne", "message": "It should stand."}],
            [{"notify": "It has landed.", "to": ["watchers"]}],
        ))  # fmt: skip

    # --- with agents of their own ------------------------------------------------------------------------------------

    def helped(self, spare: list[str]) -> Steps:
        """Fly one more machine, of a type of which the task holds none."""
        if not spare:
            return self.found(spare)
        helper = self.new("helper")
        steps = self.mission(helper, 3)
        role = {"type": self.dice.choice(spare), "near": f"${{{self.first.get(3, 'base')}}}", "wait": "30 min"}
        block: dict[str, Any] = {"with_agents": {helper: role}, "steps": steps}
        if self.dice.random() < 0.5:
            block["retry"] = {"attempts": 2, "delay": "10 s", "agent": "another"}
        return [block]

    def asked_for(self, spare: list[str]) -> Steps:
        """Request another task, if this one keeps no machine from it."""
        if len(spare) < 2:
            return self.helped(spare)
        what: dict[str, Any] = {"request": "Look", "with": {"spot": self.place(0)}}
        if self.dice.random() < 0.5:
            came = self.new("came")
            return [{**what, "save_as": came}, {"notify": f"${{{came}.task_id}} is done."}]
        if self.dice.random() < 0.5:
            return [{**what, "timeout": "2 h", "retry": {"attempts": 2, "delay": "30 s"}}]
        return [{**what, "wait": False, "detached": True, "priority": "low"}]

    def others(self, spare: list[str]) -> Steps:
        """Fly as many as are free, one after another or at once, in a block of their own."""
        if not spare:
            return self.found(spare)
        crew, one = self.new("crew"), self.new("one")
        role = {
            "type": self.dice.choice(spare),
            "count": self.dice.choice((2, {"min": 1, "max": 2}, "all")),
            "wait": "30 min",
        }
        return [{"with_agents": {crew: role}, "steps": [self.each(crew, one)]}]

    def team(self, spare: list[str]) -> Steps:
        """Fly as many as are free, granted with the task."""
        if not spare:
            return self.found(spare)
        self.agents["team"] = {"type": self.dice.choice(spare), "count": self.dice.choice((2, {"min": 1, "max": 2}))}
        return [self.each("team", self.new("one")), {"notify": "${len(team)} were there."}]

    def each(self, crew: str, one: str) -> dict[str, Any]:
        """Return a round of each of a crew over its own port."""
        step: dict[str, Any] = {
            "for": {one: f"${{{crew}}}"},
            "steps": [
                {"do": f"{one}.TakeOff"},
                {
                    "do": f"{one}.GoTo",
                    "with": {"to": f"${{at_height(offset({one}.home, north=8 m), {one}.transit_height)}}"},
                },
                {"wait": "5 s"},
                {"call": "ReturnHome", "with": {"drone": f"${{{one}}}"}},
            ],
        }
        if self.dice.random() < 0.6:
            step["mode"] = "parallel"
            step |= self.dice.choice(({}, {"max_parallel": 1}, {"on_child_failure": "cancel"}))
        return step

    def found(self, spare: list[str]) -> Steps:
        """Ask a picker's tracker where they are, and wait whether they call."""
        self.agents["picker"] = {"type": "picker", "near": "${target}"}
        fix, call = self.new("fix"), self.new("call")
        return [
            {"do": "picker.MiniFinder", "with": {"base": "${base}"}, "save_as": fix, "timeout": "1 min"},
            {"notify": f"At ${{{fix}.go_to}}", "when": f"{fix}.in_range"},
            {"wait_for": "picker.sos", "timeout": "1 min", "save_as": call, "ignore_failure": True},
            {"notify": "They called.", "severity": "alarm", "when": f"is_set({call})"},
        ]


def good_task(seed: int) -> str:
    """Return the good task of a seed."""
    return Good(Random(seed)).task()
