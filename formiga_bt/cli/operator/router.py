"""`formiga router`: the process that agents and engine of a secured site connect to, by TLS with certificates of both ends."""

import os
import signal
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Final

import typer

from formiga_bt.base.authority import read_running
from formiga_bt.base.certificates import KeysError
from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.visible import visible
from formiga_bt.cli.inputs import site_of
from formiga_bt.cli.printing import show_next

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site
    from formiga_bt.transport.zenoh_rules import Member

RESTART_S: Final = 10.0
"""So long a router that is told to start anew is waited for."""


def command(
    site: Annotated[Path, typer.Option(help="Site file.", metavar="FILE")] = Path("site.yaml"),
    listen: Annotated[
        str, typer.Option(help="Where to listen: tls/HOST:PORT. Default: what the site file says.", metavar="ENDPOINT")
    ] = "",
    keys: Annotated[
        Path | None, typer.Option(help="The site's folder of keys. Default: what the site file says.", metavar="FOLDER")
    ] = None,
    restart: Annotated[
        bool,
        typer.Option("--restart", help="Let the router that runs take new rules: its links are cut for about 3 s."),
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --restart: do not ask, whatever moves.")] = False,
) -> None:
    """Run the router of a site with keys (formiga access ca): who has keys gets in, and writes its own only.

    Who has keys is read at its start, and when it is told: formiga router --restart, from another terminal. It says who
    comes and goes, and who is refused what. Ctrl-C ends it: machines in the air then act as without a link.
    """
    found = site_of(site, "formiga router --site FILE")
    from formiga_bt.services.listening import check_listen, keys_of, listen_of

    folder = keys.resolve() if keys is not None else keys_of(found)
    if folder is None:
        help_ = "make them: formiga access ca; then say keys: FOLDER beside listen, or --keys FOLDER"
        raise UnusableFile(f"{site} names no keys, without which nobody needs a router", help=help_)
    if restart:
        _restart(found, folder, site, yes=yes)
        return
    where = listen or listen_of(found)
    check_listen(found, where, "--listen" if listen else "", keys=True)
    there = read_running(folder)
    if there is not None:
        raise FormigaError(
            f"a router runs with these keys already: process {there.pid} at {there.endpoint}",
            help="new rules for it: formiga router --restart",
        )
    _run(found, folder, where)


def _run(site: "Site", folder: Path, listen: str) -> None:
    from formiga_bt.transport.zenoh_router import Refusals, Router, hear_refusals

    shown: list[IO[str]] = []
    lock = threading.Lock()

    def say(text: str) -> None:
        with lock, suppress(OSError):  # a router does not end because nobody reads what it prints
            print(visible(f"{time.strftime('%H:%M:%S')}  {text}"), file=shown[0], flush=True)

    router = Router(site.name, folder, listen, simulation=site.mode == "simulation", tell=say)
    shown.append(hear_refusals(Refusals(lambda number: router.names.get(number, ""), say)))
    asked: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda one, _: asked.append(one))
    router.open()
    try:
        say(f"router of {site.name}, process {os.getpid()}, at {listen}: {_those(router.members)}")
        done = 0
        while True:
            signal.sigtimedwait([], 0.2)
            for got in asked[done:]:
                done += 1
                if got != signal.SIGHUP:
                    return
                try:
                    router.restart()
                    say(f"started anew: {_those(router.members)}")
                except KeysError as error:
                    say(f"not started anew, it goes on as before: {error}")
    finally:
        router.close()
        say("the router has ended")


def _those(members: "Sequence[Member]") -> str:
    names = [one.name for one in members]
    return (
        f"it lets in the engine and {', '.join(names)}" if names else "it lets in the engine, and nobody else has keys"
    )


def _restart(site: "Site", folder: Path, file: Path, *, yes: bool) -> None:
    before = read_running(folder)
    if before is None:
        raise FormigaError("no router runs with these keys on this machine", help="formiga router")
    moving = [] if yes else _moving(site, file)
    if moving:
        typer.echo(f"in the air: {', '.join(moving)}. Their links, and the engine's, are cut for about 3 s")
        if not typer.confirm("start the router anew now?"):
            raise FormigaError("nothing was changed")
    told = (folder / "router.json").stat().st_ino
    os.kill(before.pid, signal.SIGHUP)
    until = time.monotonic() + RESTART_S
    while time.monotonic() < until:
        with suppress(OSError):
            if (folder / "router.json").stat().st_ino != told and (now := read_running(folder)) is not None:
                typer.echo(f"the router lets in the engine and {', '.join(now.names) or 'no agent'}")
                show_next("formiga access keys")
                return
        time.sleep(0.1)
    raise FormigaError(f"the router (process {before.pid}) did not start anew", help="look at what it says")


def _moving(site: "Site", file: Path) -> list[str]:
    """Return the machines that are in the air, or not known to be on the ground, as the site's engine says, if one runs."""
    from formiga_bt.base.site_folder import FOLDER, read_address
    from formiga_bt.client import Client

    there = read_address(file.parent.resolve() / FOLDER / site.name)
    if there is None:
        return []
    return [one.id for one in Client(there).agents().agents if one.landed == "airborne"]
