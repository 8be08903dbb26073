"""`formiga access`: the secrets of the people of a site, with which they approve and go on duty in mode real."""

import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.durable import private_folder
from formiga_bt.base.errors import FormigaError, SiteError, TreeError
from formiga_bt.base.person_secrets import (
    SECRETS,
    changing,
    hashed,
    read_secrets,
    set_unusable_aside,
    write_secret,
    wrong,
)
from formiga_bt.base.person_secrets import command as command_for
from formiga_bt.base.site_folder import FOLDER
from formiga_bt.cli.inputs import UnusableFile, is_demo, read_world, rendered
from formiga_bt.cli.options import JsonOption, print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.cli.proving import new_secret, own_secret

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site


class AccessCommand(StrEnum):
    """What is done."""

    SECRET = "secret"
    LIST = "list"


def command(
    what: Annotated[AccessCommand, typer.Argument(help="secret: set one; list: show who has one.")],
    person: Annotated[
        str, typer.Argument(help="One of the people or pilots whom the site file names.", metavar="[PERSON]")
    ] = "",
    reset: Annotated[
        bool, typer.Option("--reset", help="Do not ask for the present secret: who owns the site's files says so.")
    ] = False,
    site: Annotated[Path, typer.Option(help="Site file.", metavar="FILE")] = Path("site.yaml"),
    as_json: JsonOption = False,
) -> None:
    """Set the secret of a person's own, with which they approve and go on duty at a site in mode real; it counts at once.

    It is asked for twice, and the present one before, if there is one. Scripts put them into files of mode 0600 and name
    these in FORMIGA_NEW_SECRET_FILE and FORMIGA_SECRET_FILE (or into FORMIGA_NEW_SECRET and FORMIGA_SECRET). Kept is a hash, in
    secrets.json of the site's runtime folder. Example: formiga access secret ann
    """
    found = _site(site)
    from formiga_bt.services.http.proving import people_of

    people = people_of(found)
    folder = (Path() if is_demo(site) else site.parent).resolve() / FOLDER / found.name
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
    _set(folder, person, reset=reset)
    if found.mode != "real":
        typer.echo(f"{found.name} is in mode {found.mode}, where nobody is asked for it")
    show_next(
        *([f"formiga approve TASK --by {person}"] if "approvers" in people[person] else []), "formiga access list"
    )


def _site(file: Path) -> "Site":
    if not file.exists():
        raise UnusableFile(f"there is no {file}", help="name the site's file: formiga access ... --site FILE")
    world = read_world([], file)
    errors = [d for d in world.diagnostics if d.severity == "error"]
    if errors or world.site is None:
        typer.echo("\n\n".join(rendered(errors, world.sources)), err=True)
        raise TreeError("the site or its catalogue has errors")
    return world.site


def _set(folder: Path, person: str, *, reset: bool) -> None:
    try:
        private_folder(folder.parent)
        private_folder(folder)
    except OSError as error:
        raise SiteError(f"cannot write {folder}: {error.strerror or error}") from error
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
