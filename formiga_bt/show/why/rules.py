"""Why a standing rule did what it did, or nothing; and which rule requested a task."""

from collections.abc import Iterator
from typing import Final

from formiga_bt.engine.kernel.records import TaskRecord
from formiga_bt.engine.kernel.rule_records import RuleFiring, RuleRecord
from formiga_bt.engine.kernel.timers import RuleDue
from formiga_bt.lang.model.rules import RULE_PREFIX
from formiga_bt.show.facts import Because
from formiga_bt.show.history.rules import running
from formiga_bt.show.why.scene import WhyScene
from formiga_bt.show.why.words import span

SHOWN: Final = 5
"""So many of the newest firings are told."""


def headline(scene: WhyScene, rule: RuleRecord) -> str:
    """Return how a rule stands in a few words."""
    status = "WAITS" if rule.waits else "RUNS" if running(scene.state, rule) else "WATCHES"
    return f"{RULE_PREFIX}{rule.name} {status}"


def why_rule(scene: WhyScene, rule: RuleRecord) -> list[Because]:
    """Return the chain of a rule: what waits for a person, what it watches, and what became of what happened."""
    return [*_waits(rule, scene), *_on(rule), *_watched(rule, scene), *_last(rule, scene)]


def requested_by_rule(scene: WhyScene, task: TaskRecord) -> Iterator[Because]:
    """Tell which rule requested a task, or the one that requested it."""
    cause = task.request.cause
    if cause is None or task.family.parent:
        return
    word = f"; {cause.by} let it start" if cause.by else ""
    text = f"{RULE_PREFIX}{cause.rule} requested it {span(scene.now - cause.at)} ago: {cause.agent} {cause.what}{word}"
    yield Because("rule", text, f"formiga why {RULE_PREFIX}{cause.rule}")


def _waits(rule: RuleRecord, scene: WhyScene) -> Iterator[Because]:
    for one in rule.waits.values():
        often = f", {one.times} times" if one.times > 1 else ""
        text = f"{one.agent} {one.what} {span(scene.now - one.at)} ago{often}; its task waits for a person: {one.text}"
        say = f"formiga rules start {rule.name} --agent {one.agent}"
        yield Because(one.code, text, f"{say} | formiga rules dismiss {rule.name} --agent {one.agent}", agent=one.agent)


def _on(rule: RuleRecord) -> Iterator[Because]:
    after = f" for {span(rule.after_us)}" if rule.after_us else ""
    of = f" of {', '.join(rule.of)}" if rule.of else ""
    yield Because("on", f"on {rule.on}{after}{of} it requests {rule.task}, at most {rule.limit}")
    if not rule.fired:
        yield Because("never", "nothing of it has happened yet")


def _watched(rule: RuleRecord, scene: WhyScene) -> Iterator[Because]:
    for agent, watch in scene.state.rule_watches.get(rule.name, {}).items():
        due = scene.state.deadlines.get(RuleDue(rule.name, agent))
        if watch.since is not None and due is not None:
            text = f"{agent} is beyond the border since {span(scene.now - watch.since)}"
            yield Because("pending", f"{text}; it counts in {span(due.at - scene.now)}", agent=agent)
        elif watch.since is not None:
            text = f"{agent} was beyond the border when its time was over, by a position that was too old: the next one decides"
            yield Because("pending", text, agent=agent)


def _last(rule: RuleRecord, scene: WhyScene) -> Iterator[Because]:
    for one in rule.last[: -SHOWN - 1 : -1]:
        text, hint = _in_words(one)
        yield Because(one.outcome, f"{span(scene.now - one.at)} ago, {one.agent}: {text}", hint, agent=one.agent)


def _in_words(one: RuleFiring) -> tuple[str, str]:
    why = f"formiga why {one.task}" if one.task else ""
    match one.outcome:
        case "started":
            return f"{one.task} was requested" + (f" by the word of {one.by}" if one.by else ""), why
        case "running":
            return f"{one.task} runs for it already: no other task was requested", why
        case "own":
            return "a task of this rule moves it: a rule does not request itself", ""
        case "waits":
            return f"its task could not start ({one.code}): a person decides", ""
        case "dismissed":
            return f"{one.by or 'somebody'} dismissed it", ""
