"""`formiga down`: end a running engine, at once or when its tasks have ended."""

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.site_folder import is_running
from formiga_bt.cli.options import SiteOption
from formiga_bt.cli.printing import show_next
from formiga_bt.client import Client, NoEngine, connect
from formiga_bt.show.facts import AgentList

END_S = 20.0


def command(
    drain: Annotated[
        bool, typer.Option("--drain", help="Admit no more tasks, and end when the last one has ended.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="Do not ask, also if machines are in the air or lockdown stands.")
    ] = False,
    site: SiteOption = None,
) -> None:
    """End the engine. Without --drain at once: agents go on with the goals they have; those of `up --sim` end too.

    Asks first if machines may be in the air, or lockdown or orders stand: nobody looks after them until the next start, which
    goes on with them from its journal.
    """
    client = connect(site)
    if not (drain or yes):
        _confirm(losses(client.agents()))
    typer.echo(client.drain() if drain else client.stop())
    _wait(client, drain)
    typer.echo(f"the engine of site '{client.address.site}' has ended")
    show_next("formiga up")


def losses(found: AgentList) -> list[str]:
    """Return what is left without an engine, or forgotten, if it ends now; in lines."""
    lines = []
    for agent in found.agents:
        if not agent.human and agent.landed != "grounded":
            doing = agent.action or agent.task or agent.quarantine or "nothing"
            lines.append(
                f"{agent.id} may be in the air ({doing}): it finishes the goal it has, then nobody commands it"
            )
    if found.lockdown.on:
        lines.append("lockdown stands: nobody keeps it until the next start, which knows it from its journal")
    orders = [f"{order.stop} of {order.agent}" for order in found.orders]
    if orders:
        lines.append(f"orders stand: nobody carries them out until the next start ({', '.join(orders)})")
    return lines


def _confirm(lines: list[str]) -> None:
    """Have a person confirm what is lost.

    Raises:
        UnusableFile: this is no terminal.
    """
    if not lines:
        return
    text = "\n".join(f"  {line}" for line in lines)
    if not sys.stdin.isatty():
        raise UnusableFile(
            f"to end the engine now means\n{text}", help="formiga return --all first, or confirm it: --yes"
        )
    typer.echo(f"To end the engine now means\n{text}")
    typer.confirm("End it?", abort=True)


def _wait(client: Client, drain: bool) -> None:
    until = time.monotonic() + END_S
    told = -1
    while is_running(Path(client.address.folder)):
        if drain:
            left = _left(client)
            if left > 0:
                until = time.monotonic() + END_S
                if left != told:
                    what = "1 task is" if left == 1 else f"{left} tasks are"
                    typer.echo(f"{what} left   (Ctrl-C: stop watching; the engine goes on draining)")
                    told = left
        if time.monotonic() > until:
            raise FormigaError(
                f"the engine (process {client.address.pid}) has not ended within {END_S:g} s",
                help=f"look at its terminal, or end its process: kill {client.address.pid}",
            )
        time.sleep(0.1 if not drain else 0.4)


def _left(client: Client) -> int:
    try:
        return client.tasks("open", 1).total
    except (NoEngine, FormigaError):
        return 0  # it is ending
