"""Compares what came of a case with what it expects, and says in words what differs."""

import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.units import format_quantity
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.lang.codes import is_code
from formiga_bt.lang.scenario import ScenarioOrder
from formiga_bt.rehearsal.cases.cases import GAP, Case, DuringRule, GoalRule, Rule, Standing
from formiga_bt.rehearsal.cases.running import Came, SentGoal


@dataclass(frozen=True, slots=True)
class Differs:
    """One thing that is not as expected. `lines` tell more: a difference of actions, line by line."""

    what: str
    expected: str
    came: str
    lines: tuple[str, ...] = ()
    rule: Rule | None = None
    """Of answers and goals: the rule of the case that never counted."""

    def __str__(self) -> str:
        return (
            f"{self.what}: expected {self.expected}, came {self.came}" if self.expected else f"{self.what}: {self.came}"
        )


def judge(case: Case, came: Came) -> list[Differs]:
    """Return all that differs, empty if the case passed."""
    if came.task is None:
        return [Differs("status", case.expect.status, f"refused: {came.refused}")]
    found = [
        *_end(case, came),
        *_actions(case, came),
        *_people(case, came),
        *_standings(case, came),
        *_safety(case, came),
        *_rules(case, came),
    ]
    found += [Differs(_key_of(rule), "", _never(rule), rule=rule) for rule in came.unused]
    found += [Differs("answers", "", text) for text in came.no_use]
    found += [Differs("faults", "", text) for text in came.too_late]
    return found + [Differs("orders", "", text) for text in came.refused_orders]


def _key_of(rule: Rule) -> str:
    if isinstance(rule, DuringRule):
        return "orders" if isinstance(rule.entry, ScenarioOrder) else "faults"
    return "answers"


def _never(rule: Rule) -> str:
    fails = isinstance(rule, GoalRule) and rule.does == "fail"
    did = "failed: it did not come, or ended before" if fails else "came"
    return f"{rule.mark.said}: {rule.told} never {did}"


def place(mark: Mark | None) -> str:
    """Return ` at file:line`, or nothing."""
    return f" at {mark.file}:{mark.line}" if mark is not None else ""


def _end(case: Case, came: Came) -> Iterator[Differs]:
    task, expect = came.task, case.expect
    assert task is not None
    status = task.status.lower()
    why = (
        f" ({task.outcome.code}{f': {task.outcome.reason}' if task.outcome.reason else ''}{place(came.failed_at)})"
        if task.outcome.code
        else ""
    )
    if not came.in_time:
        why = came.given_up or f"it had not ended after {_time(came.duration_s)}, the limit of the case"
        yield Differs("status", expect.status, f"{status} still: {why}")
    elif status != expect.status:
        yield Differs("status", expect.status, f"{status}{why}")
    elif expect.code is not None and not is_code(expect.code, task.outcome.code):
        yield Differs("code", expect.code, f"{task.outcome.code or 'none'}{why}")
    if expect.max_time_s is not None and came.duration_s > expect.max_time_s:
        yield Differs("max_time", _time(expect.max_time_s), _time(came.duration_s))


def _time(seconds: float) -> str:
    return format_quantity("duration", round(seconds, 1))


def _actions(case: Case, came: Came) -> Iterator[Differs]:
    wanted = case.expect.actions
    if wanted is None or fits(wanted, came.sent):
        return
    yield Differs("actions", "", "not as expected (- expected, + came)", tuple(diff(wanted, came.sent)))


def is_it(word: str, sent: SentGoal) -> bool:
    """Return whether `role.Action` or `agent.Action` means this goal."""
    return word in (f"{sent.role}.{sent.action}", f"{sent.agent}.{sent.action}")


def fits(wanted: Sequence[str], sent: Sequence[SentGoal]) -> bool:
    """Return whether the goals are the expected ones, `..` standing for any number of them."""
    open_ = {0}
    gaps = [word == GAP for word in wanted]

    def skip(places: set[int]) -> set[int]:
        for at in sorted(places):
            while at < len(wanted) and gaps[at]:
                at += 1
                places.add(at)
        return places

    open_ = skip(open_)
    for one in sent:
        there = {at for at in open_ if at < len(wanted) and gaps[at]}
        there |= {at + 1 for at in open_ if at < len(wanted) and not gaps[at] and is_it(wanted[at], one)}
        open_ = skip(there)
    return len(wanted) in open_


def diff(wanted: Sequence[str], sent: Sequence[SentGoal]) -> Iterator[str]:
    """Iterate over the difference: `-` was expected and did not come, `+` came and was not expected, with its place."""
    names = [next((word for word in wanted if is_it(word, one)), one.name) for one in sent]
    steps = difflib.SequenceMatcher(None, list(wanted), names, autojunk=False).get_opcodes()
    for tag, low, high, first, last in steps:
        if tag == "equal":
            yield from (f"    {word}" for word in wanted[low:high])
            continue
        gap = GAP in wanted[low:high]
        yield from (f"  - {word}" for word in wanted[low:high] if word != GAP)
        if gap:
            yield f"    {GAP}"
        yield from (f"  {' ' if gap else '+'} {names[at]}{place(sent[at].mark)}" for at in range(first, last))


def _people(case: Case, came: Came) -> Iterator[Differs]:
    expect = case.expect
    if expect.answers_asked is not None and expect.answers_asked != len(came.asked):
        lines = tuple(f"    {text}" for text in came.asked)
        yield Differs("answers_asked", str(expect.answers_asked), str(len(came.asked)), lines)
    if expect.notices is None:
        return
    same = len(expect.notices) == len(came.notices)
    if not same or any(part not in text for part, text in zip(expect.notices, came.notices, strict=True)):
        lines = (*(f"  - {part}" for part in expect.notices), *(f"  + {text}" for text in came.notices))
        yield Differs("notices", str(len(expect.notices)), str(len(came.notices)), lines)


def standing(agent: AgentRecord) -> Standing:
    """Return how a machine is."""
    if agent.pool == "QUARANTINED":
        return "quarantined"
    if agent.landed != "grounded":
        return "airborne"
    return "parked_away" if agent.pool == "PARKED_AWAY" else "at_port"


def _standings(case: Case, came: Came) -> Iterator[Differs]:
    for name, wanted in case.expect.end_state.items():
        ids = came.roles.get(name, (name,) if name in came.agents else ())
        if not ids:
            yield Differs("end_state", f"{name} {wanted}", "nobody had that role")
        for id_ in ids:
            agent = came.agents[id_]
            is_so = agent.landed == "grounded" if wanted == "grounded" else standing(agent) == wanted
            if not is_so:
                who = name if id_ == name else f"{name} ({id_})"
                yield Differs("end_state", f"{who} {wanted}", standing(agent))


def _rules(case: Case, came: Came) -> Iterator[Differs]:
    for rule, wanted in case.expect.rules.items():
        found = came.rules.get(rule, 0)
        if found != wanted:
            yield Differs("rules", f"{rule} {wanted}", str(found))


def _safety(case: Case, came: Came) -> Iterator[Differs]:
    verdict = came.verdict
    if len(verdict.crashes) != case.expect.crashes:
        lines = tuple(f"    {crash.a} and {crash.b}, {crash.distance_m:g} m apart" for crash in verdict.crashes)
        yield Differs("crashes", str(case.expect.crashes), str(len(verdict.crashes)), lines)
    for what, found in (("unsafe starts", verdict.unsafe_starts), ("low flights", verdict.low_flights)):
        if found:
            yield Differs(what, "0", str(len(found)))
