"""`formiga tasks`: list the tasks of a running engine."""

from collections.abc import Collection, Sequence
from datetime import datetime
from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table, tell_clock
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import NoEngine, connect
from formiga_bt.show.facts import LibraryList, TaskFact, TaskList
from formiga_bt.show.history.notes import hold_words
from formiga_bt.show.why.words import span


def command(
    status: Annotated[
        str, typer.Option(help="Only: open, held, or one status, for example FAILED.", metavar="STATUS")
    ] = "",
    limit: Annotated[int, typer.Option(help="At most so many.", min=1, max=10_000)] = 30,
    library: Annotated[bool, typer.Option("--library", help="List what can be requested instead.")] = False,
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List tasks, those under way first, then the newest: id, status, agents, what became of it."""
    try:
        client = connect(site, url, token_file)
    except NoEngine as error:
        from formiga_bt.cli.past import with_journal

        raise with_journal(error, site, url) from error
    tell_clock(client)
    if library:
        _library(client.library(), as_json)
        return
    found = client.tasks(status, limit)
    if as_json:
        print_json(found)
        return
    rows: list[tuple[str, ...]] = [("TASK", "STATUS", "PRIORITY", "REQUESTED", "TOOK", "AGENTS", "")]
    rows += [_row(task, found) for task in found.tasks]
    if found.lockdown.on:
        typer.echo(found.lockdown.text)
    if len(rows) == 1:
        typer.echo("no tasks" + (f" that are {status}" if status else ""))
        show_next("formiga run TASK --follow", "formiga tasks --library")
        return
    print_table(rows)
    if found.total > len(found.tasks):
        typer.echo(f"... and {found.total - len(found.tasks)} more: --limit {found.total}")
    held = [task.id for task in found.tasks if task.held]
    show_next(
        *(["formiga lockdown release"] if found.lockdown.on else []), f"formiga why {[*held, found.tasks[0].id][0]}"
    )


def _row(task: TaskFact, found: TaskList) -> tuple[str, ...]:
    at = datetime.fromtimestamp(task.submitted_at / 1e6).astimezone()
    requested = f"{at:%H:%M:%S}" if at.date() == datetime.now(at.tzinfo).date() else f"{at:%Y-%m-%d %H:%M}"
    status = task.status + (" HELD" if task.held else "")
    mine = [] if task.is_over else [order for order in found.orders if order.agent in task.agents]
    orders = [f"{order.agent}: {order.note}" for order in mine]
    slow = ["throttled"] if task.throttled_since is not None else []
    held = _held(task.held, {order.agent for order in mine})
    why = "; ".join([*held, *orders, *slow]).strip("; ") or f"{task.code} {task.reason}".strip()
    why = why or (task.doing if task.status == "PENDING" else "")
    took = span((found.at if task.ended_at is None else task.ended_at) - task.submitted_at)
    why = "; ".join(part for part in (why, _family(task)) if part)
    return task.id, status, task.priority, requested, took, " ".join(task.agents), why


def _held(causes: Sequence[str], ordered: Collection[str]) -> list[str]:
    """Return why a task is held, in words, without what an order of its machines says anyway."""
    told = []
    for cause in causes:
        word, _, agent = cause.partition(":")
        if word != "operator" or not (agent in ordered if agent else ordered):
            told.append(hold_words(cause))
    return list(dict.fromkeys(told))


def _family(task: TaskFact) -> str:
    """Return which version a task runs if there are several, which task or rule requested it, and whom it requested."""
    parts = [task.versions] if task.versions else []
    parts += [f"of {task.parent}"] if task.parent else [f"by {task.by}"] if task.by.startswith("rule:") else []
    return ", ".join(parts + ([f"requested {' '.join(task.children)}"] if task.children else []))


def _library(found: LibraryList, as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    for task in found.tasks:
        also = f" (also {', '.join(task.aliases)})" if task.aliases else ""
        also += f" version {task.version} ({task.bundle[:8]})" if task.version > 1 else ""
        typer.echo(f"{task.task}{also}  {task.description}")
        for param in task.params:
            need = "" if param.required else f" = {param.default}" if param.default else " (optional)"
            typer.echo(f"    --param {param.name}=<{param.type}>{need}  {param.label or param.help}".rstrip())
    for text in found.refused:
        typer.echo(f"not served: {text}")
    show_next("formiga run TASK --param NAME=VALUE --follow")
