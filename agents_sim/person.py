"""A simulated person: stands or walks, answers questions by a script, after a while, or never, and carries a tracker.

A question is a Confirm goal with the fields question, options, note, number, expires_us, if_no_answer; its result is
`{answer, by, at}`. Without a fitting rule a person says yes: `clear` to a clearance, else the first option that agrees.
A person walks in steps of a second of engine time. A picker answers MiniFinder too (`finder`).

Called from one thread, like every `AgentBody`.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from msgspec import Struct

from agents_sim.finder import Finder, Sight, sees_nothing
from agents_sim.limits import PersonLimits
from agents_sim.motion import NoRecorder, PersonState, Recorder
from formiga_bt.base.clock import SECOND, Micros, Scheduler, Timer, micros
from formiga_bt.base.geo import Frame, Place, Position, horizontal_m, mm
from formiga_bt.transport.agent_side import CONFIRM, AgentSide
from formiga_bt.transport.messages import GoalRequest

CLEARANCE_OPTIONS: Final = frozenset({"clear", "wait", "refuse"})
AFFIRMATIVE: Final = frozenset(
    {"yes", "ok", "okay", "clear", "loaded", "done", "ready", "accept", "confirm", "approve"}
)
DEFAULT_DELAY_US: Final[Micros] = 3 * SECOND
STEP_US: Final[Micros] = SECOND
MINI_FINDER: Final = "MiniFinder"
"""The action by which the tracker of a person is asked."""


class Rule(Struct, frozen=True):
    """How a person answers the questions that fit.

    `match` is found in the question or in one of its options ("*": always). `options` are the successive answers, the
    last one again and again. A rule whose next answer is no option of the question is passed over.
    """

    match: str = "*"
    options: tuple[str, ...] = ()
    after_us: Micros = DEFAULT_DELAY_US
    never: bool = False
    """Such questions are never answered."""


class BadScriptError(ValueError):
    """A person's script cannot be read."""


def read_rules(script: Iterable[Mapping[str, Any]]) -> tuple[Rule, ...]:
    """Read rules from plain data; `after` is seconds, as a number or as text such as "4 s".

    Raises:
        BadScriptError: a rule has an unknown key, or neither options nor `never`.
    """
    rules = []
    for entry in script:
        unknown = sorted(set(entry) - {"match", "options", "after", "never"})
        if unknown:
            raise BadScriptError(f"unknown {', '.join(unknown)} in {dict(entry)}; known: match, options, after, never")
        options, never = tuple(str(option) for option in entry.get("options", ())), bool(entry.get("never", False))
        if not options and not never:
            raise BadScriptError(f"a rule needs options or never: {dict(entry)}")
        after_us = _read_delay(entry["after"]) if "after" in entry else DEFAULT_DELAY_US
        rules.append(Rule(str(entry.get("match", "*")), options, after_us, never))
    return tuple(rules)


def _read_delay(value: Any) -> Micros:
    text = str(value).strip()
    units = (("ms", 0.001), ("min", 60.0), ("s", 1.0), ("h", 3600.0), ("", 1.0))
    unit, factor = next(pair for pair in units if text.endswith(pair[0]))
    text = text.removesuffix(unit)
    try:
        delay = micros(float(text) * factor)
    except (ValueError, OverflowError) as error:
        raise BadScriptError(f"after must be a time such as 4 s, got {value!r}") from error
    if delay < 0:
        raise BadScriptError(f"after must not be negative, got {value!r}")
    return delay


class Person:
    """The body of one person (an `AgentBody`). Call `attach` with its side before anything else."""

    def __init__(
        self,
        agent: str,
        scheduler: Scheduler,
        place: Place,
        rules: tuple[Rule, ...] = (),
        recorder: Recorder | None = None,
        *,
        tracked: bool = False,
        walk: Sequence[Place] = (),
        limits: PersonLimits | None = None,
        sight: Sight = sees_nothing,
        frame: Frame | None = None,
    ) -> None:
        self.agent = agent
        self.actions = (CONFIRM, MINI_FINDER) if tracked else (CONFIRM,)
        self.limits = limits or PersonLimits()
        self.asked: list[str] = []
        """The questions heard, in order: for tests and demos."""
        self.confirms_cancel = True
        self._scheduler = scheduler
        self._rules = rules
        self._given: list[int] = [0] * len(rules)
        self._recorder: Recorder = recorder or NoRecorder()
        self._side: AgentSide | None = None
        self._answers: dict[str, Timer] = {}
        self._finder = Finder(agent, self.limits, sight)
        self._frame = frame
        self._place = place
        self._walk = list(walk)
        self.stand_at(place)
        if self._walk:
            self._scheduler.call_at(self._scheduler.now() + STEP_US, self._step)

    def attach(self, side: AgentSide) -> None:
        """Take the side that speaks for this person."""
        self._side = side
        self._set_status()

    def resume(self) -> None:
        """Go on after a new start (nobody but the person is in command)."""

    def stand_at(self, place: Place) -> None:
        """Stand at another place from now on."""
        self._place = place
        self._recorder.person_at(self.agent, self._scheduler.now(), place)
        self._set_status()

    def position(self) -> Position:
        """Return where the person stands."""
        return Position(self._place.east_m, self._place.north_m, 0.0)

    def state(self) -> PersonState:
        """Return where the person is on the way, to be kept."""
        return PersonState(self._place, tuple(self._walk))

    def start(self, request: GoalRequest) -> str:
        """Hear a question and think about it; let the tracker find where it is."""
        if request.action == MINI_FINDER:
            at, goal, search = self._scheduler.now() + micros(self.limits.fix_takes_s), request.goal_id, request.task_id
            self._answers[goal] = self._scheduler.call_at(at, lambda: self._tell_place(goal, search))
            return ""
        if request.action != CONFIRM:
            return "unknown_action"
        question = str(request.fields.get("question", ""))
        options = [str(option) for option in request.fields.get("options") or ("yes", "no")]
        self.asked.append(question)
        answer, after_us = self._choose(question, options)
        if answer is not None:
            at, goal, said = self._scheduler.now() + after_us, request.goal_id, answer
            self._answers[goal] = self._scheduler.call_at(at, lambda: self._say(goal, said))
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Forget a question that was withdrawn."""
        timer = self._answers.pop(goal_id, None)
        if timer is not None:
            timer.cancel()
        if self._side is not None and self.confirms_cancel:
            self._side.finish(goal_id, "canceled")
        return True

    def tell(self, event: str) -> None:
        """Tell an event of its own, without fields."""
        if self._side is not None:
            self._side.report_event(event)

    def report(self) -> None:
        """Publish the status."""
        if self._side is not None:
            self._set_status()
            self._side.publish_status()

    def stop(self) -> None:
        """Forget all questions, without a word to anyone."""
        for timer in self._answers.values():
            timer.cancel()
        self._answers.clear()

    def shift(self, by: Micros) -> None:  # noqa: ARG002  (a body's)
        """Follow a jump of engine time: note again, in the new time, where the person stands."""
        self._recorder.person_at(self.agent, self._scheduler.now(), self._place)

    def _choose(self, question: str, options: list[str]) -> tuple[str | None, Micros]:
        """Return the answer (None: never) and how long it takes."""
        for index, rule in enumerate(self._rules):
            if rule.match != "*" and not any(rule.match in text for text in (question, *options)):
                continue
            if rule.never:
                return None, 0
            answer = rule.options[min(self._given[index], len(rule.options) - 1)]
            if answer in options:
                self._given[index] += 1
                return answer, rule.after_us
        if "clear" in options and CLEARANCE_OPTIONS.issuperset(options):
            return "clear", DEFAULT_DELAY_US
        return next((option for option in options if option.lower() in AFFIRMATIVE), options[0]), DEFAULT_DELAY_US

    def _say(self, goal_id: str, answer: str) -> None:
        self._answers.pop(goal_id, None)
        if self._side is not None:
            result = {"answer": answer, "by": self.agent, "at": self._scheduler.now()}
            self._side.finish(goal_id, "succeeded", result=result)

    def _tell_place(self, goal_id: str, search: str) -> None:
        self._answers.pop(goal_id, None)
        if self._side is not None:
            self._side.finish(goal_id, "succeeded", result=self._finder.answer(self._place, search))

    def _step(self) -> None:
        """Walk for one second, then again, until the way ends."""
        left_m = self.limits.walk_m_s * STEP_US / SECOND
        here = self._place
        while self._walk and left_m > 0.0:
            to = self._walk[0]
            leg_m = horizontal_m(here, to)
            if leg_m <= left_m:
                here, left_m = self._walk.pop(0), left_m - leg_m
                continue
            share, left_m = left_m / leg_m, 0.0
            here = Place(
                mm(here.east_m + share * (to.east_m - here.east_m)),
                mm(here.north_m + share * (to.north_m - here.north_m)),
            )
        self.stand_at(here)
        if self._walk:
            self._scheduler.call_at(self._scheduler.now() + STEP_US, self._step)

    def _set_status(self) -> None:
        if self._side is not None:
            here = self.position()
            lat, lng = self._frame.lat_lng(here) if self._frame is not None else (None, None)
            self._side.set_status(position=here, landed="grounded", lat=lat, lng=lng)


def write_rules(rules: Iterable[Rule]) -> list[dict[str, Any]]:
    """Return rules as the plain data `read_rules` reads (for a process's command line)."""
    return [
        {"match": rule.match, "options": list(rule.options), "after": rule.after_us / SECOND, "never": rule.never}
        for rule in rules
    ]
