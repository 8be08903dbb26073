"""A proposal of an assistant: a draft like those of `formiga draft`, which waits for a person.

Nothing here starts anything: what is written is data, and only a person's word makes a run of it.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from formiga_bt.errors import FormigaError
from formiga_bt.llm.drafts import Kept, keep, numbers
from formiga_bt.llm.records import Draft, Flight, Origin, Value
from formiga_bt.mcp_server.outside import cleaned
from formiga_bt.mcp_server.records import FlightOut

MOST_OPEN: Final = 50
"""Drafts that may wait; an assistant that proposes without end is stopped here."""


def draft_of(
    yaml: str,
    flight: FlightOut,
    params: Mapping[str, str],
    why: str,
    client: str,
    warnings: list[str],
    unix_millis: int = 0,
) -> tuple[Draft, Origin]:
    """Return a proposal as the draft that a person is shown, and where it came from."""
    told = Flight(
        task=flight.task,
        status=flight.status,
        code=flight.code,
        reason=flight.reason,
        duration_s=flight.duration_s,
        agents={role: tuple(ids) for role, ids in flight.agents.items()},
        asked=tuple(dict.fromkeys(one.who for one in flight.questions)),
        crashes=flight.crashes,
        least_battery=flight.least_battery_percent,
    )
    name = f"mcp:{cleaned(client, 60) or 'unknown'}"
    draft = Draft(
        request=why,
        kind="task",
        plan="; ".join(warnings),
        task=flight.task,
        yaml=yaml,
        values=tuple(Value(one, text) for one, text in params.items()),
        flight=told,
        provider=name,
    )
    return draft, Origin(
        by=name, request=why, provider=name, model="", prompt_sha256="", rounds=1, unix_millis=unix_millis
    )


def propose(folder: Path, draft: Draft, origin: Origin) -> Kept:
    """Keep a proposal among the drafts of a site.

    Raises:
        FormigaError: too many wait already, or it cannot be written.
    """
    if len(numbers(folder)) >= MOST_OPEN:
        raise FormigaError(
            f"{MOST_OPEN} drafts wait in {folder}\n  help: a person looks at them first, and removes what is not wanted"
        )
    return keep(folder, draft, origin)
