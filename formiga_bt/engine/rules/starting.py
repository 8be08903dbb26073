"""From what happened to a task of the rule, or to a person who decides. Each thing that happens has one outcome.

| it happened | outcome |
|---|---|
| while the site is locked down, or its task cannot be requested | alarm `rule_waits`; a person starts or dismisses it |
| while as many tasks of the rule run as may | `running`: that task is there for it |
| to a machine that a task moves which the rule led to | `own`: a rule does not request itself |
| more often than `MOST_STARTS` a minute for one agent | alarm `rule_waits`: it may request itself through what it starts |
| else | a task is requested in the same step |
"""

from collections.abc import Callable
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm, Input, RuleOrder, Submit
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.rule_records import KEPT_FIRINGS, RuleCause, RuleFiring, RuleRecord, RuleWait, RuleWatch
from formiga_bt.engine.tasks.env import TaskEnv
from formiga_bt.engine.tasks.intake import Intake
from formiga_bt.engine.tasks.taskmodel import CANNOT_COMPUTE
from formiga_bt.lang.expr.at_run import is_of
from formiga_bt.lang.model import Rule, UnknownState, Unset, why_not_computed
from formiga_bt.lang.model.rules import RULE_PREFIX
from formiga_bt.lang.types import AgentRef

MOST_STARTS: Final = 6
"""Tasks of one rule for one agent that may begin within `HASTE_US`."""
HASTE_US: Final = 60 * SECOND


class Starting:
    """Requests the tasks of rules; keeps nothing itself.

    Args:
        core: of the engine.
        intake: admits tasks.
        refuse: raises TaskError for what would begin something while nothing can be kept.
    """

    def __init__(self, core: Core, intake: Intake, refuse: Callable[[Core, Input], None]) -> None:
        self._core = core
        self._refuse = refuse
        self._intake = intake

    def record(self, rule: Rule) -> RuleRecord:
        """Return the record of a rule, as the site has it now."""
        old = self._core.state.rules.get(rule.name) or RuleRecord(name=rule.name, on=rule.source, task=rule.task)
        return replace(
            old, on=rule.source, after_us=rule.after_us, of=rule.of, task=rule.task, limit=rule.limit, watched=rule.watched
        )  # fmt: skip

    def fire(self, rule: Rule, agent: str, event: dict[str, Any]) -> None:
        """Something happened to an agent that a rule is on; the engine time of it is now."""
        core = self._core
        chain = self._chain(agent)
        wait = RuleWait(
            agent=agent, what=rule.happening, at=core.now, through=chain, code="", text="",
            event={"agent": AgentRef(agent), "at": core.now, **event},
        )  # fmt: skip
        running = self._running(rule, agent)
        if core.state.lockdown is None and rule.name in chain:
            self._note(rule, RuleFiring(agent, core.now, "own"))
        elif core.state.lockdown is None and len(running) >= rule.most:
            self._note(rule, RuleFiring(agent, core.now, "running", running[-1]))
        else:
            self._start(rule, wait)

    def order(self, given: RuleOrder) -> Accepted | Done:
        """A person starts what waits for them, or dismisses it.

        Raises:
            TaskError: `unknown_rule`, `not_waiting`, or why the task cannot be requested now either.
        """
        core = self._core
        rule = core.site.rules.get(given.rule)
        if rule is None:
            known = ", ".join(core.site.rules) or "none"
            raise TaskError("unknown_rule", f"there is no rule '{given.rule}'; the site has {known}")
        waits = self.record(rule).waits
        agent = given.agent or (next(iter(waits)) if len(waits) == 1 else "")
        wait = waits.get(agent)
        if wait is None:
            which = f"it waits for a person's word on {', '.join(waits)}" if waits else "nothing of it waits"
            raise TaskError("not_waiting", f"{RULE_PREFIX}{rule.name}: {which}")
        if given.do == "dismiss":
            self._note(rule, RuleFiring(agent, core.now, "dismissed", "", "", given.by), done=agent)
            return Done()
        task = self._request(rule, wait, given.by)
        self._started(rule, agent, task, given.by)
        return Accepted(task)

    # -- one start -------------------------------------------------------------------------------------------------
    def _start(self, rule: Rule, wait: RuleWait) -> None:
        core = self._core
        try:
            self._refuse_haste(rule, wait.agent)
            task = self._request(rule, wait, "")
        except TaskError as error:
            old = self.record(rule).waits.get(wait.agent)
            wait = replace(wait, code=error.code, text=str(error), times=1 if old is None else old.times + 1)
            self._note(rule, RuleFiring(wait.agent, core.now, "waits", "", error.code), wait=wait)
            text = f"{wait.agent}: {wait.what}; {RULE_PREFIX}{rule.name} could not start {rule.task}: {wait.text}"
            core.effect(Alarm("rule_waits", text, "", wait.agent))
        else:
            self._started(rule, wait.agent, task, "")

    def _refuse_haste(self, rule: Rule, agent: str) -> None:
        watch = self._core.state.rule_watches.get(rule.name, {}).get(agent)
        recent = [at for at in watch.starts if self._core.now - at < HASTE_US] if watch is not None else []
        if len(recent) >= MOST_STARTS:
            text = f"it started {MOST_STARTS} tasks for {agent} within a minute: it may request itself by what they do"
            raise TaskError("rule_in_haste", text)

    def _request(self, rule: Rule, wait: RuleWait, by: str) -> str:
        """Request the task of a rule; return its id.

        Raises:
            TaskError: it cannot be; nothing is recorded then.
        """
        cause = RuleCause(rule.name, wait.agent, wait.what, wait.at, by, wait.through)
        bare = Submit(rule.task, {}, rule.priority or None, f"{RULE_PREFIX}{rule.name}", cause=cause)
        self._refuse(self._core, bare)
        self._intake.check(bare)
        return self._intake.submit(replace(bare, params=self._params(rule, wait, bare)))

    def _params(self, rule: Rule, wait: RuleWait, bare: Submit) -> dict[str, Any]:
        core = self._core
        model = core.library.wanted(bare)
        env = TaskEnv(core, None, {"event": wait.event})
        found: dict[str, Any] = {}
        for name, expr in rule.args.items():
            param = model.params.get(name)
            try:
                value = expr.run(env)
            except Unset as error:
                if param is not None and (param.optional or param.default is not None):
                    continue
                raise TaskError("cannot_compute", f"'{name}' cannot be computed: {why_not_computed(error)}") from error
            except UnknownState as error:
                raise TaskError(
                    "unknown_state", f"'{name}' cannot be computed: {error.key} is not known yet"
                ) from error
            except CANNOT_COMPUTE as error:
                raise TaskError("cannot_compute", f"'{name}' cannot be computed: {why_not_computed(error)}") from error
            if param is not None and not is_of(value, param.type):
                due = f"{model.name} takes {param.type} for '{name}' now"
                raise TaskError("bad_param", f"{due}, which the rule does not give: check the site file against it")
            found[name] = value
        return found

    def _started(self, rule: Rule, agent: str, task: str, by: str) -> None:
        core = self._core
        watches = core.state.rule_watches.get(rule.name, {})
        watch = watches.get(agent) or RuleWatch()
        starts = (*(at for at in watch.starts if core.now - at < HASTE_US), core.now)[-MOST_STARTS:]
        core.emit(ch.RuleWatchPut(rule.name, agent, replace(watch, starts=starts)))
        self._note(rule, RuleFiring(agent, core.now, "started", task, "", by), done=agent, started=(agent, task))

    # -- records ---------------------------------------------------------------------------------------------------
    def _note(
        self,
        rule: Rule,
        firing: RuleFiring,
        *,
        wait: RuleWait | None = None,
        done: str = "",
        started: tuple[str, str] | None = None,
    ) -> None:
        core = self._core
        old = self.record(rule)
        waits = {agent: one for agent, one in old.waits.items() if agent != done}
        if wait is not None:
            waits[wait.agent] = wait
        by_word = firing.by != ""
        core.emit(
            ch.RulePut(
                rule.name,
                replace(
                    old,
                    running=(*self._open(old), *([started] if started is not None else [])),
                    waits=waits,
                    fired=old.fired if by_word else old.fired + 1,
                    last=(*old.last, firing)[-KEPT_FIRINGS:],
                ),
            )
        )

    def _open(self, record: RuleRecord) -> list[tuple[str, str]]:
        return [one for one in record.running if one[1] in self._core.open]

    def _running(self, rule: Rule, agent: str) -> list[str]:
        """Return the tasks of a rule that have not ended, as far as they count for this agent."""
        mine = self._open(self.record(rule))
        return [task for of, task in mine if of == agent or not rule.per_agent]

    def _chain(self, agent_id: str) -> tuple[str, ...]:
        """Return the rules that led to the task which moves a machine now; a person moves by themself."""
        state = self._core.state
        agent = state.agents[agent_id]
        if agent.human:
            return ()
        goal = state.goals.get(agent.goal)
        task = state.tasks.get(agent.task or (goal.task if goal is not None else ""))
        cause = task.request.cause if task is not None else None
        return (*cause.through, cause.rule) if cause is not None else ()
