"""What the verbs of orders share for the command line library: their arguments and options, and exit codes as it knows them."""

from typing import Annotated

import typer

from formiga_bt.cli.order_words import EXIT_NO, give_order, told
from formiga_bt.client import Client
from formiga_bt.show.facts import OrderReply

__all__ = ["EXIT_NO", "AllOption", "ByOption", "TargetArgument", "give", "leave", "tell"]

TargetArgument = Annotated[
    str, typer.Argument(help="A machine or a task, for example hwd_1 or PickUp-3.", metavar="TARGET")
]
AllOption = Annotated[bool, typer.Option("--all", help="Every machine of the site.")]
ByOption = Annotated[str, typer.Option(help="Who gives the order. Default: you.", metavar="NAME")]


def give(client: Client, order: str, target: str, *, everything: bool, by: str, as_json: bool) -> None:
    """Give an order to a machine, a task or all, and tell what it did.

    Exits with 1 if a machine that may be in the air did not get it.
    """
    leave(give_order(client, order, target, everything=everything, by=by, as_json=as_json))


def tell(reply: OrderReply, *, as_json: bool) -> None:
    """Print what an order did: a line for each machine, then what a person must do next."""
    leave(told(reply, as_json=as_json))


def leave(code: int) -> None:
    """End the verb with an exit code, if it is not 0."""
    if code:
        raise typer.Exit(code)
