"""Who belongs to the fleet besides the site file's agents: the orders add, remove, save and load of `formiga agents`."""

from collections.abc import Mapping

import typer

from formiga_bt.cli.options import print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.client import Client, segment
from formiga_bt.show.facts import FleetFact, FleetList, FleetLoaded, OrderDone, PilotList

ORDERS = ("add", "remove", "save", "load")


def order(client: Client, word: str, name: str, body: Mapping[str, str], *, as_json: bool) -> None:
    """Carry out one of `ORDERS`.

    Args:
        client: of the engine.
        word: which.
        name: of the agent, or of the fleet.
        body: who says it, and of `add` the type and the home.
        as_json: print JSON instead of text.
    """
    headers = {} if word == "save" else _secret(client, body["by"])
    match word:
        case "add" | "remove":
            path = f"/v1/agents/{segment(name)}/member" + ("/remove" if word == "remove" else "")
            done = client.post(OrderDone, path, body, headers=headers)
            _print(done, done.text, as_json=as_json)
        case "save":
            fleet = client.post(FleetFact, f"/v1/fleets/{segment(name)}", body)
            _print(fleet, f"{name}: {', '.join(one.agent for one in fleet.agents)}", as_json=as_json)
        case _:
            loaded = client.post(FleetLoaded, f"/v1/fleets/{segment(name)}/load", body, headers=headers)
            lines = [f"added: {', '.join(loaded.added) or 'nobody'}"]
            lines += [f"not added: {one.who}: {one.text}" for one in loaded.skipped]
            _print(loaded, "\n".join(lines), as_json=as_json)
    if not as_json:
        show_next("formiga agents", "formiga agents fleets")


def show_fleets(client: Client, *, as_json: bool) -> None:
    """Print the fleets that were saved."""
    found = client.get(FleetList, "/v1/fleets")
    if as_json:
        print_json(found)
        return
    if not found.fleets:
        typer.echo("no fleet was saved yet")
        show_next("formiga agents save NAME")
        return
    print_table([("FLEET", "AGENTS"), *((one.name, ", ".join(a.agent for a in one.agents)) for one in found.fleets)])
    show_next("formiga agents load NAME")


def _secret(client: Client, by: str) -> dict[str, str]:
    """Return the header with a person's secret, where the site is real."""
    if client.get(PilotList, "/v1/pilots").mode != "real":
        return {}
    from formiga_bt.cli.proving import secret_header

    return secret_header(by)


def _print(found: object, text: str, *, as_json: bool) -> None:
    if as_json:
        print_json(found)
    else:
        typer.echo(text)
