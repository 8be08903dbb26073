"""Events that agents tell of themselves (`wait_for: picker.sos`): taken once each, kept for those who wait for them later.

As many are kept as `KEPT_EVENTS` says. Once more than that were forgotten that no task took, an alarm tells it, one time.
An event that the agent's type does not have, or whose fields cannot be read, counts as a bad message.
"""

from formiga_bt.engine.agents.fleet import Fleet
from formiga_bt.engine.goals.wire_values import read_result
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.files import note_files
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.news import EventKept
from formiga_bt.engine.kernel.records import AgentEventRecord
from formiga_bt.engine.kernel.state import KEPT_EVENTS
from formiga_bt.lang.model import OnEvent
from formiga_bt.transport.attachments import usable
from formiga_bt.transport.messages import AgentEvent


class AgentEvents:
    """Takes events in."""

    def __init__(self, core: Core, fleet: Fleet) -> None:
        self._core = core
        self._fleet = fleet

    def on_event(self, event: AgentEvent) -> None:
        """Keep an event, and wake who waits for it; a repeated one is ignored."""
        core = self._core
        agent = core.state.agents.get(event.agent)
        if agent is None or agent.refused:
            return
        if any((old.boot_id, old.n) == (event.boot_id, event.n) for old in core.state.agent_events.get(agent.id, ())):
            return
        types = core.agent_type(agent).events.get(event.event)
        if types is None:
            self._fleet.on_bad(agent.id, f"{agent.type} has no event {event.event}")
            return
        try:
            fields = read_result(types, event.fields)
        except ValueError as error:
            self._fleet.on_bad(agent.id, f"event {event.event} cannot be read: {error}")
            return
        if missing := [name for name in types if name not in fields]:
            self._fleet.on_bad(agent.id, f"event {event.event} misses {missing[0]}")
            return
        self._forget_oldest(agent.id)
        if event.attachments:
            note_files(core, agent.task, agent.id, event.event, event.attachments)
        files, _ = usable(event.attachments)
        order = core.state.counters.get("agent_event", 0) + 1
        kept = AgentEventRecord(agent.id, event.event, order, event.boot_id, event.n, core.now, fields, files)
        core.emit(ch.AgentEventNoted(kept))
        core.report(EventKept(kept))

    def _has_rule(self, agent: str, event: str) -> bool:
        """Return whether a standing rule is on an event: then it was heard."""
        of = self._core.state.agents[agent].type
        rules = self._core.site.rules.values()
        return any(isinstance(rule.on, OnEvent) and rule.on.event == event and of in rule.types for rule in rules)

    def _forget_oldest(self, agent: str) -> None:
        """Count the event that the next one pushes out, unless a task took it, or a later one of its name."""
        core = self._core
        kept = core.state.agent_events.get(agent, [])
        if len(kept) < KEPT_EVENTS:
            return
        key = f"{agent}|{kept[0].event}"
        if self._has_rule(agent, kept[0].event):
            return
        if any(task.events.taken.get(key, 0) >= kept[0].order for task in core.state.tasks.values()):
            return
        if core.count(f"unheard|{agent}") == KEPT_EVENTS + 1:
            what = f"no task took more than {KEPT_EVENTS} events of {agent}, and they are forgotten"
            text = f"{what}; the last was '{kept[0].event}'"
            core.effect(Alarm("events_unheard", text, "", agent))
