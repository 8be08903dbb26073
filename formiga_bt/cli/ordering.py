"""What the verbs of orders share: finding the target, giving the order, and telling what it did and what comes next."""

from typing import Annotated, Any

import typer

from formiga_bt.cli.client import Client, print_json, segment, show_next, user
from formiga_bt.cli.inputs import UnusableFile

EXIT_NO = 1
TargetArgument = Annotated[
    str, typer.Argument(help="A machine or a task, for example hwd_1 or PickUp-3.", metavar="TARGET")
]
AllOption = Annotated[bool, typer.Option("--all", help="Every machine of the site.")]
ByOption = Annotated[str, typer.Option(help="Who gives the order. Default: you.", metavar="NAME")]


def give(client: Client, order: str, target: str, *, everything: bool, by: str, as_json: bool) -> None:
    """Give an order to a machine, a task or all, and tell what it did.

    Exits with 1 if a machine that may be in the air did not get it.
    """
    if everything == bool(target):
        raise UnusableFile(
            f"say for what: formiga {order} hwd_1 (a machine), formiga {order} PickUp-3 (a task), or formiga {order} --all"
        )
    path = "/v1/orders" if everything else path_of(client, target)
    tell(client.post(path, {"order": order, "by": by or user()}), as_json=as_json)


def path_of(client: Client, target: str) -> str:
    """Return where orders for a machine or task go. What is no machine is taken for a task."""
    agents = {agent["id"] for agent in client.get("/v1/agents")["agents"]}
    kind = "agents" if target in agents else "tasks"
    return f"/v1/{kind}/{segment(target)}/orders"


def tell(reply: dict[str, Any], *, as_json: bool) -> None:
    """Print what an order did: a line for each machine, then what a person must do next."""
    if as_json:
        print_json(reply)
    else:
        typer.echo(in_words(reply))
        show_next(*reply["next"])
    if any(one["may_be_airborne"] for one in reply["skipped"]):
        raise typer.Exit(EXIT_NO)


def in_words(reply: dict[str, Any]) -> str:
    """Return what an order did, as people read it."""
    lines = [reply["text"]]
    lines += [f"  {one['text']}" for one in reply["ordered"] if one["text"] not in reply["text"]]
    for one in reply["skipped"]:
        said = one["text"].removeprefix(one["who"]).lstrip(": ")
        waits = one["code"] in ("held", "cannot_continue")  # a task that waits for a word, not one that was not reached
        lines.append(f"  {one['text']}" if waits else f"  NOT {one['who']}: {said} ({one['code']})")
        if one["hint"]:
            lines.append(f"      -> {one['hint']}")
    return "\n".join(lines)
