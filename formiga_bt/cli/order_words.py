"""Giving an order to a running engine, and what its answer says to people. Nothing here needs the command line library."""

from typing import TYPE_CHECKING

from formiga_bt.base.errors import UnusableFile
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import Client

if TYPE_CHECKING:
    from formiga_bt.show.facts import OrderReply

EXIT_NO = 1


def give_order(client: Client, order: str, target: str, *, everything: bool, by: str, as_json: bool) -> int:
    """Give an order to a machine, a task or all, tell what it did, and return the exit code.

    1: a machine that may be in the air did not get it, or may not have got it.

    Raises:
        UnusableFile: it is not said for what, or twice.
    """
    if order == "continue" and not everything and not target:
        held = [task.id for task in client.tasks("held").tasks]
        if held:
            these = ", ".join(f"formiga continue {task}" for task in held[:3])
            raise UnusableFile(f"say for what: {these}{' ...' if len(held) > 3 else ''}, or formiga continue --all")
    if everything == bool(target):
        raise UnusableFile(
            f"say for what: formiga {order} hwd_1 (a machine), formiga {order} PickUp-3 (a task), or formiga {order} --all"
        )
    return told(client.order(order, target, by=by or user()), as_json=as_json)


def lock_down(client: Client, how: str, *, by: str, as_json: bool) -> int:
    """Press lockdown or release it, tell what it did, and return the exit code."""
    return told(client.lock_down(how, by=by or user()), as_json=as_json)


def told(reply: "OrderReply", *, as_json: bool) -> int:
    """Print what an order did, a line for each machine, then what a person must do next; return the exit code."""
    if as_json:
        print_json(reply)
    else:
        said = in_words(reply)
        print(said)
        show_next(*reply.next, said=said)
    return EXIT_NO if any(one.may_be_airborne for one in reply.skipped) else 0


def in_words(reply: "OrderReply") -> str:
    """Return what an order did, as people read it."""
    lines = [reply.text]
    lines += [f"  {one.text}" for one in reply.ordered if one.text not in reply.text]
    for one in reply.skipped:
        said = one.text.removeprefix(one.who).lstrip(": ")
        waits = one.code in (
            "held",
            "cannot_continue",
            "order_under_way",
        )  # a task that waits for a word, not one that was not reached
        mark = "UNSURE" if one.code == "suspect" else "NOT"
        lines.append(f"  {one.text}" if waits else f"  {mark} {one.who}: {said} ({one.code})")
        if one.hint:
            lines.append(f"      -> {one.hint}")
    return "\n".join(lines)
