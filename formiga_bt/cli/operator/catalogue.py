"""`formiga catalogue`: the types and actions of a running engine, and what its agents announced besides."""

from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect, segment
from formiga_bt.show.facts import CatalogueFact, DiscoveredFact, OrderDone, PilotList

ORDERS = ("add", "text")


def command(
    order: Annotated[
        str, typer.Argument(help="add or text; without it the catalogue is listed.", metavar="[add|text]")
    ] = "",
    action: Annotated[str, typer.Argument(help="An action that agents announced.", metavar="[ACTION]")] = "",
    by: Annotated[str, typer.Option("--by", help="Who says so; in mode real an approver.", metavar="NAME")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List the types of a running engine with their actions, and the actions that agents announced and no catalogue has.

    In mode simulation tasks may use those at once. In mode real an approver says so: add ACTION. text ACTION prints it as a
    catalogue writes it, for a file of your own. Example: formiga catalogue add Spray --by ann
    """
    if order and (order not in ORDERS or not action):
        raise UnusableFile(
            "say `formiga catalogue`, `formiga catalogue add ACTION`, or `formiga catalogue text ACTION`"
        )
    client = connect(site, url, token_file)
    if order == "add":
        name, headers = by or user(), {}
        if client.get(PilotList, "/v1/pilots").mode == "real":
            from formiga_bt.cli.proving import secret_header

            headers = secret_header(name)
        done = client.post(OrderDone, f"/v1/catalogue/{segment(action)}", {"by": name}, headers=headers)
        print_json(done) if as_json else typer.echo(done.text)
        return
    found = client.get(CatalogueFact, "/v1/catalogue")
    if order == "text":
        one = next((one for one in found.discovered if one.action == action), None)
        if one is None:
            known = ", ".join(one.action for one in found.discovered) or "none"
            raise UnusableFile(f"no agent announced '{action}'; announced are: {known}")
        print_json(one) if as_json else typer.echo(one.text, nl=False)
        return
    if as_json:
        print_json(found)
        return
    print_table([("TYPE", "MOVES", "ACTIONS"), *((t.name, t.mobility, ", ".join(t.actions)) for t in found.types)])
    if found.discovered:
        typer.echo()
        print_table([("ANNOUNCED", "TYPES", "BY AGENTS", "STATE"), *map(_row, found.discovered)])
    new = [f"formiga catalogue add {one.action}" for one in found.discovered if not one.known and not one.fault]
    show_next(*(new or ["formiga explain ACTION"]))


def _row(one: DiscoveredFact) -> tuple[str, ...]:
    state = one.fault or ("tasks may use it" if one.known else "waits for an approver")
    return (one.action, ", ".join(one.types), ", ".join(one.agents), state)
