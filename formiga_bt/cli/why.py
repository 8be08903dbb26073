"""`formiga why`: explain why a task waits, is held, chose its agents, or failed; or why a machine does what it does."""

from typing import Annotated, Any

import typer

from formiga_bt.cli.client import ApiError, JsonOption, SiteOption, connect, print_json, segment, show_next

POOLS = ("STANDBY", "ASSIGNED", "QUARANTINED", "PARKED_AWAY", "")
"""States of agents, not of tasks."""
OVER = ("SUCCEEDED", "FAILED", "CANCELED")


def command(
    task: Annotated[str, typer.Argument(help="A task's id, for example PickUp-12, or an agent's.", metavar="ID")],
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Explain a task in plain words: what it waits for, who holds it, why these agents, why it failed.

    Of an agent: who has it, which order stands on it, what it waits for, its task. Example: formiga why hwd_1
    """
    client = connect(site)
    try:
        found = client.get(f"/v1/tasks/{segment(task)}/why")
    except ApiError as unknown:
        if unknown.code != "unknown_task":
            raise
        try:
            found = client.get(f"/v1/agents/{segment(task)}/why")
        except ApiError as error:
            raise unknown from error
    if as_json:
        print_json(found)
        return
    typer.echo(in_words(found))
    show_next(*suggestions(found))


def in_words(found: dict[str, Any]) -> str:
    """Return an explanation as people read it."""
    lines = [f"{found['task']} {found['status']}" + (" HELD" if found["held"] else "")]
    for because in found["because"]:
        indent = "  " * (because["depth"] + 1)
        lines.append(f"{indent}{because['text']}")
        if because["hint"]:
            lines.append(f"{indent}    -> {because['hint']}")
    return "\n".join(lines)


def suggestions(found: dict[str, Any]) -> list[str]:
    """Return what may come next."""
    hints = [b["hint"] for b in found["because"] if b["hint"].startswith("formiga ")]
    if hints or found["status"] in POOLS:
        return hints[:1] or ["formiga agents"]
    return ["formiga tasks"] if found["status"] in OVER else [f"formiga abort {found['task']}"]
