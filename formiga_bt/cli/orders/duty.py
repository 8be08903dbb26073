"""`formiga duty`: pilots go on duty and off."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, print_table
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect, segment
from formiga_bt.show.facts import OrderDone, PilotList


def command(
    pilot: Annotated[str, typer.Argument(help="A pilot whom the site file names.", metavar="[PILOT]")] = "",
    word: Annotated[str, typer.Argument(help="on or off", metavar="[on|off]")] = "",
    listed: Annotated[bool, typer.Option("--list", help="List the pilots.")] = False,
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:
    """Put a pilot on duty, or take them off. In mode real each machine flies under the name of a pilot on duty.

    There the pilot's own secret is asked for (formiga access secret PILOT), or taken from FORMIGA_SECRET, or the file that
    FORMIGA_SECRET_FILE names.

    Whoever goes off duty gets no more machines; those under their name already stay so until they are released. After a
    start of the engine nobody is on duty.
    """
    if (pilot and word not in ("on", "off")) or (not pilot and not listed):
        raise UnusableFile("say formiga duty PILOT on, formiga duty PILOT off, or formiga duty --list")
    client = connect(site)
    found = client.get(PilotList, "/v1/pilots")
    if pilot:
        headers = {}
        if found.mode == "real":
            from formiga_bt.cli.proving import secret_header

            headers = secret_header(pilot)
        body = {"on": word == "on", "by": user()}
        said = client.post(OrderDone, f"/v1/pilots/{segment(pilot)}/duty", body, headers=headers)
        if as_json:
            print_json(said)
            return
        typer.echo(said.text)
        show_next("formiga duty --list", "formiga tasks")
        return
    if as_json:
        print_json(found)
        return
    if not found.pilots:
        typer.echo("the site file names no pilots")
        return
    rows = [
        (p.pilot, "off" if p.since is None else "on", f"{len(p.machines)} of {p.max_airborne}", ", ".join(p.machines))
        for p in found.pilots
    ]
    print_table([("PILOT", "DUTY", "MACHINES", "WHICH"), *rows])
    if found.mode != "real":
        typer.echo(f"the site is in mode {found.mode}: machines fly without a pilot's name")
