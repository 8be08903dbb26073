"""The verbs of `formiga access` about keys: by which the engine, the router and the agents of a site prove who they are."""

import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import typer
from msgspec import Struct

from formiga_bt.base import authority
from formiga_bt.base.authority import Holder, day, read_holders, read_running
from formiga_bt.base.certificates import About, KeysError
from formiga_bt.base.durable import private_folder
from formiga_bt.base.endpoints import EVERYWHERE
from formiga_bt.base.errors import SiteError, UnusableFile
from formiga_bt.base.private_files import changing
from formiga_bt.cli.options import print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.services.listening import keys_of, listen_of

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site

PORT: Final = "7447"


class Place(Struct, frozen=True):
    """Where the keys of a site are, and what its agents are told."""

    keys: Path
    site: str
    listen: str
    is_named: bool
    """The site file names the folder."""

    def about(self, hosts: Sequence[str]) -> About:
        """Return what is told an agent: a name that the router is reached by, if it listens everywhere."""
        host, _, port = self.listen.partition("/")[2].rpartition(":")
        port = port if port.isdigit() and port != "0" else PORT
        if host in EVERYWHERE or not self.listen.startswith("tls/"):
            host = hosts[0] if hosts else "127.0.0.1"
        return About(self.site, f"tls/{host}:{port}")


def place(site: "Site", folder: Path) -> Place:
    """Return where the keys of a site are: where its file says, else in its runtime folder."""
    named = keys_of(site)
    return Place(named or folder / authority.FOLDER, site.name, listen_of(site), named is not None)


def ca(at: Place, hosts: Sequence[str]) -> None:
    """Make the authority, or new certificates of engine and router."""
    own = at.listen.partition("/")[2].rpartition(":")[0].strip("[]")
    listens = [own] if own and at.listen.startswith("tls/") and own not in ("0.0.0.0", "::") else []
    try:
        private_folder(at.keys)
    except OSError as error:
        raise SiteError(f"cannot write {at.keys}: {error.strerror or error}") from error
    with changing(at.keys):
        made = authority.make_authority(at.keys, at.site, (*hosts, *listens), time.time())
        known = read_holders(at.keys)
    until = day(time.time() + authority.HOUSE_S)
    typer.echo(f"{'made' if made == 'made' else 'there was already'} the authority of {at.site}: {at.keys}")
    typer.echo(
        f"made keys of its engine and its router, until {until}; agents reach it at {at.about(known.hosts).connect}"
    )
    if not at.is_named:
        typer.echo(
            f'say in site.yaml: transports: {{zenoh: {{listen: "tls/0.0.0.0:{PORT}", keys: {_shown(at.keys)}}}}}'
        )
    if made == "renewed":
        typer.echo("the engine and the router use them from their next start")
    show_next("formiga access agent NAME", "formiga router", "formiga up")


def agent(at: Place, names: Sequence[str], *, renew: bool, is_program: bool) -> None:
    """Make keys of agents or programs, or new certificates of theirs."""
    if not names:
        raise UnusableFile("say whose: formiga access agent NAME (an account's agent: formiga access is ACCOUNT AGENT)")
    with _changing(at):
        about = at.about(read_holders(at.keys).hosts)
        for name in names:
            where = _shown(at.keys / name)
            if renew:
                holder = authority.renew(at.keys, name, about, time.time())
                typer.echo(
                    f"{name} has a new certificate until {day(holder.until)}: hand it {where}/cert.pem, no secret"
                )
            else:
                holder = authority.issue(at.keys, name, about, time.time(), is_program=is_program)
                typer.echo(
                    f"{name} has keys until {day(holder.until)}: hand it the folder {where}, by a way others cannot read"
                )
    running = read_running(at.keys)
    if running is not None and any(one not in running.names for one in _names(at, names)):
        show_next("formiga router --restart")
    elif not renew and not is_program:
        show_next(f"python my_agent.py --keys {_shown(at.keys / names[0])}")


def revoke(at: Place, names: Sequence[str]) -> None:
    """Take the keys of agents back."""
    if not names:
        raise UnusableFile("say whose: formiga access revoke agent NAME")
    with _changing(at):
        for name in names:
            authority.revoke(at.keys, name, time.time())
            typer.echo(f"the keys of {name} count no more: the engine hears nothing of it from now on")
    typer.echo(
        "a router lets it in until it is started anew: links are cut for about 3 s then, also those of what flies"
    )
    show_next("formiga router --restart")


def show(at: Place, *, as_json: bool) -> None:
    """Show who has keys, and how they stand."""
    known, running, now_s = read_holders(at.keys), read_running(at.keys), time.time()
    rows = [(one, _state(one, now_s, running)) for one in known.holders]
    if as_json:
        found = [{"name": one.name, "kind": _kind(one), "until": one.until, "state": word} for one, word in rows]
        print_json({"keys": found, "hosts": list(known.hosts), "router": running.endpoint if running else ""})
        return
    if not (at.keys / authority.CA_KEY).exists() and not known.holders:
        typer.echo("no keys: agents are believed what they say they are")
        show_next("formiga access ca")
        return
    print_table(
        [("WHO", "IS", "UNTIL", "STATE"), *((one.name, _kind(one), day(one.until), word) for one, word in rows)]
    )
    typer.echo(
        f"router: process {running.pid} at {running.endpoint}" if running else "router: none runs on this machine"
    )


def _changing(at: Place) -> AbstractContextManager[None]:
    if not at.keys.is_dir():
        raise KeysError(f"there are no keys of {at.site}: no {_shown(at.keys)}", help="formiga access ca")
    return changing(at.keys)


def _kind(one: Holder) -> str:
    return "program" if one.is_program else "agent"


def _state(one: Holder, now_s: float, running: authority.Running | None) -> str:
    known = running is not None and one.common_name in running.names
    if one.revoked:
        return "revoked; the router lets it in until its next start" if known else "revoked"
    if now_s >= one.until:
        return "expired"
    return "counts" if running is None or known else "counts; the router knows it from its next start"


def _names(at: Place, names: Sequence[str]) -> list[str]:
    return [one.common_name for one in read_holders(at.keys).holders if one.name in names]


def _shown(path: Path) -> str:
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
