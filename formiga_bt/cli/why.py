"""`formiga why`: explain why a task waits, is held, chose its agents, or failed."""

from typing import Annotated, Any

import typer

from formiga_bt.cli.client import JsonOption, SiteOption, connect, print_json, segment, show_next

OVER = ("SUCCEEDED", "FAILED", "CANCELED")


def command(
    task: Annotated[str, typer.Argument(help="The task's id, for example PickUp-12.", metavar="ID")],
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Explain a task in plain words: what it waits for, who holds it, why these agents, why it failed."""
    found = connect(site).get(f"/v1/tasks/{segment(task)}/why")
    if as_json:
        print_json(found)
        return
    typer.echo(in_words(found))
    show_next(*suggestions(found))


def in_words(found: dict[str, Any]) -> str:
    """Return an explanation as people read it."""
    lines = [f"{found['task']} {found['status']}" + (" HELD" if found["held"] else "")]
    for because in found["because"]:
        lines.append(f"  {because['text']}")
        if because["hint"]:
            lines.append(f"      -> {because['hint']}")
    return "\n".join(lines)


def suggestions(found: dict[str, Any]) -> list[str]:
    """Return what may come next."""
    hints = [b["hint"] for b in found["because"] if b["hint"].startswith("formiga ")]
    return hints[:1] or (["formiga tasks"] if found["status"] in OVER else [f"formiga abort {found['task']}"])
