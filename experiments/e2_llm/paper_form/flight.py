"""The fleet that a program commands: the simulated agents of the experiment on the virtual clock.

There is no safety but the program's own loops, as in the paper: no layers, no clearances, no distance kept, no way home after a
failure. An action that is refused or fails aborts the task. What is flown is judged as any other flight.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Final

from agents_sim.world import SimFleet
from experiments.e2_llm.flown import Asked, Done, Flown, Machine
from experiments.e2_llm.fly import REST_S, Scene, Tape, World, place_of, specs_of
from formiga_bt.base.clock import SECOND, Micros, VirtualScheduler
from formiga_bt.base.geo import Frame, Place, Position
from formiga_bt.rehearsal.rehearsal import START
from formiga_bt.transport.memory import MemoryHub
from formiga_bt.transport.messages import TERMINAL, GoalEvent, GoalReported, GoalRequest, SendFailed

LIMIT_S: Final = 2 * 3600.0
"""A task that is not over by then is not over."""
TAKE_OFF_M: Final = 10.0
"""How high TakeOff climbs."""
MOST_CORNERS: Final = 100
FAR_M: Final = 100_000.0
"""No number is larger."""
RETURN_M: Final = 20.0
"""How high above its port a drone comes home."""
ACTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "TakeOff": ("lwd", "hwd"),
    "GoTo": ("lwd", "hwd"),
    "LandIn": ("lwd", "hwd"),
    "Explore": ("lwd",),
    "MiniFinder": ("human", "picker"),
}
"""Action -> whose."""
_WORDS: Final = {"positive": "yes", "negative": "no"}
"""What the oracles call the answers of a watcher."""
NOBODY: Final = ("", "none", "auto", "automatic", "any", "closest")
"""Preferences that are none."""


class TaskOverError(Exception):
    """The task cannot go on."""

    def __init__(self, status: str, code: str, text: str) -> None:
        super().__init__(text)
        self.status, self.code = status, code


class WrongCallError(Exception):
    """The program asked for what there is not; it is told so."""


class _Goal:
    """An action of an agent."""

    def __init__(self, number: str, agent: str, action: str, given: Any, asked_at: Micros, *, last: bool) -> None:
        self.number, self.agent, self.action, self.given, self.last = number, agent, action, given, last
        self.start: Micros = asked_at
        self.end: Micros | None = None
        self.state = "waiting"
        self.answer = ""
        self.canceling = False


class PaperFleet:
    """The agents of a scene under one program. Close it."""

    def __init__(self, world: World, scene: Scene) -> None:
        site = world.site
        self._world = world
        self._frame = Frame(site.lat, site.lng, site.ground_msl_m)
        self._scheduler = VirtualScheduler(START)
        self._hub = MemoryHub(self._scheduler)
        self._tape = Tape()
        self._fleet = SimFleet(self._scheduler, self._hub, recorder=self._tape)
        self._hub.transport.open(lambda: None)
        self._types: dict[str, str] = {}
        for spec in specs_of(world, scene):
            self._fleet.add(spec)
            self._types[spec.id] = spec.type
        self._homes = {one.id: place_of(world, one.home) for one in site.agents.values() if one.home}
        self._goals: dict[str, _Goal] = {}
        self._busy: dict[str, _Goal] = {}
        self._next: dict[str, _Goal] = {}
        self._assigned: set[str] = set()
        self._news: dict[str, dict[str, Any]] = {}
        self._pass(self._scheduler.now() + SECOND)
        self._zero = self._scheduler.now()

    def close(self) -> None:
        """Stop the simulated fleet."""
        self._fleet.close()

    def answer(self, question: Mapping[str, Any]) -> dict[str, Any]:
        """Answer a question of the program.

        Raises:
            TaskOverError: the task ended by it.
            WrongCallError: there is no such thing.
        """
        do = question.get("do")
        try:
            if do == "select":
                return self._select(str(question["preference"]), question["near"], list(map(str, question["types"])))
            if do == "goal":
                return self._order(question)
            if do == "confirm":
                return self._confirm()
            if do == "wait":
                return self._wait(question["until_s"])
            if do == "cartesian":
                lat, lng, alt = (_number(one) for one in question["gps"])
                if not (-90 <= lat <= 90 and -180 <= lng <= 180):
                    raise WrongCallError(f"{lat}, {lng} are no degrees")
                there = self._frame.place(lat, lng)
                return {"point": [there.east_m, there.north_m, alt]}
            if do == "port":
                return {"point": [*self._home(str(question["name"])), RETURN_M]}
            if do == "base":
                return {"gps": [self._world.site.lat, self._world.site.lng, 0.0]}
        except (LookupError, TypeError, ValueError, ArithmeticError) as error:
            raise WrongCallError(f"the call cannot be read: {error}") from error
        raise WrongCallError(f"there is no {do}")

    def flown(self, status: str, code: str = "", reason: str = "") -> Flown:
        """Let what is under way end, and return what was flown."""
        ended = self._scheduler.now()
        self._next.clear()
        with suppress(TaskOverError):  # the task is over already; one action more has failed
            self._pass(ended + round(REST_S * SECOND), until_idle=True)
        self._pass(self._scheduler.now() + 2 * SECOND)
        until = self._scheduler.now()
        return Flown(
            status=status,
            code=code,
            reason=reason,
            end_s=self._s(ended),
            machines={
                name: Machine(id=name, type=self._types[name], home=home, way=self._tape.way(name, self._zero, until))
                for name, home in self._homes.items()
            },
            people={name: kind for name, kind in self._types.items() if name not in self._homes},
            asked=tuple(
                Asked(
                    at_s=self._s(one.start),
                    people=(one.agent,),
                    text="generic interaction",
                    options=("positive", "negative"),
                    answer=_WORDS.get(one.answer, one.answer),
                    answered_s=self._s(one.end) if one.end is not None and one.answer else None,
                )
                for one in self._goals.values()
                if one.action == "Confirm"
            ),
            done=tuple(
                Done(
                    agent=one.agent,
                    action=one.action,
                    start_s=self._s(one.start),
                    end_s=None if one.end is None else self._s(one.end),
                    state=one.state,
                )
                for one in self._goals.values()
                if one.action != "Confirm"
            ),
            crashes=len(self._tape.verdict(until).crashes),
            places={name: (at.east_m, at.north_m) for name, at in self._world.site.places.items()},
        )

    # -- what the program asks -------------------------------------------------------------------------------------------

    def _select(self, preference: str, near: Any, types: list[str]) -> dict[str, Any]:
        free = [one for one in self._homes if one not in self._assigned and self._types[one] in types]
        if preference.strip().lower() not in NOBODY:
            free = [one for one in free if one == preference]
        if not free:
            raise TaskOverError("FAILED", "no_agent", f"no {preference or ' or '.join(types)} is on STANDBY")
        where = [_number(one) for one in near][:2] if near else [0.0, 0.0]
        chosen = min(free, key=lambda one: (math.dist(self._at(one), where), one))
        self._assigned.add(chosen)
        return {"name": chosen, "type": self._types[chosen]}

    def _order(self, question: Mapping[str, Any]) -> dict[str, Any]:
        name, kind, action = str(question["name"]), str(question["type"]), str(question["action"])
        mine = self._types.get(name, "")
        is_his = kind == mine or (kind == "human" and name not in self._homes)
        if not mine or not is_his or kind not in ACTIONS.get(action, ()):
            raise WrongCallError(f"there is no action server /{kind}/{name}/action/{action}")
        given = question.get("given")
        if action == "GoTo":
            given = [_number(given[i]) for i in range(3)]
        elif action == "Explore":
            if not 3 <= len(given) <= MOST_CORNERS:
                raise WrongCallError(f"a region has 3 to {MOST_CORNERS} corners, not {len(given)}")
            given = [[_number(corner[i]) for i in range(3)] for corner in given]
        return {"id": self._take(name, action, given, last=bool(question.get("last"))).number}

    def _confirm(self) -> dict[str, Any]:
        watchers = [one for one, kind in self._types.items() if kind == "watcher"]
        if not watchers:
            raise TaskOverError("FAILED", "no_agent", "there is no watcher")
        asked = {
            "question": "Do you confirm?", "options": ["positive", "negative"], "note": "", "number": False,
            "expires_us": 0, "if_no_answer": "",
        }  # fmt: skip
        return {"id": self._take(watchers[0], "Confirm", asked).number}

    def _wait(self, until_s: Any) -> dict[str, Any]:
        limit = self._zero + round(LIMIT_S * SECOND)
        if until_s is None and not self._busy and not self._news:
            raise TaskOverError("UNFINISHED", "deadlock", "every thread waits for something that never comes")
        until = limit if until_s is None else min(limit, self._zero + round(_number(min(until_s, LIMIT_S)) * SECOND))
        if not self._news:
            self._pass(until, until_news=True)
        if self._scheduler.now() >= limit and not self._news:
            raise TaskOverError("UNFINISHED", "too_long", f"it was not over after {LIMIT_S / 3600:g} h")
        done, self._news = self._news, {}
        return {"now_s": self._s(self._scheduler.now()), "done": done}

    # -- goals -----------------------------------------------------------------------------------------------------------

    def _take(self, agent: str, action: str, given: Any, *, last: bool = False) -> _Goal:
        """Take a goal; one that runs is preempted, as a ROS action server does it. People answer all that they are asked."""
        goal = _Goal(f"goal_{len(self._goals) + 1}", agent, action, given, self._scheduler.now(), last=last)
        self._goals[goal.number] = goal
        running = self._busy.get(agent) if agent in self._homes else None
        if running is None:
            self._send(goal)
            return goal
        waiting = self._next.get(agent)
        if waiting is not None:
            self._end(waiting, "canceled")
        self._next[agent] = goal
        if not running.canceling:
            running.canceling = True
            self._hub.transport.cancel_goal(agent, running.number)
        return goal

    def _send(self, goal: _Goal) -> None:
        goal.start, goal.state = self._scheduler.now(), "running"
        self._busy[goal.agent if goal.agent in self._homes else goal.number] = goal
        fields = self._fields(goal)
        self._hub.transport.send_goal(
            GoalRequest(
                goal_id=goal.number, agent=goal.agent, action=goal.action, fields=fields, epoch=1, task_id="task"
            )
        )

    def _fields(self, goal: _Goal) -> dict[str, Any]:
        if goal.action == "TakeOff":
            return {"altitude": TAKE_OFF_M}
        if goal.action == "LandIn":
            east, north = self._at(goal.agent)
            return {"at": {"east_m": east, "north_m": north}}
        if goal.action == "GoTo":
            return {"to": {"east_m": goal.given[0], "north_m": goal.given[1], "up_m": goal.given[2]}}
        if goal.action == "MiniFinder":  # the paper's API has one base station: the origin
            return {"base": {"east_m": 0.0, "north_m": 0.0}}
        if goal.action == "Explore":
            corners = [{"east_m": one[0], "north_m": one[1]} for one in goal.given]
            return {"region": corners, "altitude": goal.given[0][2] if goal.given else 0.0}
        return goal.given if isinstance(goal.given, dict) else {}

    def _heard(self, event: GoalEvent) -> None:
        goal = self._goals.get(event.goal_id)
        if goal is None or event.state not in TERMINAL or goal.end is not None:
            return
        self._end(goal, event.state, event.result)
        if event.state not in ("succeeded", "canceled") or (event.state == "canceled" and not goal.canceling):
            what = f"{goal.action} of {goal.agent} was {event.state}" + (f" ({event.code})" if event.code else "")
            raise TaskOverError("FAILED", "aborted", what)
        following = self._next.pop(goal.agent, None)
        if following is not None:
            self._send(following)

    def _end(self, goal: _Goal, state: str, result: Mapping[str, Any] | None = None) -> None:
        goal.end, goal.state = self._scheduler.now(), state
        self._busy.pop(goal.agent if goal.agent in self._homes else goal.number, None)
        said: dict[str, Any] = {"result": state == "succeeded"}
        if goal.action == "Confirm" and result:
            goal.answer = str(result.get("answer", ""))
            said = {"result": goal.answer}
        elif goal.action == "MiniFinder" and result:
            there = result["go_to"]
            gps = self._frame.lat_lng(Place(there["east_m"], there["north_m"]))
            said = {"result": True, "in_range": bool(result["in_range"]), "go_to": [*gps, 0.0]}
        self._news[goal.number] = said
        if goal.last:
            self._assigned.discard(goal.agent)

    # -- time ------------------------------------------------------------------------------------------------------------

    def _pass(self, until: Micros, *, until_news: bool = False, until_idle: bool = False) -> None:
        """Let time pass up to an instant, or until an action ended, or until none is under way."""
        while True:
            for event in self._hub.transport.poll():
                if isinstance(event, GoalReported):
                    self._heard(event.event)
                elif isinstance(event, SendFailed) and event.what == "goal":
                    raise TaskOverError("FAILED", "aborted", f"{event.agent} cannot be reached: {event.text}")
            if (until_news and self._news) or (until_idle and not self._busy):
                return
            due = self._scheduler.next_time()
            if due is None or due > until:
                break
            self._scheduler.run_next()
        self._scheduler.advance_to(until)

    def _s(self, at: Micros) -> float:
        return (at - self._zero) / SECOND

    def _at(self, name: str) -> tuple[float, float]:
        here: Position = self._fleet[name].body.position()
        return (here.east_m, here.north_m)

    def _home(self, name: str) -> tuple[float, float]:
        if name not in self._homes:
            raise WrongCallError(f"{name} has no landing port")
        return self._homes[name]


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise WrongCallError(f"not a finite number: {str(value)[:40]}")
    if abs(value) > FAR_M:
        raise WrongCallError(f"{value:g} is too far away")
    return float(value)
