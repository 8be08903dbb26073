"""The kinds of steps that a good task is made of: pieces for a drone in the air, for one that stands, and whole missions.

Mixed into `sound.Good`. Each piece begins and ends with its drone as the pieces around it need it.
"""

from random import Random
from typing import Any

PLACES = ("camp", "north_field", "east_field", "south_field", "west_field", "lake_shore")
Steps = list[dict[str, Any]]


class Pieces:
    """What pieces need: the dice, names that nothing else has, and what the task declares for them."""

    def __init__(self, dice: Random) -> None:
        self.dice = dice
        self.count = 0
        self.params: dict[str, Any] = {"target": "place"}
        self.vars: dict[str, Any] = {}
        self.agents: dict[str, Any] = {}
        self.subtrees: dict[str, Any] = {}
        self.first: dict[int, str] = {}
        """By lane: the place that its drone is sent to first."""

    def new(self, word: str) -> str:
        """Return a name that nothing else has."""
        self.count += 1
        return f"{word}{self.count}"

    def mode(self) -> str:
        """Return the name of a param of three values."""
        default = self.dice.choice(("quick", "long"))
        self.params["mode"] = {"type": "enum", "values": ["quick", "usual", "long"], "default": default}
        return "mode"

    def condition(self) -> str:
        """Return a condition that is as it is for the whole task."""
        cond = self.dice.choice((
            "now > today('06:30')", "now < today('23:50')", "mode == 'quick'", "mode != 'usual'",
            "distance(base, target) > 100 m",
            "mode in ['quick', 'usual']", "now > sunrise(base) or now < sunset(base)",
        ))  # fmt: skip
        if cond.startswith("mode"):
            self.mode()
        return cond

    def bare(self, lane: int) -> str:
        """Return a place that is not another drone's."""
        base = self.dice.choice(("target", "base", *(f"site.places.{one}" for one in PLACES)))
        if self.dice.random() < 0.1:
            self.params["other"] = {"type": "place", "optional": True}
            base = "(other if is_set(other) else target)"
        self.first.setdefault(lane, base)
        return f"offset({base}, east={lane * 25 + self.dice.randint(1, 3)} m, north={self.dice.randint(1, 90)} m)"

    def place(self, lane: int) -> str:
        """Return the same as a value."""
        return f"${{{self.bare(lane)}}}"

    def height(self, lane: int) -> int:
        """Return a height that is not another drone's."""
        return 30 + 20 * lane + self.dice.randint(0, 4)

    def leg(self, drone: str, lane: int) -> Steps:
        """Return one flight."""
        to = f"${{above({self.bare(lane)}, {self.height(lane)} m)}}"
        return [{"do": f"{drone}.GoTo", "with": {"to": to, **({"speed": "5 m/s"} if self.dice.random() < 0.2 else {})}}]


class InTheAir(Pieces):
    """Steps that begin and end in the air."""

    def air(self, drone: str, lane: int, depth: int) -> Steps:
        """Return some of them."""
        plain = (self.leg, self.leg, self.fly_to, self.pause, self.look)
        nested = (
            self.ring, self.rounds, self.branch, self.tried_again, self.guarded, self.fallen_back, self.switched, self.tidied,
            self.counted, self.until, self.for_a_while, self.over_places, self.in_a_subtree, self.skipped, self.left_early,
            self.while_asked, self.first_of_two, self.checked_first, self.collected, self.in_time,
        )  # fmt: skip
        if not depth or self.dice.random() < 0.3:
            return self.dice.choice(plain)(drone, lane)
        return self.dice.choice(nested)(drone, lane, depth - 1)

    def fly_to(self, drone: str, lane: int) -> Steps:
        given = {"drone": f"${{{drone}}}", "to": self.place(lane), "height": f"{self.height(lane)} m"}
        return [{"call": "FlyTo", "with": given}]

    def pause(self, drone: str, lane: int) -> Steps:
        return [{"wait": f"{self.dice.randint(1, 20)} s"}]

    def look(self, drone: str, lane: int) -> Steps:
        return [{"check": f"{drone}.airborne"}, {"notify": f"{self.new('Here')}."}]

    def ring(self, drone: str, lane: int, depth: int) -> Steps:
        spot = self.new("spot")
        path = f"${{circle(above({self.bare(lane)}, {self.height(lane)} m), 20 m, points={self.dice.randint(3, 6)})}}"
        return [{"for": {spot: path}, "steps": [{"do": f"{drone}.GoTo", "with": {"to": f"${{{spot}}}"}}]}]

    def rounds(self, drone: str, lane: int, depth: int) -> Steps:
        return [{"repeat": self.dice.randint(2, 3), "steps": [*self.air(drone, lane, depth), {"wait": "2 s"}]}]

    def branch(self, drone: str, lane: int, depth: int) -> Steps:
        cond = f"{drone}.battery > 30 %" if self.dice.random() < 0.5 else self.condition()
        other = {"else": self.air(drone, lane, depth)} if self.dice.random() < 0.5 else {}
        return [{"if": cond, "then": self.air(drone, lane, depth), **other}]

    def tried_again(self, drone: str, lane: int, depth: int) -> Steps:
        return [{**self.leg(drone, lane)[0], "timeout": "10 min", "retry": {"attempts": 2, "delay": "5 s"}}]

    def guarded(self, drone: str, lane: int, depth: int) -> Steps:
        cond = self.dice.choice((f"{drone}.battery > 26 %", f"{drone}.airborne", "now < today('23:55')"))
        return [{"guard": cond, "steps": self.air(drone, lane, depth)}]

    def fallen_back(self, drone: str, lane: int, depth: int) -> Steps:
        last = {"sequence": [*self.leg(drone, lane), {"fail": "It did not work."}]}
        return [{"fallback": [{"sequence": self.air(drone, lane, depth)}, last]}]

    def switched(self, drone: str, lane: int, depth: int) -> Steps:
        cases = {"quick": self.air(drone, lane, depth), "long": self.air(drone, lane, depth)}
        if self.dice.random() < 0.5:
            return [{"switch": self.mode(), "cases": cases, "default": [{"notify": f"{self.new('As')} usual."}]}]
        return [{"switch": self.mode(), "cases": {**cases, "usual": [{"wait": "2 s"}]}}]

    def tidied(self, drone: str, lane: int, depth: int) -> Steps:
        return [{"sequence": self.air(drone, lane, depth), "finally": [{"notify": f"{self.new('Tidy')}."}]}]

    def counted(self, drone: str, lane: int, depth: int) -> Steps:
        done = self.new("done")
        self.vars[done] = "${0}"
        steps = [*self.air(drone, lane, depth), {"set": {done: f"${{{done} + 1}}"}}, {"wait": "1 s"}]
        return [{"while": f"{done} < {self.dice.randint(1, 3)}", "steps": steps, "max": 5}]

    def until(self, drone: str, lane: int, depth: int) -> Steps:
        steps = [*self.air(drone, lane, depth), {"wait": "1 s"}]
        return [{"repeat": 2, "steps": steps, "until": f"{drone}.battery < 60 %"}]

    def for_a_while(self, drone: str, lane: int, depth: int) -> Steps:
        return [{"repeat": "40 s", "every": "15 s", "steps": self.leg(drone, lane)}]

    def over_places(self, drone: str, lane: int, depth: int) -> Steps:
        stops, stop, high = self.new("stops"), self.new("stop"), self.new("high")
        self.vars[stops] = f"${{[{self.bare(lane)}, {self.bare(lane)}]}}"
        lists = {stop: f"${{{stops}}}", high: f"${{[{self.height(lane)} m, {self.height(lane)} m]}}"}
        return [{"for": lists, "steps": [{"do": f"{drone}.GoTo", "with": {"to": f"${{above({stop}, {high})}}"}}]}]

    def in_a_subtree(self, drone: str, lane: int, depth: int) -> Steps:
        """Call a subtree of the file: a flight there, and what came of it."""
        name, seen = self.new("Lap"), self.new("seen")
        height = f"{self.height(lane)} m"
        self.subtrees[name] = {
            "params": {"who": "agent", "around": "place"},
            "steps": [{"do": "who.GoTo", "with": {"to": f"${{above(around, {height})}}"}}, {"wait": "3 s"}],
            "returns": "${distance(base, around)}",
        }
        call = {"call": name, "with": {"who": f"${{{drone}}}", "around": self.place(lane)}, "save_as": seen}
        return [call, {"notify": f"It is ${{{seen}}} away."}]

    def skipped(self, drone: str, lane: int, depth: int) -> Steps:
        return [{"sequence": self.air(drone, lane, depth), "when": self.condition()}]

    def left_early(self, drone: str, lane: int, depth: int) -> Steps:
        steps = [*self.leg(drone, lane), {"break_if": self.condition()}, *self.air(drone, lane, depth)]
        return [{"repeat": 3, "steps": steps}]

    def while_asked(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly while people are asked; what they say is no matter."""
        text = self.new("Seen")
        ask = {"ask": f"{text}?", "of": ["watcher"], "timeout": "3 min", "ignore_failure": True}
        return [{"parallel": [{"sequence": self.air(drone, lane, depth)}, ask]}]

    def first_of_two(self, drone: str, lane: int, depth: int) -> Steps:
        """Wait in the air for an answer or for some time, whichever comes first."""
        text = self.new("Enough")
        ask = {"ask": f"{text}?", "of": ["watcher", "watchers"], "timeout": "5 min"}
        return [{"parallel": [ask, {"wait": "30 s"}], "need": "any"}]

    def checked_first(self, drone: str, lane: int, depth: int) -> Steps:
        first = {"sequence": [{"check": f"{drone}.battery > 90 %"}, *self.air(drone, lane, depth)]}
        return [{"fallback": [first, {"sequence": [*self.air(drone, lane, depth), *self.leg(drone, lane)]}]}]

    def collected(self, drone: str, lane: int, depth: int) -> Steps:
        said, spot, text = self.new("said"), self.new("spot"), self.new("Seen")
        ask = {"ask": f"{text} at ${{{spot}}}?", "of": ["watcher"], "timeout": "4 min", "save_as": said}
        steps = [{"do": f"{drone}.GoTo", "with": {"to": f"${{above({spot}, {self.height(lane)} m)}}"}}, ask]
        over = f"${{[{self.bare(lane)}, {self.bare(lane)}]}}"
        return [{"for": {spot: over}, "steps": steps, "collect": said}, {"notify": f"${{len({said})}} answers"}]

    def in_time(self, drone: str, lane: int, depth: int) -> Steps:
        return [{"sequence": self.air(drone, lane, depth), "timeout": "40 min"}]
