"""Fields that the statuses of a type say besides (`fields: {open: bool}` of the catalogue): typed, and readable in conditions.

A value of another type refuses that field and not the status: the field is unknown then, as before its first value, and
people get an alarm once. What the type does not declare is passed over.
"""

from formiga_bt.engine.goals.wire_values import read_value
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.transport.messages import AgentStatus


def take_fields(core: Core, agent: AgentRecord, status: AgentStatus) -> None:
    """Take the fields of a status. `agent` is its record from before."""
    types = core.agent_type(agent).fields if agent.type in core.catalogue.types else {}
    found, refused = {}, {}
    for name, kind in types.items():
        if name not in status.fields:
            continue
        raw = status.fields[name]
        try:
            value = read_value(kind, raw)
        except (KeyError, TypeError, ValueError):
            refused[name] = f"it says {str(raw)[:80]!r}, the catalogue says {kind}"
        else:
            found[name] = value
    if found != agent.fields or refused != agent.refused_fields:
        core.put_agent(agent.id, fields=found, refused_fields=refused)
    for name in refused:
        if name not in agent.refused_fields:
            core.effect(Alarm("field_refused", f"{agent.id}: {name} is refused: {refused[name]}", agent.task, agent.id))
