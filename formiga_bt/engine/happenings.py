"""Events that agents tell of themselves (`wait_for: picker.sos`): taken once each, kept for those who wait for them later.

An event that the agent's type does not have, or whose fields cannot be read, counts as a bad message.
"""

import msgspec

from formiga_bt.engine import changes as ch
from formiga_bt.engine.core import Core
from formiga_bt.engine.fleet import Fleet
from formiga_bt.engine.goals import read_result
from formiga_bt.engine.records import Happening
from formiga_bt.transport.messages import AgentEvent


class Happenings:
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
        if any((old.boot_id, old.n) == (event.boot_id, event.n) for old in core.state.happenings.get(agent.id, ())):
            return
        types = core.agent_type(agent).events.get(event.event)
        if types is None:
            self._fleet.on_bad(agent.id, f"{agent.type} has no event {event.event}")
            return
        try:
            fields = read_result(types, event.fields)
        except (msgspec.ValidationError, KeyError, TypeError, ValueError) as error:
            self._fleet.on_bad(agent.id, f"event {event.event} cannot be read: {error}")
            return
        if missing := [name for name in types if name not in fields]:
            self._fleet.on_bad(agent.id, f"event {event.event} misses {missing[0]}")
            return
        order = core.state.counters.get("happening", 0) + 1
        core.emit(ch.Happened(Happening(agent.id, event.event, order, event.boot_id, event.n, core.now, fields)))
