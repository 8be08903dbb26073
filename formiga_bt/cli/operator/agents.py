"""`formiga agents`: list machines and people.

`agents clear ID` takes one back, `agents removed ID` says that a lost one was taken away; `agents handback ID` is short for
`handback ID --end`. Who belongs to the fleet: `cli.operator.members`.
"""

import sys
from typing import Annotated

import typer
from msgspec.structs import replace

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.operator import members
from formiga_bt.cli.options import JsonOption, SiteOption, TokenFileOption, UrlOption, print_table
from formiga_bt.cli.ordering import EXIT_NO
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import connect
from formiga_bt.show.facts import AgentFact, AgentList, OrderFact
from formiga_bt.show.listed import where_words

ORDERS = ("clear", "removed", "handback", "out", "in")
FLEETS = "fleets"
WORDS = (*ORDERS, *members.ORDERS, FLEETS)
HEARD = {"ALIVE": "yes", "SUSPECT": "suspect", "LOST": "lost"}
"""Whether an agent is heard of."""


def command(
    order: Annotated[
        str, typer.Argument(help=f"{', '.join(WORDS)}; without it the agents are listed.", show_default=False)
    ] = "",
    agent: Annotated[str, typer.Argument(help="The agent of the order, or the name of a fleet.", metavar="[ID]")] = "",
    unknown: Annotated[bool, typer.Option("--unknown", help="List only those that are not admitted, and why.")] = False,
    kind: Annotated[str, typer.Option("--type", help="With add: its type, if it has not announced itself yet.")] = "",
    home: Annotated[str, typer.Option("--home", help="With add: its own port or station.", metavar="NAME")] = "",
    by: Annotated[str, typer.Option("--by", help="Who says so; in mode real an approver.", metavar="NAME")] = "",
    reason: Annotated[str, typer.Option("--reason", help="With out: why, for those who ask.", metavar="TEXT")] = "",
    yes_removed: Annotated[
        str,
        typer.Option(
            "--yes-removed", help="For scripts: the machine's name once more, instead of typing it.", metavar="ID"
        ),
    ] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
    url: UrlOption = "",
    token_file: TokenFileOption = None,
) -> None:
    """List machines and people, say what became of one, or who belongs to the fleet.

    clear: you have looked at a machine that is quarantined, or was started anew, and trust it again; it comes home if it may be
    airborne.
    removed: you have taken away a machine that counts as lost; others may fly and land where it was. You type its name.
    out: no task gets the machine any more, once it has ended what it does; say --reason. in: it is fit again.
    handback: short for formiga handback ID --end. Example: formiga agents clear hwd_1

    add: it belongs to the fleet, as if the site file listed it: no approval of a task ends. In mode real an approver says so,
    with their secret. remove: it does no more. save, load: keep that fleet under a name, and add all of it; fleets lists them.
    """
    if order and (order not in WORDS or not (agent or order == FLEETS)):
        known = [f"formiga agents {one}{'' if one == FLEETS else ' ID'}" for one in WORDS]
        raise UnusableFile(f"say `formiga agents`, or one of: {', '.join(known)}")
    if (kind or home) and order != "add":
        raise UnusableFile("--type and --home belong to `formiga agents add ID`")
    if yes_removed and order != "removed":
        raise UnusableFile("--yes-removed belongs to `formiga agents removed ID`")
    if bool(reason) != (order == "out"):
        raise UnusableFile(
            "say why: formiga agents out ID --reason TEXT" if order == "out" else "--reason belongs to `out`"
        )
    client = connect(site, url, token_file)
    if order == FLEETS:
        members.show_fleets(client, as_json=as_json)
        return
    if order in members.ORDERS:
        more = {"type": kind, "home": home} if order == "add" else {}
        members.order(client, order, agent, {"by": by or user(), **more}, as_json=as_json)
        return
    if order:
        match order:
            case "removed":
                said = client.removed(agent, confirmed=_typed(agent, yes_removed), by=user())
            case "clear":
                said = client.clear(agent, by=user())
            case "out":
                said = client.out(agent, reason, by=by or user())
            case "in":
                said = client.back(agent, by=by or user())
            case _:
                said = client.hand_back(agent, by=user()).text
        if as_json:
            print_json({"text": said})
            return
        typer.echo(said)
        show_next("formiga agents", "formiga tasks")
        return
    found = client.agents()
    if unknown:
        found = replace(found, agents=tuple(one for one in found.agents if one.refused))
    if as_json:
        print_json(found)
        return
    if unknown and not found.agents:
        typer.echo("every agent that announced itself is admitted")
        return
    if not found.agents:
        typer.echo(f"no agents yet; they connect at {client.address.endpoint}")
        show_next("formiga up --sim starts simulated ones with the engine")
        return
    if found.lockdown.on:
        typer.echo(found.lockdown.text)
    orders = {order.agent: order for order in found.orders}
    rows = (_row(one, orders.get(one.id)) for one in found.agents)
    print_table([("AGENT", "TYPE", "STATE", "BATTERY", "WHERE", "TASK", "ACTION", "HEARD", "NOTE"), *rows])
    show_next(*_suggestions(found))


def _typed(agent: str, yes_removed: str) -> str:
    """Return the name of the machine as a person typed it once more."""
    what = f"others may then fly and land where {agent} was last; say so only if you have taken it away"
    if not yes_removed and not sys.stdin.isatty():
        raise UnusableFile(f"{what}: confirm it with --yes-removed {agent}")
    typed = yes_removed or typer.prompt(
        f"{what[0].upper()}{what[1:]}. Type its name to do it", default="", show_default=False
    )
    if typed != agent:
        if yes_removed:
            raise UnusableFile(f"--yes-removed says {yes_removed}, the word is for {agent}; nothing was done")
        typer.echo(f"that is not {agent}; nothing was done", err=True)
        raise typer.Exit(EXIT_NO)
    return typed


def _suggestions(found: AgentList) -> list[str]:
    bad = [
        f"formiga why {a.id}" if a.quarantine == "double" else f"formiga agents clear {a.id}"
        for a in found.agents
        if (a.quarantine or (a.rebooted and (a.order or a.task))) and a.liveness == "ALIVE"
    ]
    back = [
        f"formiga handback {a.id} --continue|--return|--end" for a in found.agents if a.taken and a.control == "engine"
    ]
    stopped = [order for order in found.orders if order.scope in ("agent", "task", "all")]
    ways = [order.next[0] for order in stopped if order.next[0] != "formiga agents"]
    locked = ["formiga lockdown release"] if found.lockdown.on else []
    if locked:
        ways = []
    new = [f"formiga agents add {a.id}" for a in found.agents if a.refused == "unlisted"]
    return list(dict.fromkeys([*locked, *back, *bad, *ways, *new])) or ["formiga run TASK --follow"]


def _value(value: object) -> str:
    """Return a value of a status as people read it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _row(agent: AgentFact, order: OrderFact | None) -> tuple[str, ...]:
    place = where_words(agent)
    state = agent.pool if not agent.human else "here" if agent.at_desk else "person"
    notes = [
        agent.order,
        agent.quarantine,
        agent.out and f"out of service: {agent.out}",
        "started anew" if agent.rebooted else "",
        agent.refused and f"not admitted: {agent.refused}",
        "" if agent.control == "engine" else f"control: {agent.control}",
        "waits for handback" if agent.taken and agent.control == "engine" else "",
        agent.breach and f"breaks its limit: {agent.breach}",
        *(f"{name}: {_value(value)}" for name, value in agent.fields.items()),
        "charges" if agent.charging else "",
        agent.floor and f"floor {agent.floor}",
        *agent.errors,
        f"{agent.wire} lacks {', '.join(agent.lacks)}" if agent.lacks else "",
        *(f"{name} is refused" for name in (*agent.refused_actions, *agent.refused_fields)),
    ]
    return (
        agent.id,
        agent.type,
        state,
        agent.charge,
        place,
        agent.task or (order.task if order is not None else ""),
        agent.action,
        HEARD[agent.liveness],
        ", ".join(note for note in notes if note),
    )
