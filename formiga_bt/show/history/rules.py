"""Standing rules as lists show them."""

from formiga_bt.engine.kernel.rule_records import RuleRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.facts.rules import FiringFact, RuleFact, RuleWaitFact


def rule_fact(state: EngineState, rule: RuleRecord, *, approved: bool = True) -> RuleFact:
    """Return a rule; `approved`: whether the rules of the site are, where that is asked for."""
    return RuleFact(
        name=rule.name,
        on=rule.on,
        after_us=rule.after_us,
        of=rule.of,
        task=rule.task,
        limit=rule.limit,
        fired=rule.fired,
        running=running(state, rule),
        waits=tuple(
            RuleWaitFact(agent=one.agent, what=one.what, at=one.at, code=one.code, text=one.text, times=one.times)
            for one in rule.waits.values()
        ),
        last=tuple(
            FiringFact(agent=one.agent, at=one.at, outcome=one.outcome, task=one.task, code=one.code, by=one.by)
            for one in rule.last
        ),
        approved=approved,
    )


def running(state: EngineState, rule: RuleRecord) -> tuple[str, ...]:
    """Return the tasks of a rule that have not ended."""
    tasks = [state.tasks.get(task) for _, task in rule.running]
    return tuple(task.id for task in tasks if task is not None and task.section != "done")
