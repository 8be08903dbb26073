"""Standing rules: what they watch. Only agents that some rule names are looked at.

An event of an agent is looked up when it is kept. Borders are compared with each position of an agent of a type that a rule
names, from positions not older than `borders.OLDEST_US`; silence has one deadline an agent, looked at when it is due. What is
seen of an agent is a record, so that a restart in the middle forgets nothing, and fires nothing twice.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

from msgspec.structs import replace

from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Input, RuleOrder
from formiga_bt.engine.kernel.records import AgentEventRecord, AgentRecord
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.engine.kernel.rule_records import RuleWatch
from formiga_bt.engine.kernel.timers import RuleDue
from formiga_bt.engine.rules.borders import counts, is_fresh, side_of
from formiga_bt.engine.rules.starting import Starting
from formiga_bt.engine.tasks.intake import Intake
from formiga_bt.lang.model import OnEvent, OnPassage, OnSilence, Rule

NOTHING = RuleWatch()


class StandingRules:
    """The rules of the site; arguments as for `Starting`."""

    def __init__(self, core: Core, intake: Intake, refuse: Callable[[Core, Input], None]) -> None:
        self._core = core
        self._starting = Starting(core, intake, refuse)
        rules = core.site.rules.values()
        self._events = _by_type(rule for rule in rules if isinstance(rule.on, OnEvent))
        self._watches = _by_type(rule for rule in rules if not isinstance(rule.on, OnEvent))
        self.looks = bool(self._watches)
        """Whether statuses matter to any rule."""

    # -- what comes in -------------------------------------------------------------------------------------------------
    def on_event(self, event: AgentEventRecord) -> None:
        """An agent reported an event of its own, for the first time."""
        agent = self._core.state.agents[event.agent]
        for rule in self._events.get(agent.type, ()):
            if isinstance(rule.on, OnEvent) and rule.on.event == event.event and _is_for(rule, agent):
                self._starting.fire(rule, agent.id, event.fields)

    def on_status(self, agent_id: str) -> None:
        """A status of an agent came in, taken or not: look at where it is, and that it is heard of."""
        agent = self._core.state.agents.get(agent_id)
        if agent is None or agent.refused:
            return
        for rule in self._watches.get(agent.type, ()):
            if _is_for(rule, agent):
                self._look(rule, agent)

    def on_deadline(self, due: RuleDue) -> None:
        """What must last for a while has lasted, or an agent may have been silent for so long."""
        rule, agent = self._core.site.rules.get(due.rule), self._core.state.agents.get(due.agent)
        if rule is None or agent is None or agent.refused:
            return
        match rule.on:
            case OnPassage():
                self._lasted(rule, rule.on, agent)
            case OnSilence():
                self._was_silent(rule, agent)
            case OnEvent():
                return

    def order(self, given: RuleOrder) -> Accepted | Done:
        """A person starts what waits for them, or dismisses it (`Starting.order`)."""
        return self._starting.order(given)

    # -- starts of the engine ------------------------------------------------------------------------------------------
    def read_anew(self) -> None:
        """The engine begins, or begins anew: the rules are as the site file says now."""
        core = self._core
        for name in [name for name in core.state.rules if name not in core.site.rules]:
            self._forget(name)
            core.emit(ch.RulePut(name, None))
        for rule in core.site.rules.values():
            old = core.state.rules.get(rule.name)
            if old is not None and old.watched != rule.watched:
                self._forget(rule.name)
            new = self._starting.record(rule)
            if new != old:
                core.emit(ch.RulePut(rule.name, new))

    def came_back(self) -> None:
        """The engine was away, or stood still: who was silent meanwhile may have spoken."""
        core = self._core
        for rule in core.site.rules.values():
            if isinstance(rule.on, OnSilence):
                for agent in core.state.rule_watches.get(rule.name, {}):
                    if (due := RuleDue(rule.name, agent)) in core.state.deadlines:
                        core.set_deadline(due, core.now + rule.after_us)

    def _forget(self, name: str) -> None:
        core = self._core
        for agent in list(core.state.rule_watches.get(name, {})):
            core.clear_deadline(RuleDue(name, agent))
            core.emit(ch.RuleWatchPut(name, agent, None))

    # -- one rule, one agent -------------------------------------------------------------------------------------------
    def _look(self, rule: Rule, agent: AgentRecord) -> None:
        watch = self._core.state.rule_watches.get(rule.name, {}).get(agent.id, NOTHING)
        match rule.on:
            case OnPassage():
                if is_fresh(agent, self._core.now):
                    self._passes(rule, rule.on, agent, watch)
            case OnSilence():
                due = RuleDue(rule.name, agent.id)
                if agent.heard_at == self._core.now and due not in self._core.state.deadlines:
                    self._put(rule, agent, replace(watch, silent=False))
                    self._core.set_deadline(due, self._core.now + rule.after_us)
            case OnEvent():
                return

    def _passes(self, rule: Rule, on: OnPassage, agent: AgentRecord, watch: RuleWatch) -> None:
        """Compare where an agent is with where it was."""
        core, side, due = self._core, side_of(agent, on.outline), RuleDue(rule.name, agent.id)
        if side is None:
            return
        if watch.inside is None or (side != watch.inside and not counts(on.what, inside=side)):
            self._put(rule, agent, replace(watch, inside=side, since=None))
        elif side == watch.inside:
            if watch.since is not None:  # it is back before `for` was over
                core.clear_deadline(due)
                self._put(rule, agent, replace(watch, since=None))
        elif rule.after_us == 0:
            self._passed(rule, agent, watch)
        elif watch.since is None:
            self._put(rule, agent, replace(watch, since=core.now))
            core.set_deadline(due, core.now + rule.after_us)
        elif core.now - watch.since >= rule.after_us and due not in core.state.deadlines:
            self._passed(rule, agent, watch)  # its position was too old when `for` was over

    def _lasted(self, rule: Rule, on: OnPassage, agent: AgentRecord) -> None:
        """The time of `for` is over; if the agent's position is too old, its next one decides."""
        watch = self._core.state.rule_watches.get(rule.name, {}).get(agent.id, NOTHING)
        if watch.since is not None and is_fresh(agent, self._core.now) and side_of(agent, on.outline) != watch.inside:
            self._passed(rule, agent, watch)

    def _passed(self, rule: Rule, agent: AgentRecord, watch: RuleWatch) -> None:
        self._put(rule, agent, replace(watch, inside=not watch.inside, since=None))
        self._starting.fire(rule, agent.id, {"position": agent.position})

    def _was_silent(self, rule: Rule, agent: AgentRecord) -> None:
        core = self._core
        watch = core.state.rule_watches.get(rule.name, {}).get(agent.id, NOTHING)
        if core.now - agent.heard_at < rule.after_us:
            core.set_deadline(RuleDue(rule.name, agent.id), agent.heard_at + rule.after_us)
        elif not watch.silent:
            self._put(rule, agent, replace(watch, silent=True))
            self._starting.fire(rule, agent.id, {})

    def _put(self, rule: Rule, agent: AgentRecord, watch: RuleWatch) -> None:
        old = self._core.state.rule_watches.get(rule.name, {}).get(agent.id)
        if old != watch:
            self._core.emit(ch.RuleWatchPut(rule.name, agent.id, watch))


def _is_for(rule: Rule, agent: AgentRecord) -> bool:
    return not rule.of or agent.id in rule.of


def _by_type(rules: Iterable[Rule]) -> Mapping[str, tuple[Rule, ...]]:
    found: dict[str, tuple[Rule, ...]] = {}
    for rule, name in _named(rules):
        found[name] = (*found.get(name, ()), rule)
    return found


def _named(rules: Iterable[Rule]) -> Iterator[tuple[Rule, str]]:
    for rule in rules:
        for name in rule.types:
            yield rule, name
