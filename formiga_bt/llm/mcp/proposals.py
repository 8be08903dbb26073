"""A proposal of an assistant: a draft like those of `formiga draft`, which waits for a person.

Nothing here starts anything: what is written is data, and only a person's word makes a run of it.
"""

import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from shlex import quote
from typing import Final

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.packaged import folder as packaged
from formiga_bt.lang.model import Site, Task
from formiga_bt.llm.drafts import PROPOSED, TASK, Brief, KeptDraft, briefs, delete, keep
from formiga_bt.llm.mcp.ground import ServedSite
from formiga_bt.llm.mcp.outside import cleaned
from formiga_bt.llm.mcp.records import FlightOut
from formiga_bt.llm.origin import Asker, approved, note_drafted
from formiga_bt.llm.records import Draft, Origin, ParamValue, RehearsedFlight
from formiga_bt.llm.world import RequestWorld

MOST_OPEN: Final = 50
"""Proposals that are kept; then the oldest gives way, so that an assistant that proposes without end fills no disk."""


def assistant(client: str) -> str:
    """Return how an assistant is called where its proposals are kept."""
    return f"{PROPOSED}{cleaned(client, 60) or 'unknown'}"


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
    told = RehearsedFlight(
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
    name = assistant(client)
    draft = Draft(
        request=why,
        kind="task",
        plan="; ".join(warnings),
        task=flight.task,
        yaml=yaml,
        values=tuple(ParamValue(one, text) for one, text in params.items()),
        flight=told,
        provider=name,
    )
    return draft, Origin(
        by=name, request=why, provider=name, model="", prompt_sha256="", rounds=1, unix_millis=unix_millis
    )


def propose(
    folder: Path, draft: Draft, origin: Origin, is_needed: Callable[[Brief], bool] = lambda _: False
) -> KeptDraft:
    """Keep a proposal among the drafts of a site. If too many wait, the oldest that nobody needs gives way.

    Args:
        folder: of the site's drafts.
        draft: the proposal.
        origin: where it came from.
        is_needed: tells of a proposal whether a person approved it, or it runs.

    Raises:
        FormigaError: too many wait and all are needed, or it cannot be written.
    """
    waiting = [one for one in briefs(folder) if one.is_proposal]
    if len(waiting) >= MOST_OPEN:
        old = next((one for one in waiting if not one.origin.approved_by and not is_needed(one)), None)
        if old is None:
            raise FormigaError(
                f"{MOST_OPEN} proposals are kept in {folder}, all approved or running",
                help="a person removes what is not wanted: formiga drafts delete N",
            )
        delete(folder, old.number)
    return keep(folder, draft, origin)


def needed(folder: Path, ground: ServedSite, running: Callable[[], set[str]]) -> Callable[[Brief], bool]:
    """Return what tells whether a proposal is approved as it is, or a task of its name runs.

    Args:
        folder: of the site's drafts.
        ground: its site.
        running: tells the names of the tasks that have not ended; asked only if there is need.
    """

    @cache
    def facts() -> tuple[set[str], Callable[[Task, Site], bool]]:
        return running(), approved(folder.parent)

    def is_needed(one: Brief) -> bool:
        names, is_approved = facts()
        if one.task in names:
            return True
        try:
            task = ground.load((one.folder / TASK).read_text(encoding="utf-8")).task
        except (OSError, UnicodeDecodeError):
            return False
        return task is not None and is_approved(task, ground.site)

    return is_needed


def wrote(kept: KeptDraft, yaml: str, ground: ServedSite, asker: Asker, unix_millis: int) -> None:
    """Write down that an assistant wrote a task, so that on a site in mode real another person approves it.

    Raises:
        SiteError: it cannot be written.
    """
    texts = {}
    for path in dict.fromkeys(ground.tasks.values()):
        with suppress(OSError, UnicodeDecodeError):
            texts[str(path)] = ground.read(path)
    task = ground.load(yaml).task
    world = RequestWorld(ground.catalogue, ground.site, (), texts)
    tasks = [task] if task is not None else []
    note_drafted(kept.folder.parent.parent, tasks, asker.record, world, draft=kept.number, unix_millis=unix_millis)


def next_steps(
    kept: KeptDraft, ground: ServedSite, params: Mapping[str, str], *, is_there: bool, asker: Asker | None = None
) -> list[str]:
    """Return the commands with which a person reads a proposal and runs it; each word is quoted for a shell.

    Args:
        kept: the proposal.
        ground: its site.
        params: what the task is to be run with.
        is_there: it is a task of the site or of the library already.
        asker: for whom it was written; somebody else approves it.
    """
    task = kept.draft.task
    values = [f"-p {quote(f'{name}={text}')}" for name, text in params.items()]
    run = " ".join(["formiga run", task, *values])
    real = ground.site.mode == "real"
    by = (asker or Asker("")).approver(ground.site)
    file = quote(str(kept.folder / TASK))
    if is_there:
        return [f"formiga show {task}", *([f"formiga approve {task} --by {by}"] if real else []), run]
    if ground.own is None:
        return [f"formiga show {file}", f"formiga up --site demo --sim --tasks {file}", run]
    mine = quote(str(own_file(kept, ground.own)))
    run = " ".join(["formiga run", mine, *values])
    approve = [f"formiga load {mine}", f"formiga approve {mine} --by {by}"] if real else []
    return [f"formiga show {file}", f"cp -n {file} {mine}", *approve, run]


def own_file(kept: KeptDraft, own: Path) -> Path:
    """Return where a proposal is kept among the tasks of a site: under a name that is free, or that has this very text."""
    name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", kept.draft.task).lower()
    text = (kept.folder / TASK).read_bytes()
    for number in count(1):
        path = own / (f"{name}.yaml" if number == 1 else f"{name}_{number}.yaml")
        with suppress(OSError):
            if path.read_bytes() == text:
                return path
        if not os.path.lexists(path):
            return path
    raise AssertionError("there are names without end")


def doubles(kept: KeptDraft, ground: ServedSite) -> list[str]:
    """Return a warning if the site has a task of a proposal's name already: it serves one of them from its next start on."""
    task = kept.draft.task
    other = ground.tasks.get(task)
    if ground.own is None or other is None or _ships(other) or other == own_file(kept, ground.own):
        return []
    return [f"{other} has a task {task} too: who keeps both names one of them otherwise"]


def _ships(path: Path) -> bool:
    return path.resolve().is_relative_to(packaged("trees").resolve())
