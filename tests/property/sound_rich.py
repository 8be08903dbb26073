"""Good tasks by seed that are made of more of the language than those of `sound`: races, forms, lists, records, failures that
carry values, resources, rates, windows of the day, targets that move.

The tasks of `sound` stay as they are, seed by seed; these have their pieces, too.
"""

from random import Random
from typing import Any

from tests.property.sound import Good
from tests.property.sound_kinds import Steps


class Rich(Good):
    """Writes one task."""

    records: dict[str, Any] | None = None
    error: Steps | None = None

    def air(self, drone: str, lane: int, depth: int) -> Steps:
        """Return some steps that begin and end in the air."""
        if depth and self.dice.random() < 0.6:
            pieces = (
                self.raced, self.raced_events, self.retried, self.first_seen, self.by_distance, self.paired, self.chosen,
                self.grown, self.best_of, self.carried, self.quickly, self.in_window, self.followed, self.watched_while,
                self.drawn, self.asked_form, self.counted_down, self.nested_lists, self.wanted,
            )  # fmt: skip
            return self.dice.choice(pieces)(drone, lane, depth - 1)
        return super().air(drone, lane, depth)

    def ground(self, drone: str) -> Steps:
        """Return steps for a drone that stands."""
        if self.dice.random() < 0.5:
            return self.dice.choice((self.resource, self.filled_in, self.told_why, self.waited, self.tried))(drone)
        return super().ground(drone)

    def file(self, steps: Steps) -> dict[str, Any]:
        """Return the whole file."""
        for role in self.agents.values():
            if "count" not in role and role.get("type") != "picker" and self.dice.random() < 0.05:
                role["if_lost"] = "rebind"
        file = super().file(steps)
        if self.records:
            file = {"formiga": 1, "task": "Good", "records": self.records} | file
        if self.dice.random() < 0.15:
            file |= {"priority": "high"}
        elif self.dice.random() < 0.2:
            file |= {
                "priority": self.dice.choice(("low", "medium")),
                "if_preempted": self.dice.choice(("restart", "fail")),
            }
        if self.dice.random() < 0.2:
            file["timeout"] = "20 h"
        if self.dice.random() < 0.15:
            file["on_abort"] = [{"notify": "It was ended: ${abort.reason}", "when": "abort.reason == 'operator'"}]
        if self.error and "on_failure" not in file:
            file["on_failure"] = self.error
        return file

    # --- at the same time --------------------------------------------------------------------------------------------

    def raced(self, drone: str, lane: int, depth: int) -> Steps:
        """Look whichever comes first: an answer, the time, or too little charge."""
        ask = {"ask": f"{self.new('Race')}?", "of": ["watcher"], "timeout": "20 min"}
        branches: Steps = [
            {"sequence": [ask, {"notify": f"{self.new('Said')}."}]},
            {"wait": f"{self.dice.randint(5, 40)} s"},
        ]
        if self.dice.random() < 0.5:
            branches.append({"repeat": "forever", "every": "15 s", "steps": [{"notify": f"{self.new('Still')}."}]})
        return [{"race": branches}]

    def raced_events(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly on until a picker calls, at most for some rounds."""
        self.agents["picker"] = {"type": "picker", "near": "${target}"}
        call = self.new("call")
        watch = {"wait_for": "picker.sos", "timeout": "30 min", "save_as": call}
        rounds = {"repeat": 2, "steps": [*self.air(drone, lane, 0), {"wait": "3 s"}]}
        return [{"race": [watch, rounds]}, {"notify": f"Called at ${{{call}.at}}", "when": f"is_set({call})"}]

    def watched_while(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly under a condition; what comes of it is told."""
        guard = {"guard": f"{drone}.battery > 20 % and {drone}.airborne", "steps": self.air(drone, lane, depth)}
        return [{"fallback": [guard, {"sequence": [{"notify": "It stops: ${error.code}"}, *self.leg(drone, lane)]}]}]

    # --- again -------------------------------------------------------------------------------------------------------

    def retried(self, drone: str, lane: int, depth: int) -> Steps:
        """Try a flight again after some failures, or after all but some."""
        which = self.dice.choice(({"on": ["blocked", "timeout"]}, {"unless": ["rejected"]}, {"backoff": 2}))
        retry = {"attempts": self.dice.randint(2, 4), "delay": "5 s", **which}
        if self.dice.random() < 0.5:
            retry["attempt_timeout"] = "9 min"
        return [{**self.leg(drone, lane)[0], "timeout": "40 min", "retry": retry}]

    def quickly(self, drone: str, lane: int, depth: int) -> Steps:
        """Look again and again at a rate."""
        every = self.dice.choice(("500 ms", "1 s", "15 s"))
        loop = {"repeat": "30 s", "every": every, "steps": [{"break_if": f"{drone}.battery < 30 %"}]}
        return [loop, *self.air(drone, lane, 0)]

    def counted_down(self, drone: str, lane: int, depth: int) -> Steps:
        """Go round until a number is reached that the rounds make."""
        left = self.new("left")
        self.vars[left] = self.dice.randint(2, 3)
        steps = [*self.air(drone, lane, depth), {"set": {left: f"${{{left} - 1}}"}}, {"break_if": f"{left} <= 0"}]
        return [{"repeat": "forever", "every": "5 s", "steps": steps, "max": 9}]

    def in_window(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly in a part of the day, which is all of it."""
        self.params |= {
            "opens": {"type": "time", "default": "00:00"},
            "closes": {"type": "time", "default": "23:59"},
        }
        cond = self.dice.choice(
            ("now >= opens and now < closes", "not (now < opens or now >= closes)", "opens <= now < closes")
        )
        return [{"if": cond, "then": self.air(drone, lane, depth)}]

    # --- lists -------------------------------------------------------------------------------------------------------

    def list_of(self, lane: int, number: int = 2) -> str:
        """Return a var that holds some places."""
        name = self.new("way")
        self.vars[name] = f"${{[{', '.join(self.bare(lane) for _ in range(number))}]}}"
        return name

    def over(self, drone: str, lane: int, over: str) -> Steps:
        """Fly over each place of a list."""
        spot = self.new("spot")
        to = f"${{above({spot}, {self.height(lane)} m)}}"
        return [{"for": {spot: f"${{{over}}}"}, "steps": [{"do": f"{drone}.GoTo", "with": {"to": to}}]}]

    def by_distance(self, drone: str, lane: int, depth: int) -> Steps:
        way = self.list_of(lane, 3)
        how = self.dice.choice((
            f"sort({way}, by=distance(item, base))", f"reverse({way})", f"shuffle({way}, {self.dice.randint(0, 9)})",
            f"where({way}, distance(item, base) >= 0.5 m)", f"concat({way}, [{way}[0]])", f"append({way}, last({way}))",
        ))  # fmt: skip
        return self.over(drone, lane, how)

    def paired(self, drone: str, lane: int, depth: int) -> Steps:
        """Go over neighbours in a list."""
        way, i = self.list_of(lane, 3), self.new("i")
        number = self.dice.choice((f"range(len({way}) - 1)", "range(2)"))
        to = f"${{above(midpoint({way}[{i}], {way}[{i} + 1]), {self.height(lane)} m)}}"
        return [{"for": {i: f"${{{number}}}"}, "steps": [{"do": f"{drone}.GoTo", "with": {"to": to}}]}]

    def chosen(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly to the best of a choice, if there is one."""
        way, far = self.list_of(lane, 3), self.new("far")
        self.vars[far] = f"${{where({way}, distance(item, base) > 100 m)}}"
        to = f"${{above(first({far}), {self.height(lane)} m)}}"
        return [{"do": f"{drone}.GoTo", "with": {"to": to}, "when": f"len({far}) > 0"}]

    def wanted(self, drone: str, lane: int, depth: int) -> Steps:
        """Look for the number of an item, -1 for none."""
        way, best, i = self.list_of(lane, 3), self.new("best"), self.new("i")
        self.vars[best] = -1
        look = {"set": {best: f"${{{i}}}"}, "when": f"distance({way}[{i}], base) > 60 m"}
        to = f"${{above({way}[{best}], {self.height(lane)} m)}}"
        return [
            {"for": {i: f"${{range(len({way}))}}"}, "steps": [look]},
            {"do": f"{drone}.GoTo", "with": {"to": to}, "when": f"{best} >= 0"},
        ]

    def nested_lists(self, drone: str, lane: int, depth: int) -> Steps:
        """Go over lists of lists of places."""
        ways, way = self.new("ways"), self.new("each")
        self.vars[ways] = f"${{[[{self.bare(lane)}], [{self.bare(lane)}, {self.bare(lane)}]]}}"
        return [{"for": {way: f"${{{ways}}}"}, "steps": self.over(drone, lane, way)}]

    def first_seen(self, drone: str, lane: int, depth: int) -> Steps:
        """Ask about some places at once, and go on with the first that somebody says yes of."""
        said, spot, text = self.new("said"), self.new("spot"), self.new("Seen")
        ask = {
            "ask": f"{text} at ${{{spot}}}?", "of": ["watcher"], "timeout": "4 min", "save_as": said,
            "expect": "result.answer == 'yes'",
        }  # fmt: skip
        loop = {"for": {spot: f"${{{self.list_of(lane)}}}"}, "mode": "parallel", "first": said, "steps": [ask]}
        return [{**loop, "ignore_failure": True}, {"notify": f"${{{said}.by}} said so.", "when": f"is_set({said})"}]

    def drawn(self, drone: str, lane: int, depth: int) -> Steps:
        """Leave something to chance that a replay draws again."""
        cond = f"random({self.dice.randint(0, 99)}) < 0.5"
        return [{"if": cond, "then": self.leg(drone, lane), "else": self.air(drone, lane, depth)}]

    # --- records and failures ----------------------------------------------------------------------------------------

    def grown(self, drone: str, lane: int, depth: int) -> Steps:
        """Keep what is found in a list that grows."""
        self.records = {"find": {"spot": "place", "score": "number"}}
        finds, way, spot = self.new("finds"), self.list_of(lane), self.new("spot")
        self.vars[finds] = f"${{{self.known()}}}"
        add = {"call": "Found", "with": {"at": f"${{{spot}}}"}, "save_as": self.new("here")}
        self.subtrees["Found"] = {
            "params": {"at": "place"},
            "steps": [{"wait": "1 s"}],
            "returns": {"spot": "${at}", "score": "${distance(at, base) / 1 m}"},
        }
        grow = {"set": {finds: f"${{append({finds}, {add['save_as']})}}"}}
        best = f"${{above(last(sort({finds}, by=item.score)).spot, {self.height(lane)} m)}}"
        return [
            {"for": {spot: f"${{{way}}}"}, "steps": [add, grow]},
            {"notify": f"${{count({finds}, item.score > 10)}} of ${{len({finds})}}"},
            {"do": f"{drone}.GoTo", "with": {"to": best}, "when": f"len({finds}) > 0"},
        ]

    def known(self) -> str:
        """Return a param that holds finds."""
        self.params["known"] = {"type": {"list": "find"}, "default": []}
        return "known"

    def best_of(self, drone: str, lane: int, depth: int) -> Steps:
        """Keep the highest of some numbers."""
        most, way, spot = self.new("most"), self.list_of(lane, 3), self.new("spot")
        self.vars[most] = "${0 m}"
        keep = {"set": {most: f"${{max({most}, distance({spot}, base))}}"}}
        told = {"notify": f"At most ${{{most}}} away.", "when": f"{most} > 100 m"}
        return [{"for": {spot: f"${{{way}}}"}, "steps": [keep]}, told, *self.air(drone, lane, 0)]

    def carried(self, drone: str, lane: int, depth: int) -> Steps:
        """Fail with values, and read them where the failure is caught."""
        code, count = self.new("code"), self.dice.randint(1, 9)
        fail = {"fail": "Not seen.", "code": code, "with": {"seen": count}}
        try_ = {"sequence": [*self.air(drone, lane, 0), {"if": f"{drone}.battery < 20 %", "then": [fail]}]}
        told = {"notify": f"Only ${{error.data.seen}} ({code}).", "when": "is_set(error.data.seen)"}
        known = {"notify": "It was that.", "when": f"error.code == 'failed:{code}'"}
        return [{"fallback": [try_, {"sequence": [told, known, *self.leg(drone, lane)]}]}]

    def followed(self, drone: str, lane: int, depth: int) -> Steps:
        """Fly to a picker who may walk on."""
        self.agents["picker"] = {"type": "picker", "near": "${target}"}
        to = f"${{above(offset(ground(picker.position), east={30 + 25 * lane} m), {self.height(lane)} m)}}"
        return [
            {"do": f"{drone}.GoTo", "with": {"to": to}, "track": {"every": "2 s", "within": "3 m"}, "timeout": "10 min"}
        ]

    # --- people ------------------------------------------------------------------------------------------------------

    def form(self) -> dict[str, Any]:
        """Return some fields of a form."""
        found = {"nests": {"type": "int", "min": 0, "max": 20}, "ground": {"type": "enum", "values": ["dry", "wet"]}}
        return found if self.dice.random() < 0.5 else {"nests": found["nests"]}

    def asked_form(self, drone: str, lane: int, depth: int) -> Steps:
        """Ask for numbers while the drone is in the air, and do without."""
        said = self.new("said")
        ask = {
            "ask": f"{self.new('Nests')}?", "of": ["watcher"], "timeout": "3 min", "form": self.form(), "save_as": said,
            "ignore_failure": True,
        }  # fmt: skip
        more = self.dice.choice((f"is_set({said}) and {said}.nests > 3", f"is_set({said}) and 1 <= {said}.nests < 20"))
        return [ask, {"if": more, "then": self.air(drone, lane, 0)}]

    def filled_in(self, drone: str) -> Steps:
        said = self.new("said")
        ask = {
            "ask": f"{self.new('Nests')}?", "of": ["watcher", "watchers"], "options": ["some", "none"], "form": self.form(),
            "timeout": "10 min", "save_as": said,
        }  # fmt: skip
        cases = {"some": [{"notify": f"${{{said}.nests}} nests."}], "none": [{"wait": "2 s"}]}
        switch = {"switch": f"{said}.answer", "cases": cases}
        by_number = {"switch": f"{said}.nests", "cases": {0: [{"wait": "1 s"}], 20: [{"notify": "Many."}]}}
        return [ask, switch if self.dice.random() < 0.5 else {**by_number, "default": [{"notify": "Some."}]}]

    def told_why(self, drone: str) -> Steps:
        """Go on after a question that fails, and say why it did."""
        ask = {
            "ask": f"{self.new('Loaded')} (why)?",
            "of": ["watcher"],
            "timeout": "5 min",
            "expect": "result.answer == 'yes'",
        }
        codes = self.dice.choice(
            ("error.code == 'timeout'", "error.code in ['timeout', 'expect']", "error.code != 'expect'")
        )
        return [{"fallback": [ask, {"notify": "Nobody: ${error.code}", "when": codes}, {"notify": "No."}]}]

    def tried(self, drone: str) -> Steps:
        ask = {"ask": f"{self.new('Loaded')} (again)?", "of": ["watcher"], "timeout": "20 min"}
        retry = {"attempts": 3, "delay": "2 min", "attempt_timeout": "4 min", "on": ["timeout", "expect"]}
        return [{**ask, "expect": "result.answer == 'yes'", "retry": retry}]

    def waited(self, drone: str) -> Steps:
        cond = self.dice.choice((f"{drone}.battery > 10 %", f"not {drone}.airborne", "now > today('00:01')"))
        return [{"race": [{"wait_until": cond, "timeout": "30 min"}, {"wait": "20 min"}]}]

    def resource(self, drone: str) -> Steps:
        """Take something that there is only so much of."""
        what = self.dice.choice(("bridge", ["lift_1"], [{"dock_bay": 2}, "bridge"]))
        block: dict[str, Any] = {"with_resource": what, "steps": [{"wait": "15 s"}, {"notify": f"{self.new('Over')}."}]}
        return [{**block, "wait": "10 min"} if self.dice.random() < 0.5 else block]


def rich_task(seed: int) -> str:
    """Return the good task of a seed."""
    return Rich(Random(seed)).task()
