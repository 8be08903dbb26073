"""A proposal of an assistant: a draft like those of `formiga draft`, which waits for a person.

Nothing here starts anything: what is written is data, and only a person's word makes a run of it.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Final

from formiga_bt.errors import FormigaError
from formiga_bt.llm.drafts import TASK, Kept, keep, numbers
from formiga_bt.llm.records import Draft, Flight, Origin, Value
from formiga_bt.mcp_server.ground import Ground
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


def next_steps(kept: Kept, ground: Ground, params: Mapping[str, str], *, is_there: bool) -> list[str]:
    """Return the commands with which a person reads a proposal and runs it; each word is quoted for a shell.

    Args:
        kept: the proposal.
        ground: its site.
        params: what the task is to be run with.
        is_there: it is a task of the site or of the library already.
    """
    task = kept.draft.task
    values = [f"-p {quote(f'{name}={text}')}" for name, text in params.items()]
    run = " ".join(["formiga run", task, *values])
    real = ground.site.mode == "real"
    by = ground.site.people.get("approvers", ("NAME",))[0]
    file = quote(str(kept.folder / TASK))
    if is_there:
        return [f"formiga show {task}", *([f"formiga approve {task} --by {by}"] if real else []), run]
    if ground.own is None:
        return [f"formiga show {file}", f"formiga up --site demo --sim --tasks {file}", run]
    own = ground.own / f"{re.sub(r'(?<=[a-z0-9])(?=[A-Z])', '_', task).lower()}.yaml"
    mine = quote(str(own))
    run = " ".join(["formiga run", mine, *values])
    approve = [f"formiga load {mine}", f"formiga approve {mine} --by {by}"] if real else []
    return [f"formiga show {file}", f"cp -n {file} {mine}", *approve, run]
