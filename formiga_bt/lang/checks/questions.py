"""W090: a question whose answer changes nothing, or that only a refusal lets pass; W091: one that is asked again at once.

What an answer means is read from its words: `no`, `not_yet`, `later` refuse; `yes`, `loaded`, `ready` and the like agree.
"""

import re
from typing import Any, Final

from formiga_bt.base.units import format_quantity
from formiga_bt.lang.checks.bodies import in_order
from formiga_bt.lang.model import Ask, Catalogue, EvalError, Expr, Step, UnknownState, Unset
from formiga_bt.lang.request.binding import BASE
from formiga_bt.lang.text.reading import Problems
from formiga_bt.lang.types import AgentRef, Value
from formiga_bt.lang.walk import children, orders

_REFUSES: Final = frozenset((
    "no", "not", "never", "nope", "none", "later", "wait", "refuse", "refused", "deny", "denied", "reject", "rejected",
    "cancel", "stop", "abort", "negative",
))  # fmt: skip
_AGREES: Final = frozenset((
    "yes", "ok", "okay", "agree", "agreed", "accept", "accepted", "confirm", "confirmed", "approve", "approved", "go",
    "continue", "ready", "done", "loaded", "clear", "safe", "positive",
))  # fmt: skip
AT_ONCE_S: Final = 10.0
"""Nobody who has just said "not yet" has changed anything so soon."""
MOST_TIMES: Final = 10
"""Who is asked more often than this stops reading."""


def refuses(option: str) -> bool:
    """Return whether an answer means no."""
    return re.split(r"[\W_]+", option.lower())[0] in _REFUSES


def agrees(option: str) -> bool:
    """Return whether an answer means yes."""
    return re.split(r"[\W_]+", option.lower())[0] in _AGREES


def check_questions(steps: tuple[Step, ...], catalogue: Catalogue, problems: Problems) -> None:
    """Report W090 and W091 for the questions of a body."""
    for body in in_order(steps):
        for at, step in enumerate(body):
            if isinstance(step, Ask) and _moves(body[at + 1 :], catalogue):
                _check_unread(step, problems)
    _walk(steps, problems)


def _walk(steps: tuple[Step, ...], problems: Problems) -> None:
    for step in steps:
        with problems.within(step.title):
            if isinstance(step, Ask) and step.expect is not None:
                _check_refusal(step, step.expect, problems)
                _check_again(step, problems)
            _walk(children(step), problems)


def _moves(steps: tuple[Step, ...], catalogue: Catalogue) -> bool:
    specs = (catalogue.actions.get(do.action) for step in steps for _, do in orders(step))
    return any(spec is not None and (spec.moves_to or spec.effect) for spec in specs)


def _check_unread(step: Ask, problems: Problems) -> None:
    """Report W090 for a question that may be refused, after which machines move all the same."""
    refusal = next((one for one in step.options if refuses(one)), "")
    if not refusal or step.save_as or step.expect is not None or step.ignore_failure:
        return
    if step.clears is not None and step.retry is None:
        return
    again = " and nobody is asked again" if step.retry is not None else ""
    what = f"after the answer '{refusal}' the next steps run all the same{again}"
    problems.add("W090", step.mark, what, f"add expect: result.answer != '{refusal}', or save_as and a condition")


def _check_refusal(step: Ask, expect: Expr, problems: Problems) -> None:
    """Report W090 for a question that only a refusal lets pass."""
    passes = {one: _passes(expect, one) for one in step.options}
    if None in passes.values():
        return
    yes = [one for one in step.options if agrees(one)]
    good = [one for one, ok in passes.items() if ok]
    if yes and good and all(refuses(one) for one in good):
        what = f"only '{good[0]}' lets this go on: the answer '{yes[0]}' counts as a failure"
        problems.add(
            "W090", expect.mark, what, f"expect: result.answer == '{yes[0]}'; else ask so that yes means go on"
        )


def _check_again(step: Ask, problems: Problems) -> None:
    """Report W091 for a question that is put again as soon as it is answered, or without end."""
    retry = step.retry
    if retry is None or not retry.attempts.is_const or retry.attempts.const == 1:
        return
    delay = retry.delay.const if retry.delay is not None and retry.delay.is_const else None
    if retry.delay is None or (isinstance(delay, int | float) and delay < AT_ONCE_S):
        after = "at once" if not delay else f"after {format_quantity('duration', float(delay))}"
        what = f"who gives an answer that fails is asked the same again {after}"
        problems.add("W091", (retry.delay or retry).mark, what, "give them time: delay: 1 min")
    if isinstance(retry.attempts.const, int) and retry.attempts.const > MOST_TIMES:
        what = f"people are asked the same up to {retry.attempts.const} times"
        problems.add("W091", retry.attempts.mark, what, f"at most {MOST_TIMES}; a longer delay, or let it fail")


def _passes(expect: Expr, option: str) -> bool | None:
    try:
        return bool(expect.run(_Answered(option)))
    except (Unset, UnknownState, EvalError, ArithmeticError, LookupError, TypeError, AttributeError):
        return None


class _Answered:
    """What an `expect` may read when one answer was given; all else is unknown."""

    def __init__(self, option: str) -> None:
        self._option = option

    def name(self, name: str) -> Value:
        if name == "result":
            return {"answer": self._option, "by": AgentRef(""), "at": 0}
        if name == "base":
            return BASE
        raise Unset(name)

    def is_set(self, name: str) -> bool:
        raise Unset(name)

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        raise UnknownState(f"{agent.id}.{name}")

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        raise Unset(agent_type)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        raise Unset(str(point))

    def place(self, lat: float, lng: float) -> Any:
        raise Unset(f"{lat}, {lng}")

    def ground_up_m(self, place: Any) -> float:
        raise Unset(str(place))
