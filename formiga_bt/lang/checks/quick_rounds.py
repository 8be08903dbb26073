"""W104: a loop without an end that may go round and take no time: what waits in it is skipped, or comes second.

Follows each way through a round on which nothing takes time, with how the conditions on it turn out: a way on which one would
be both true and false is none, and so is one whose condition the round itself may change. `busy_loops` has the loops in which
nothing waits at all.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final, assert_never

from msgspec import Struct, field

from formiga_bt.lang.checks.busy_loops import waits
from formiga_bt.lang.checks.ranges import may_be
from formiga_bt.lang.model import (
    Ask,
    BreakIf,
    Call,
    Check,
    Do,
    Expr,
    Fail,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Notify,
    Parallel,
    Release,
    Request,
    Sequence,
    Set,
    Step,
    Switch,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.text.reading import Problems, shorten
from formiga_bt.lang.walk import bare, children

_MOST: Final = 200
"""So many ways through a step are followed."""


class _Way(Struct, frozen=True):
    """A way through steps on which no time passes."""

    ok: bool = True
    """It succeeds."""
    turned: Mapping[str, bool] = field(default_factory=dict)
    """How conditions on it turn out, by their text."""


_AT_ONCE: Final = (_Way(),)


class _TooMany(Exception):  # noqa: N818 - a signal: nothing is reported
    pass


def check_quick_rounds(step: Loop, problems: Problems) -> None:
    """Report W104 for a loop in which something waits, though not on every way."""
    endless = step.times is None and step.max is None and step.every is None
    if not endless or not any(waits(child) for child in step.steps):
        return
    try:
        rounds = list(_Ways(step.steps).round(step))
    except _TooMany:
        return
    way = next((way for way in rounds if may_be(way.turned)), None)
    if way is not None:
        told = " and ".join(_told(word, turned) for word, turned in way.turned.items())
        what = f"nothing in a round takes time{f' when {told}' if told else ''}: this loop goes round and round"
        problems.add("W104", step.mark, what, "add every: 15 s, or wait on each way through it")


def _told(word: str, turned: bool) -> str:
    return f"'{shorten(word)}' is {'true' if turned else 'false'}"


class _Ways:
    """The quick ways through the rounds of one loop."""

    def __init__(self, steps: tuple[Step, ...]) -> None:
        self._written = set(_assigned(steps))

    def round(self, loop: Loop) -> Iterator[_Way]:
        """Iterate over the ways through a round after which another one begins."""
        before = self._when(_AT_ONCE, loop.cond, True)
        for way in self._in_order(loop.steps, before):
            if way.ok:
                yield from self._when((way,), loop.until, False)

    def _when(self, ways: Iterable[_Way], cond: Expr | None, turned: bool) -> Iterator[_Way]:
        """Iterate over those ways on which a condition can turn out so, and after which it stays like that."""
        if cond is None:
            yield from ways
            return
        if any(read.name in self._written for read in cond.reads) or (cond.is_const and bool(cond.const) is not turned):
            return
        word = " ".join(bare(cond).split())
        while word.startswith("not ") and not any(part in word for part in (" and ", " or ", " if ")):
            word, turned = word.removeprefix("not ").strip(), not turned
        for way in ways:
            if way.turned.get(word, turned) is turned:
                yield _Way(way.ok, {**way.turned, word: turned})

    def _in_order(self, steps: Iterable[Step], before: Iterable[_Way] = _AT_ONCE) -> list[_Way]:
        """Return the ways through steps one after another; one that fails ends there."""
        ways = list(before)
        for step in steps:
            ways = [*(way for way in ways if not way.ok), *self._after([way for way in ways if way.ok], step)]
        return ways

    def _after(self, ways: list[_Way], step: Step) -> list[_Way]:
        mine = list(self._step(step)) if ways else []
        found = [both for way in ways for one in mine if (both := _joined(way, one)) is not None]
        if len(found) > _MOST:
            raise _TooMany
        return found

    def _step(self, step: Step) -> Iterator[_Way]:
        """Iterate over the ways through a step."""
        if step.when is not None:
            yield from self._when(_AT_ONCE, step.when, False)
        ways = self._when(self._kind(step), step.when, True)
        for way in ways:
            if way.ok or step.ignore_failure:
                yield _Way(True, way.turned)
            elif step.retry is None:
                yield way

    def _kind(self, step: Step) -> Iterable[_Way]:
        """Return the ways through a step without its modifiers."""
        match step:
            case Do() | Ask() | WaitFor() | Release() | WithAgents() | Request() | WithResource():
                return ()
            case Wait():
                return () if waits(step) else _AT_ONCE
            case WaitUntil():
                return list(self._when(_AT_ONCE, step.cond, True))
            case BreakIf():
                return list(self._when(_AT_ONCE, step.cond, False))
            case Check():
                fails = [_Way(False, way.turned) for way in self._when(_AT_ONCE, step.cond, False)]
                return [*self._when(_AT_ONCE, step.cond, True), *fails]
            case Set() | Notify():
                return _AT_ONCE
            case Fail():
                return (_Way(False),)
            case Sequence():
                return self._in_order((*step.steps, *step.finally_))
            case Guard():
                return self._in_order(step.steps, self._when(_AT_ONCE, step.cond, True))
            case Fallback():
                return self._fallback(step)
            case If():
                then = self._in_order(step.then, self._when(_AT_ONCE, step.cond, True))
                return [*then, *self._in_order(step.otherwise, self._when(_AT_ONCE, step.cond, False))]
            case Switch():
                return [way for branch in step.branches for way in self._in_order(branch)]
            case Parallel() if step.need == "all":
                return self._in_order(step.steps)
            case Call():
                return () if waits(step) else _AT_ONCE
            case Parallel() | Loop() | For():
                return () if any(waits(child) for child in children(step)) else _AT_ONCE
            case _:
                assert_never(step)

    def _fallback(self, step: Fallback) -> list[_Way]:
        done: list[_Way] = []
        left: list[_Way] = [_Way()]
        for child in step.steps:
            found = self._after(left, child)
            done += [way for way in found if way.ok]
            left = [_Way(True, way.turned) for way in found if not way.ok]
        return [*done, *(_Way(False, way.turned) for way in left)]


def _joined(way: _Way, one: _Way) -> _Way | None:
    """Return a way with another one behind it; None if no run goes both."""
    if any(way.turned.get(word, turned) is not turned for word, turned in one.turned.items()):
        return None
    return _Way(one.ok, {**way.turned, **one.turned})


def _assigned(steps: Iterable[Step]) -> Iterator[str]:
    for step in steps:
        if isinstance(step, Set):
            yield from step.assign
        yield from _assigned(children(step))
