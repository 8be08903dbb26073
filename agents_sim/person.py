"""A simulated person: stands or walks, answers questions by a script, after a while, or never, and carries a tracker.

A question is a Confirm goal with the fields question, options, note, number, expires_us, if_no_answer, form; its result is
`{answer, by, at, form}`. Without a fitting rule a person says yes: `clear` to a clearance, else the first option that agrees.
Of a form that no rule fills in they give the least that is allowed, and as a place where they stand.
A person walks in steps of a second of engine time. A picker answers MiniFinder too (`finder`), and then walks after the drone
that guides them (`following`).

Called from one thread, like every `AgentBody`.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from msgspec import Struct

from agents_sim.body import Body, Setup
from agents_sim.finder import Finder
from agents_sim.following import Follower
from agents_sim.kinds import Outcome, SimAction, lasts_us
from agents_sim.limits import PersonLimits
from agents_sim.motion import BadFieldError, PersonState, read_place
from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND, Micros, Timer, micros
from formiga_bt.base.geo import Frame, Place, Position, horizontal_m, mm
from formiga_bt.transport.messages import GoalRequest

CLEARANCE_OPTIONS: Final = frozenset({"clear", "wait", "refuse"})
AFFIRMATIVE: Final = frozenset(
    {"yes", "ok", "okay", "clear", "loaded", "done", "ready", "accept", "confirm", "approve"}
)
DEFAULT_DELAY_US: Final[Micros] = 3 * SECOND
STEP_US: Final[Micros] = SECOND
MINI_FINDER: Final = "MiniFinder"
"""The action by which the tracker of a person is asked."""


KNOWN: Final = ("match", "options", "after", "never", "form")
"""Keys of a rule."""


class Rule(Struct, frozen=True):
    """How a person answers the questions that fit.

    `match` is found in the question or in one of its options ("*": always). `options` are the successive answers, the
    last one again and again; with none a person says what they would say without a rule. A rule whose next answer is no
    option of the question is passed over.
    """

    match: str = "*"
    options: tuple[str, ...] = ()
    after_us: Micros = DEFAULT_DELAY_US
    never: bool = False
    """Such questions are never answered."""
    form: Mapping[str, Any] = {}
    """What is filled in, by name, as wire values."""


class BadScriptError(ValueError):
    """A person's script cannot be read."""


def read_rules(script: Iterable[Mapping[str, Any]]) -> tuple[Rule, ...]:
    """Read rules from plain data; `after` is seconds, as a number or as text such as "4 s".

    Raises:
        BadScriptError: a rule has an unknown key, or none of options, form and `never`.
    """
    rules = []
    for entry in script:
        unknown = sorted(set(entry) - set(KNOWN))
        if unknown:
            raise BadScriptError(f"unknown {', '.join(unknown)} in {dict(entry)}; known: {', '.join(KNOWN)}")
        options, never = tuple(str(option) for option in entry.get("options", ())), bool(entry.get("never", False))
        form = dict(entry.get("form") or {})
        if not options and not never and not form:
            raise BadScriptError(f"a rule needs options, form or never: {dict(entry)}")
        after_us = _read_delay(entry["after"]) if "after" in entry else DEFAULT_DELAY_US
        rules.append(Rule(str(entry.get("match", "*")), options, after_us, never, form))
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


class Person(Body):
    """The body of one person. Call `attach` with its side before anything else.

    Args:
        setup: what it is made of.

    Raises:
        ValueError: the script or the limits of its spec are wrong.
    """

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        spec, state = setup.spec, setup.state
        self.limits = PersonLimits().of_type(setup.kind.limits).replaced(spec.limits)
        self.asked: list[str] = []
        """The questions heard, in order: for tests and demos."""
        self._rules = read_rules(spec.script)
        self._given: list[int] = [0] * len(self._rules)
        self._recorder = setup.recorder
        self._answers: dict[str, Timer] = {}
        self._finder = Finder(self.agent, self.limits)
        self._follower = Follower(self.limits, setup.sight)
        self._frame = Frame(*spec.base) if spec.base is not None else None
        self._seed = spec.seed
        self._place = spec.at if isinstance(spec.at, Place) else spec.at.ground
        self._walk = list(spec.walk)
        if isinstance(state, PersonState):
            self._place, self._walk = state.place, list(state.walk)
        self._walks = False
        self.stand_at(self._place)
        self._go()

    def stand_at(self, place: Place) -> None:
        """Stand at another place from now on."""
        self._place = place
        self._recorder.person_at(self.agent, self.scheduler.now(), place)
        self.set_status()

    def position(self) -> Position:
        """Return where the person stands."""
        return Position(self._place.east_m, self._place.north_m, 0.0)

    def state(self) -> PersonState:
        """Return where the person is on the way, to be kept."""
        return PersonState(self._place, tuple(self._walk))

    def start(self, request: GoalRequest) -> str:
        """Hear a question and think about it; let the tracker find where it is."""
        if request.action == MINI_FINDER:
            return self._find(request)
        if request.action != CONFIRM:
            return self._do(request)
        question = str(request.fields.get("question", ""))
        options = [str(option) for option in request.fields.get("options") or ("yes", "no")]
        self.asked.append(question)
        answer, after_us, filled = self._choose(question, options)
        if answer is not None:
            at, goal, said = self.scheduler.now() + after_us, request.goal_id, answer
            self._answers[goal] = self.scheduler.call_at(at, lambda: self._say(request, said, filled))
        return ""

    def cancel(self, goal_id: str) -> bool:
        """Forget a question that was withdrawn."""
        timer = self._answers.pop(goal_id, None)
        if timer is not None:
            timer.cancel()
        if self.side is not None and self.confirms_cancel:
            self.side.finish(goal_id, "canceled")
        return True

    def stop(self) -> None:
        """Forget all questions, without a word to anyone."""
        for timer in self._answers.values():
            timer.cancel()
        self._answers.clear()

    def shift(self, by: Micros) -> None:
        """Follow a jump of engine time: note again, in the new time, where the person stands."""
        self._follower.shift(by)
        self._recorder.person_at(self.agent, self.scheduler.now(), self._place)

    def _do(self, request: GoalRequest) -> str:
        """Do what the catalogue says: go where it moves to, else take the typical time."""
        action = self.kind.actions.get(request.action)
        if action is None:
            return "unknown_action"
        lasts = lasts_us(action, self._seed, request.goal_id)
        if action.moves_to:
            try:
                to = read_place(request.fields.get(action.moves_to))
            except BadFieldError:
                return "bad_field"
            self._walk = [to]
            self._go()
            lasts = micros(horizontal_m(self._place, to) / self.limits.walk_m_s) + STEP_US
        return self._later(request, lasts, lambda _: {})

    def _later(self, request: GoalRequest, after_us: Micros, make: Callable[[GoalRequest], dict[str, Any]]) -> str:
        """End a goal after a while with what `make` gives then, unless its outcome is another."""
        outcome = self.outcomes.next(request.action) or Outcome(action=request.action)
        action = self.kind.actions.get(request.action, SimAction())

        def end() -> None:
            self._answers.pop(request.goal_id, None)
            if self.side is None:
                return
            if outcome.fail:
                self.side.finish(request.goal_id, "failed", code=outcome.fail)
                return
            result = {**action.result, **make(request), **outcome.give}
            self.side.finish(request.goal_id, "succeeded", result=result)

        at = self.scheduler.now() + after_us + micros(outcome.delay_s)
        self._answers[request.goal_id] = self.scheduler.call_at(at, end)
        return ""

    def _find(self, request: GoalRequest) -> str:
        """Let the tracker answer after a while, then look out for the drone."""
        try:
            base = read_place(request.fields.get("base"))
        except BadFieldError:
            return "bad_field"

        def found(_: GoalRequest) -> dict[str, Any]:
            answer = self._finder.answer(self._place, base, request.task_id)
            if answer["in_range"]:
                self._follower.arrive()
            else:
                self._follower.guide(read_place(answer["go_to"]), self.scheduler.now())
                self._go()
            return answer

        return self._later(request, micros(self.limits.fix_takes_s), found)

    def _fills(self, field: Mapping[str, Any]) -> Any:
        """Return what a person fills in whom nobody told what."""
        match field.get("type"):
            case "place":
                return {"east_m": self._place.east_m, "north_m": self._place.north_m}
            case "enum":
                return next(iter(field.get("values") or ()), "")
            case "text":
                return ""
            case "bool":
                return False
            case "int":
                return int(field.get("least") or 0)
        return float(field.get("least") or 0.0)

    def _choose(self, question: str, options: list[str]) -> tuple[str | None, Micros, Mapping[str, Any]]:
        """Return the answer (None: never), how long it takes, and what is filled in."""
        form: Mapping[str, Any] = {}
        for index, rule in enumerate(self._rules):
            if rule.match != "*" and not any(rule.match in text for text in (question, *options)):
                continue
            if rule.never:
                return None, 0, {}
            form = {**rule.form, **form}
            if not rule.options:
                continue
            answer = rule.options[min(self._given[index], len(rule.options) - 1)]
            if answer in options:
                self._given[index] += 1
                return answer, rule.after_us, form
        if "clear" in options and CLEARANCE_OPTIONS.issuperset(options):
            return "clear", DEFAULT_DELAY_US, form
        yes = next((option for option in options if option.lower() in AFFIRMATIVE), options[0])
        return yes, DEFAULT_DELAY_US, form

    def _say(self, request: GoalRequest, answer: str, form: Mapping[str, Any]) -> None:
        self._answers.pop(request.goal_id, None)
        if self.side is not None:
            result = {"answer": answer, "by": self.agent, "at": self.scheduler.now(), **self.filled(request, form)}
            self.side.finish(request.goal_id, "succeeded", result=result)

    def filled(self, request: GoalRequest, form: Mapping[str, Any]) -> dict[str, Any]:
        """Return what this person fills in, as a part of the answer: what `form` holds, else what they think of."""
        asked = [field for field in request.fields.get("form") or () if isinstance(field, Mapping)]
        names = [str(field.get("name")) for field in asked]
        filled = {name: form.get(name, self._fills(field)) for name, field in zip(names, asked, strict=True)}
        return {"form": filled} if filled else {}

    def _go(self) -> None:
        now = self.scheduler.now()
        if not self._walks and (self._walk or self._follower.is_guided(now)):
            self._walks = True
            self.scheduler.call_at(now + STEP_US, self._step)

    def _step(self) -> None:
        """Walk for one second, then again, until the way ends and nobody guides them."""
        to = self._follower.look(self._place, self.scheduler.now())
        if self._follower.sees:
            self._walk.clear()
        here = self._walked([to] if to is not None else self._walk)
        if here != self._place:
            self.stand_at(here)
        self._walks = False
        self._go()

    def _walked(self, way: list[Place]) -> Place:
        """Return where one second of walking leads; takes the points that are passed off the way."""
        left_m = self.limits.walk_m_s * STEP_US / SECOND
        here = self._place
        while way and left_m > 0.0:
            to = way[0]
            leg_m = horizontal_m(here, to)
            if leg_m <= left_m:
                here, left_m = way.pop(0), left_m - leg_m
                continue
            share, left_m = left_m / leg_m, 0.0
            here = Place(
                mm(here.east_m + share * (to.east_m - here.east_m)),
                mm(here.north_m + share * (to.north_m - here.north_m)),
            )
        return here

    def status(self) -> dict[str, Any]:
        """Return what the tracker says of the person."""
        here = self.position()
        lat, lng = self._frame.lat_lng(here) if self._frame is not None else (None, None)
        return {"position": here, "landed": "grounded", "lat": lat, "lng": lng}


def write_rules(rules: Iterable[Rule]) -> list[dict[str, Any]]:
    """Return rules as the plain data `read_rules` reads (for a process's command line)."""
    return [
        {
            "match": rule.match,
            "options": list(rule.options),
            "after": rule.after_us / SECOND,
            "never": rule.never,
            "form": dict(rule.form),
        }
        for rule in rules
    ]
