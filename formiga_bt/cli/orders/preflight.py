"""`formiga preflight`: whether machines are ready to fly."""

from typing import Annotated

import typer

from formiga_bt.cli.options import JsonOption, SiteOption, print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import connect
from formiga_bt.show.facts import PreflightFact

EXIT_NO = 1


def command(
    agent: Annotated[
        str, typer.Argument(help="The machine, for example hwd_1. Without it: all.", metavar="AGENT")
    ] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Show what each machine found when it looked at itself before a flight.

    Exit code 0: all that stand on the ground are ready. 1: one is not, or has told nothing yet.
    Example: formiga preflight hwd_1
    """
    client = connect(site)
    names = [agent] if agent else [one.id for one in client.agents().agents if not one.human]
    found = [client.preflight(name) for name in names]
    if as_json:
        print_json(found[0] if agent else {"agents": found})
    elif not found:
        typer.echo("no machines yet")
    else:
        print_table([("AGENT", "CHECK", "OK", "TEXT"), *(row for one in found for row in _rows(one))])
        for one in found:
            if one.airborne:
                typer.echo(one.text)
        bad = [one.agent for one in found if not one.ok and not one.airborne]
        if found[0].required and bad:
            typer.echo(f"this site grants no machine that is not ready: {', '.join(bad)}")
        show_next("formiga agents")
    if any(not one.ok and not one.airborne for one in found):
        raise typer.Exit(EXIT_NO)


def _rows(found: PreflightFact) -> list[tuple[str, ...]]:
    if not found.checks:
        return [(found.agent, "", "?", "no checks reported" + (": not on the ground" if found.airborne else " yet"))]
    return [(found.agent, one.check, "ok" if one.ok else "NO", one.text) for one in found.checks]
