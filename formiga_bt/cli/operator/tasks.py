"""`formiga tasks`: list the tasks of a running engine."""

from datetime import datetime
from typing import Annotated, Any

import typer

from formiga_bt.cli.client import (
    JsonOption,
    NoEngine,
    SiteOption,
    TokenFileOption,
    UrlOption,
    connect,
    lasted,
    print_json,
    print_table,
    show_next,
    tell_clock,
)


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
        _library(client.get("/v1/library"), as_json)
        return
    found = client.get("/v1/tasks", status=status, limit=limit)
    if as_json:
        print_json(found)
        return
    rows: list[tuple[str, ...]] = [("TASK", "STATUS", "PRIORITY", "REQUESTED", "TOOK", "AGENTS", "")]
    rows += [_row(task) for task in found["tasks"]]
    if found["lockdown"]["on"]:
        typer.echo(found["lockdown"]["text"])
    if len(rows) == 1:
        typer.echo("no tasks" + (f" that are {status}" if status else ""))
        show_next("formiga run TASK --follow", "formiga tasks --library")
        return
    print_table(rows)
    first = found["tasks"][0]["id"]
    if found["total"] > len(found["tasks"]):
        typer.echo(f"... and {found['total'] - len(found['tasks'])} more: --limit {found['total']}")
    held = [task["id"] for task in found["tasks"] if task["held"]]
    show_next(*(["formiga lockdown release"] if found["lockdown"]["on"] else []), f"formiga why {[*held, first][0]}")


def _row(task: dict[str, Any]) -> tuple[str, ...]:
    at = datetime.fromtimestamp(task["unix_millis_submitted"] / 1000).astimezone()
    requested = f"{at:%H:%M:%S}" if at.date() == datetime.now(at.tzinfo).date() else f"{at:%Y-%m-%d %H:%M}"
    status = task["status"] + (" HELD" if task["held"] else "")
    orders = [f"{order['agent']}: {order['note']}" for order in task["orders"] if task["section"] != "done"]
    slow = ["throttled"] if task["throttled"] else []
    held = _held(task["held"], task["orders"])
    why = "; ".join([*held, *orders, *slow]).strip("; ") or f"{task['code']} {task['reason']}".strip()
    took = lasted(task["duration_s"])
    why = "; ".join(part for part in (why, _family(task)) if part)
    return task["id"], status, task["priority"], requested, took, " ".join(task["agents"]), why


def _held(causes: list[str], orders: list[dict[str, Any]]) -> list[str]:
    """Return why a task is held, in words, without what an order of its machines says anyway."""
    from formiga_bt.show.history.notes import hold_words

    ordered = {order["agent"] for order in orders}
    told = []
    for cause in causes:
        word, _, agent = cause.partition(":")
        if word != "operator" or not (agent in ordered if agent else ordered):
            told.append(hold_words(cause))
    return list(dict.fromkeys(told))


def _family(task: dict[str, Any]) -> str:
    """Return which version a task runs if there are several, who requested it, and whom it requested."""
    parts = [f"version {task['version']}, newest {task['newest']}"] if task.get("newest", 1) > 1 else []
    parts += [f"of {task['parent']}"] if task.get("parent") else []
    return ", ".join(parts + ([f"requested {' '.join(task['children'])}"] if task.get("children") else []))


def _library(found: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    for task in found["tasks"]:
        also = f" (also {', '.join(task['aliases'])})" if task.get("aliases") else ""
        also += f" version {task['version']} ({task['bundle'][:8]})" if task.get("version", 1) > 1 else ""
        typer.echo(f"{task['task']}{also}  {task['description']}")
        for param in task["params"]:
            need = "" if param["required"] else f" = {param['default']}" if param["default"] else " (optional)"
            typer.echo(
                f"    --param {param['name']}=<{param['type']}>{need}  {param['label'] or param['help']}".rstrip()
            )
    for text in found["refused"]:
        typer.echo(f"not served: {text}")
    show_next("formiga run TASK --param NAME=VALUE --follow")
