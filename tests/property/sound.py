"""Good tasks by seed: drones that take off, fly and land as they should, in every kind of step. The checker must let them pass.

A task is written piece by piece; each piece begins and ends with its drone as the pieces around it need it. With people who
agree and machines that do what they are told, every task succeeds.
"""

import json
from random import Random
from typing import Any

PLACES = ("camp", "north_field", "east_field", "south_field", "west_field", "lake_shore")
Steps = list[dict[str, Any]]


class Good:
    """Writes one task."""

    def __init__(self, dice: Random) -> None:
        self.dice = dice
        self.count = 0

    def task(self) -> str:
        """Return the text of a task (JSON is YAML)."""
        drones = [f"drone{number}" for number in range(1, self.dice.randint(1, 3) + 1)]
        agents: dict[str, Any] = {
            name: {"type": self.dice.choice(("lwd", "hwd")) if at < 2 else "lwd"} for at, name in enumerate(drones)
        }
        for role in agents.values():
            if self.dice.random() < 0.3:
                role["near"] = "${target}"
        agents["watcher"] = {"type": "watcher"}
        steps: Steps = [
            {"ask": "Shall we begin?", "of": ["watcher"], "timeout": "10 min", "expect": "result.answer == 'yes'"}
        ]
        if len(drones) > 1 and self.dice.random() < 0.5:
            steps.append({"parallel": [{"sequence": self.mission(one, at)} for at, one in enumerate(drones)]})
        else:
            for at, one in enumerate(drones):
                steps += self.mission(one, at)
        steps.append({"notify": "Done at ${target}"})
        file = {
            "formiga": 1, "task": "Good", "imports": ["lib/flying.yaml"], "params": {"target": "place"},
            "agents": agents, "steps": steps,
        }  # fmt: skip
        return json.dumps(file, indent=1)

    def mission(self, drone: str, lane: int) -> Steps:
        """Return steps that begin and end with a drone at its port."""
        found: Steps = []
        for _ in range(self.dice.randint(1, 2)):
            found += self.dice.choice((self.round, self.round, self.there_and_back))(drone, lane)
        return found

    def there_and_back(self, drone: str, lane: int) -> Steps:
        """Fly somewhere, land, come home."""
        place = self.place(lane)
        return [
            {"call": "FlyAndLand", "with": {"drone": f"${{{drone}}}", "at": place}},
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

    def ground(self, drone: str) -> Steps:
        """Return steps for a drone that stands."""
        self.count += 1
        ask = {
            "ask": f"Loaded ({self.count})?",
            "of": ["watcher", "watchers"],
            "options": ["yes", "later"],
            "timeout": "15 min",
        }
        return self.dice.choice((
            [{"wait": "20 s"}],
            [{**ask, "expect": "result.answer == 'yes'", "retry": {"attempts": 3, "delay": "1 min"}}],
            [{**ask, "save_as": f"said{self.count}", "escalate_after": "2 min"},
             {"notify": f"They said ${{said{self.count}.answer}}", "when": f"said{self.count}.answer == 'yes'"}],
            [{"notify": "It has landed."}],
        ))  # fmt: skip

    def air(self, drone: str, lane: int, depth: int) -> Steps:
        """Return steps that begin and end in the air."""
        pick = self.dice.randrange(11 if depth else 5)
        inside = (lambda: self.air(drone, lane, depth - 1)) if depth else list
        match pick:
            case 0 | 1:
                return self.leg(drone, lane)
            case 2:
                return [
                    {
                        "call": "FlyTo",
                        "with": {"drone": f"${{{drone}}}", "to": self.place(lane), "height": f"{self.height(lane)} m"},
                    }
                ]
            case 3:
                return [{"wait": f"{self.dice.randint(1, 20)} s"}]
            case 4:
                self.count += 1
                return [{"check": f"{drone}.airborne"}, {"notify": f"Here ({self.count})."}]
            case 5:
                self.count += 1
                spot = f"spot{self.count}"
                path = f"${{circle(above({self.bare(lane)}, {self.height(lane)} m), 20 m, points={self.dice.randint(3, 6)})}}"
                return [{"for": {spot: path}, "steps": [{"do": f"{drone}.GoTo", "with": {"to": f"${{{spot}}}"}}]}]
            case 6:
                return [{"repeat": self.dice.randint(2, 3), "steps": [*inside(), {"wait": "2 s"}]}]
            case 7:
                return [
                    {
                        "if": f"{drone}.battery > 30 %",
                        "then": inside(),
                        **({"else": inside()} if self.dice.random() < 0.5 else {}),
                    }
                ]
            case 8:
                leg = self.leg(drone, lane)[0]
                return [{**leg, "timeout": "10 min", "retry": {"attempts": 2, "delay": "5 s"}}]
            case 9:
                return [{"guard": f"{drone}.battery > 26 %", "steps": inside()}]
            case _:
                return [
                    {
                        "fallback": [
                            {"sequence": inside()},
                            {"sequence": [*self.leg(drone, lane), {"fail": "It did not work."}]},
                        ]
                    }
                ]

    def leg(self, drone: str, lane: int) -> Steps:
        """Return one flight."""
        to = f"${{above({self.bare(lane)}, {self.height(lane)} m)}}"
        return [{"do": f"{drone}.GoTo", "with": {"to": to, **({"speed": "5 m/s"} if self.dice.random() < 0.2 else {})}}]

    def bare(self, lane: int) -> str:
        """Return a place that is not another drone's."""
        base = self.dice.choice(("target", "base", *(f"site.places.{one}" for one in PLACES)))
        return f"offset({base}, east={lane * 25 + self.dice.randint(1, 3)} m, north={self.dice.randint(1, 90)} m)"

    def place(self, lane: int) -> str:
        return f"${{{self.bare(lane)}}}"

    def height(self, lane: int) -> int:
        return 30 + 20 * lane + self.dice.randint(0, 4)


def good_task(seed: int) -> str:
    """Return the good task of a seed."""
    return Good(Random(seed)).task()
