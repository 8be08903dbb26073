"""`formiga down`: end a running engine, at once or when its tasks have ended."""

import time
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.client import Client, NoEngine, SiteOption, connect, show_next
from formiga_bt.errors import FormigaError
from formiga_bt.site_folder import is_running

END_S = 20.0


def command(
    drain: Annotated[
        bool, typer.Option("--drain", help="Admit no more tasks, and end when the last one has ended.")
    ] = False,
    site: SiteOption = None,
) -> None:
    """End the engine. Without --drain at once: agents go on with the goals they have; those of `up --sim` end too."""
    client = connect(site)
    reply = client.post(f"/v1/admin/{'drain' if drain else 'stop'}")
    typer.echo(reply["text"])
    _wait(client, drain)
    typer.echo(f"the engine of site '{client.address.site}' has ended")
    show_next("formiga up")


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
                f"the engine (process {client.address.pid}) has not ended within {END_S:g} s\n"
                f"  help: look at its terminal, or end its process: kill {client.address.pid}"
            )
        time.sleep(0.1 if not drain else 0.4)


def _left(client: Client) -> int:
    try:
        return int(client.get("/v1/tasks", status="open", limit=1)["total"])
    except (NoEngine, FormigaError):
        return 0  # it is ending
