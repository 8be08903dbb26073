"""`formiga access`: who may do what at a site: accounts with roles and tokens, and the secrets of its people.

Secrets are for what a person says in mode real, approvals and duty; tokens let accounts in at all.
"""

import os
import pwd
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, assert_never

import typer
from msgspec import to_builtins

from formiga_bt.base.accounts import LOCAL
from formiga_bt.base.durable import private_folder
from formiga_bt.base.errors import FormigaError, SiteError
from formiga_bt.base.person_secrets import (
    SECRETS,
    hashed,
    read_secrets,
    set_unusable_aside,
    write_secret,
    wrong,
)
from formiga_bt.base.person_secrets import command as command_for
from formiga_bt.base.private_files import changing
from formiga_bt.base.site_folder import FOLDER
from formiga_bt.cli.inputs import UnusableFile, is_demo, site_of
from formiga_bt.cli.options import JsonOption, print_table
from formiga_bt.cli.orders import accounts
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.cli.proving import new_secret, own_secret
from formiga_bt.services.http.audit import Audit

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site


class AccessCommand(StrEnum):
    """What is done."""

    SECRET = "secret"
    LIST = "list"
    ADD = "add"
    ROLE = "role"
    IS = "is"
    TASKS = "tasks"
    LIMITS = "limits"
    DISABLE = "disable"
    ENABLE = "enable"
    TOKEN = "token"
    REVOKE = "revoke"
    ACCOUNTS = "accounts"
    AUDIT = "audit"
    WHO = "who"
    CA = "ca"
    AGENT = "agent"
    PROGRAM = "program"
    KEYS = "keys"


_OF_SECRETS = (AccessCommand.SECRET, AccessCommand.LIST)
_OF_WORDS = (
    AccessCommand.ROLE, AccessCommand.IS, AccessCommand.TASKS, AccessCommand.AGENT, AccessCommand.PROGRAM,
    AccessCommand.REVOKE, AccessCommand.LIMITS,
)  # fmt: skip
_OF_KEYS = (AccessCommand.CA, AccessCommand.AGENT, AccessCommand.PROGRAM, AccessCommand.KEYS)
_OF_ALL = (AccessCommand.ACCOUNTS, AccessCommand.AUDIT, AccessCommand.WHO)
_SHOWS = (*_OF_ALL, AccessCommand.LIST, AccessCommand.KEYS)
"""They change nothing, and the audit has no line of them."""


def command(
    what: Annotated[AccessCommand, typer.Argument(help="What is done; see below.")],
    person: Annotated[
        str,
        typer.Argument(
            help="An account; of secret one of the people or pilots whom the site file names; of agent an agent;"
            " of revoke a token's id, or the word agent.",
            metavar="[NAME]",
        ),
    ] = "",
    words: Annotated[
        list[str] | None,
        typer.Argument(
            help="Of role: its roles. Of is: its agent. Of tasks: its tasks. Of limits: REQUESTS [TASKS]. "
            "Of agent, revoke agent: agents."
        ),
    ] = None,
    role: Annotated[list[str] | None, typer.Option(help="Of add: a role; may be repeated.", metavar="ROLE")] = None,
    agent: Annotated[str, typer.Option(help="Of add: the agent that this person is.", metavar="AGENT")] = "",
    task: Annotated[
        list[str] | None, typer.Option(help="Of add: a task that it may request; may be repeated.", metavar="TASK")
    ] = None,
    host: Annotated[
        list[str] | None,
        typer.Option(
            help="Of ca: where agents reach the router, such as engine.example; may be repeated.", metavar="HOST"
        ),
    ] = None,
    renew: Annotated[
        bool, typer.Option("--renew", help="Of agent: a new certificate for the keys that it has.")
    ] = False,
    expires: Annotated[str, typer.Option(help="Of token: how long it lasts.", metavar="TIME")] = "90d",
    reset: Annotated[
        bool, typer.Option("--reset", help="Do not ask for the present secret: who owns the site's files says so.")
    ] = False,
    site: Annotated[Path, typer.Option(help="Site file.", metavar="FILE")] = Path("site.yaml"),
    as_json: JsonOption = False,
) -> None:
    """Say who may do what at a site; it counts at once, also while its engine runs.

    Accounts: add NAME --role ROLE makes one, role, is, tasks and limits change it, disable shuts it out, enable lets it in,
    token NAME makes a token, which is shown once, revoke ID takes it back, accounts lists all, audit shows who asked for what,
    who tells whom the engine takes you for. Example: formiga access add ann --role operator

    Keys of agents (docs/access.md): ca makes the site's authority, and keys of its engine and router; agent NAME makes keys to
    be handed to an agent, program NAME of a program that calls services as the account of that name, --renew a new certificate
    for them, revoke agent NAME takes them back, keys lists all.

    Secrets: secret PERSON sets the secret with which a person approves and goes on duty in mode real, list shows who has one.
    It is asked for twice, and the present one before, if there is one. Scripts put them into files of mode 0600 and name
    these in FORMIGA_NEW_SECRET_FILE and FORMIGA_SECRET_FILE (or into FORMIGA_NEW_SECRET and FORMIGA_SECRET). Kept are hashes.
    """
    if words and what not in _OF_WORDS:
        raise UnusableFile("too many words; a secret is never an argument: others on this machine can read those")
    if what is AccessCommand.WHO:
        _who(as_json=as_json)
        return
    found = site_of(site, "formiga access ... --site FILE")
    from formiga_bt.services.http.proving import people_of

    people = people_of(found)
    folder = (Path() if is_demo(site) else site.parent).resolve() / FOLDER / found.name
    asked = (what.value, person, *(words or ()), *(role or ()), *([agent] if agent else ()), *(task or ()))
    if what in _OF_KEYS or (what is AccessCommand.REVOKE and person == "agent"):
        with _noted(folder, what, asked):
            _keys(what, found, folder, [person, *(words or ())], host or [], renew=renew, as_json=as_json)
        return
    if what not in _OF_SECRETS:
        if what is AccessCommand.REVOKE and words:
            raise UnusableFile("say: formiga access revoke ID, or formiga access revoke agent NAME")
        if not person and what not in _OF_ALL:
            raise UnusableFile(
                f"say whose: formiga access {what.value} {'ID' if what is AccessCommand.REVOKE else 'NAME'}"
            )
        said = accounts.Said(person, tuple(words or ()), tuple(role or ()), agent, tuple(task or ()), expires)
        with _noted(folder, what, asked):
            _carry_out(what, _owned(folder), said, as_json=as_json)
        return
    if what is AccessCommand.LIST:
        if person or reset:
            raise UnusableFile("say: formiga access list, or formiga access secret PERSON")
        _list(folder, people, as_json=as_json)
        return
    if not person:
        raise UnusableFile(f"say whose: {command_for('|'.join(people) or 'PERSON')}")
    if person not in people:
        known = ", ".join(people) or "nobody: name people in site.yaml under people and pilots"
        raise FormigaError(f"the site file of {found.name} does not name {person}; it names {known}")
    with _noted(folder, what, asked):
        _set(folder, person, reset=reset)
    if found.mode != "real":
        typer.echo(f"{found.name} is in mode {found.mode}, where nobody is asked for it")
    show_next(
        *([f"formiga approve TASK --by {person}"] if "approvers" in people[person] else []), "formiga access list"
    )


@contextmanager
def _noted(folder: Path, what: AccessCommand, asked: Sequence[str]) -> Iterator[None]:
    """Write into the audit what is changed, or that it was refused; of that only the verb: its words may be a secret's."""
    done = False
    try:
        yield
        done = True
    finally:
        if what not in _SHOWS and folder.is_dir():
            words = " ".join(one for one in asked if one) if done else what.value
            audit = Audit(folder)
            audit.note(LOCAL, _user(), "formiga access", words, 200 if done else 403)
            audit.close()


def _user() -> str:
    """Return the system's name of whoever runs this."""
    try:
        return f"user {pwd.getpwuid(os.geteuid()).pw_name}"
    except KeyError:
        return f"user {os.geteuid()}"


def _owned(folder: Path) -> Path:
    """Return the site's runtime folder, made if it is not there; it is its owner's alone."""
    try:
        private_folder(folder.parent)
        private_folder(folder)
    except OSError as error:
        raise SiteError(f"cannot write {folder}: {error.strerror or error}") from error
    return folder


def _carry_out(what: AccessCommand, folder: Path, said: accounts.Said, *, as_json: bool) -> None:
    match what:
        case AccessCommand.ADD:
            accounts.add(folder, said)
        case AccessCommand.ROLE:
            accounts.role(folder, said)
        case AccessCommand.IS:
            accounts.agent(folder, said)
        case AccessCommand.TASKS:
            accounts.tasks(folder, said)
        case AccessCommand.LIMITS:
            accounts.limits(folder, said)
        case AccessCommand.DISABLE | AccessCommand.ENABLE:
            accounts.disable(folder, said, disabled=what is AccessCommand.DISABLE)
        case AccessCommand.TOKEN:
            accounts.token(folder, said)
        case AccessCommand.REVOKE:
            accounts.revoke(folder, said)
        case AccessCommand.ACCOUNTS:
            accounts.accounts(folder, as_json=as_json)
        case AccessCommand.AUDIT:
            accounts.audit(folder, as_json=as_json)
        case (
            AccessCommand.SECRET | AccessCommand.LIST | AccessCommand.WHO
            | AccessCommand.CA | AccessCommand.AGENT | AccessCommand.PROGRAM | AccessCommand.KEYS
        ):  # fmt: skip
            raise AssertionError("these are carried out before")
        case _:
            assert_never(what)


def _keys(
    what: AccessCommand, site: "Site", folder: Path, names: list[str], hosts: list[str], *, renew: bool, as_json: bool
) -> None:
    from formiga_bt.cli.orders import keys  # loads the library of certificates

    at = keys.place(site, _owned(folder) if what is AccessCommand.CA else folder)
    agents = [one for one in names if one]
    if what is AccessCommand.CA:
        if agents:
            raise UnusableFile("say: formiga access ca, with --host HOST where agents reach the router")
        keys.ca(at, hosts)
    elif what is AccessCommand.KEYS:
        keys.show(at, as_json=as_json)
    elif what in (AccessCommand.AGENT, AccessCommand.PROGRAM):
        keys.agent(at, agents, renew=renew, is_program=what is AccessCommand.PROGRAM)
    else:
        keys.revoke(at, agents[1:])


def _who(*, as_json: bool) -> None:
    from formiga_bt.client.finding import connect
    from formiga_bt.show.facts import SpeakerFact

    who = connect().get(SpeakerFact, "/v1/whoami")
    if as_json:
        print_json(to_builtins(who))
        return
    typer.echo(f"{who.name}: {', '.join(who.roles)}" + (f"; agent {who.agent}" if who.agent else ""))
    for one in who.may:
        typer.echo(f"  {one}")


def _set(folder: Path, person: str, *, reset: bool) -> None:
    _owned(folder)
    if reset:
        if os.geteuid() not in (folder.stat().st_uid, 0):
            raise FormigaError(f"--reset is for the owner of {folder}; without it the present secret is asked for")
        if (aside := set_unusable_aside(folder)) is not None:
            typer.echo(f"{SECRETS} could not be used; it was set aside in {aside}: all others set a new secret, too")
    present = read_secrets(folder).get(person)
    if present is not None and not reset and not present.fits(own_secret(person, "Present secret of")):
        help_ = f"forgotten? The owner of the files: {command_for(person)} --reset"
        raise FormigaError(f"{wrong(person)}", help=f"{help_}")
    new = hashed(new_secret(person))
    with changing(folder):
        if read_secrets(folder).get(person) != present and not reset:
            raise FormigaError(f"the secret of {person} was set by somebody else meanwhile; nothing was changed")
        write_secret(folder, person, new)
    typer.echo(f"the secret of {person} is {'set' if present is None else 'changed'}; it counts from now on")


def _list(folder: Path, people: dict[str, list[str]], *, as_json: bool) -> None:
    known = read_secrets(folder)
    if as_json:
        print_json([{"person": one, "roles": roles, "secret": one in known} for one, roles in people.items()])
        return
    rows = [(one, ", ".join(roles), "set" if one in known else "none") for one, roles in people.items()]
    print_table([("PERSON", "IS AMONG", "SECRET"), *rows])
    lacks = [one for one in people if one not in known]
    if lacks:
        show_next(command_for(lacks[0]))
