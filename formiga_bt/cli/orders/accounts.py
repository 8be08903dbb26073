"""The verbs of `formiga access` about accounts: who the engine knows, what each may do, and their tokens."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import typer
from msgspec import to_builtins
from msgspec.structs import replace

from formiga_bt.base.accounts import (
    LOCAL,
    MOST_TOKENS,
    NAME,
    OPEN_TASKS,
    REQUESTS,
    Account,
    Register,
    new_token,
    read_register,
    write_register,
)
from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.private_files import changing
from formiga_bt.base.roles import Role
from formiga_bt.base.units import parse_quantity
from formiga_bt.base.visible import visible
from formiga_bt.cli.options import print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.services.http.audit import read_audit

DAY_S: Final = 86_400
LONGEST_S: Final = 366 * DAY_S
"""The longest that a token lasts."""
MOST_OF_ANY: Final = 1_000_000
SHOWN: Final = 50
"""Lines of the audit that are shown."""


@dataclass(frozen=True, slots=True)
class Said:
    """What the command line says of an account."""

    name: str
    words: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    agent: str = ""
    tasks: tuple[str, ...] = ()
    expires: str = "90d"


def add(folder: Path, said: Said) -> None:
    """Make an account."""
    if not NAME.fullmatch(said.name) or said.name == LOCAL:
        what = f"'{said.name}' is no name of an account: small letters, digits, '_', '-' and '.', a letter first"
        raise UnusableFile(f"{what}; '{LOCAL}' is taken")
    roles = _roles(said.roles)
    with changing(folder):
        register = read_register(folder)
        if said.name in register.accounts:
            raise FormigaError(f"there is an account {said.name}; nothing was changed", help=_role_of(said.name))
        made = Account(roles, said.agent, said.tasks)
        _write(folder, register, said.name, made)
    typer.echo(f"{said.name} may what {' and '.join(roles)} may")
    show_next(f"formiga access token {said.name}")


def role(folder: Path, said: Said) -> None:
    """Give an account other roles."""
    roles = _roles(said.words or said.roles)
    with changing(folder):
        register = read_register(folder)
        _write(folder, register, said.name, replace(_account(register, said.name), roles=roles))
    typer.echo(f"{said.name} may what {' and '.join(roles)} may, from now on")


def agent(folder: Path, said: Said) -> None:
    """Say which agent an account is, or that it is none."""
    which = said.words[0] if said.words else ""
    with changing(folder):
        register = read_register(folder)
        _write(folder, register, said.name, replace(_account(register, said.name), agent=which))
    typer.echo(f"{said.name} is {which or 'no agent'}, from now on")


def tasks(folder: Path, said: Said) -> None:
    """Say which tasks an account may request; without any, all."""
    with changing(folder):
        register = read_register(folder)
        _write(folder, register, said.name, replace(_account(register, said.name), tasks=said.words))
    typer.echo(f"{said.name} may request {', '.join(said.words) or 'every task'}, from now on, if its roles let it")


def limits(folder: Path, said: Said) -> None:
    """Say how many requests a minute, and how many tasks under way, an account may have; without numbers, as before."""
    with changing(folder):
        register = read_register(folder)
        requests, open_tasks = _numbers(said.words)
        made = replace(_account(register, said.name), requests=requests, open_tasks=open_tasks)
        _write(folder, register, said.name, made)
    typer.echo(f"{said.name}, from now on: {requests} requests a minute, tasks under way at once: {open_tasks}")


def _numbers(words: Sequence[str]) -> tuple[int, int]:
    if len(words) > 2 or not all(one.isdecimal() and 0 < int(one) <= MOST_OF_ANY for one in words):
        raise UnusableFile(
            f"say: formiga access limits NAME REQUESTS [TASKS], whole numbers from 1 to {MOST_OF_ANY:,}",
            help="for example: formiga access limits shop 60 5",
        )
    given = [int(one) for one in words]
    return (given[0] if given else REQUESTS), (given[1] if len(given) > 1 else OPEN_TASKS)


def disable(folder: Path, said: Said, *, disabled: bool = True) -> None:
    """Shut an account out, or let it in again; its tokens stay."""
    with changing(folder):
        register = read_register(folder)
        _write(folder, register, said.name, replace(_account(register, said.name), disabled=disabled))
    typer.echo(f"{said.name} is {'shut out' if disabled else 'let in'}, from now on")


def token(folder: Path, said: Said) -> None:
    """Make a token of an account; it is shown once."""
    lasts_s = _lasts_s(said.expires)
    now_s = int(time.time())
    with changing(folder):
        register = read_register(folder)
        _account(register, said.name)
        alive = tuple(one for one in register.tokens if one.expires > now_s)
        if sum(one.account == said.name for one in alive) >= MOST_TOKENS:
            what = f"{said.name} has {MOST_TOKENS} tokens; nothing was changed"
            raise FormigaError(
                what, help="take one back: formiga access revoke ID (formiga access accounts lists them)"
            )
        text, made = new_token(said.name, now_s, now_s + lasts_s)
        write_register(folder, replace(register, tokens=(*alive, made)))
    typer.echo(text)
    until = datetime.fromtimestamp(made.expires, UTC).date().isoformat()
    typer.echo(
        f"a token of {said.name} until {until}, shown only now; take it back: formiga access revoke {made.id}", err=True
    )


def revoke(folder: Path, said: Said) -> None:
    """Take a token back."""
    with changing(folder):
        register = read_register(folder)
        left = tuple(one for one in register.tokens if one.id != said.name)
        if len(left) == len(register.tokens):
            raise FormigaError(f"there is no token {said.name}", help="formiga access accounts lists them")
        write_register(folder, replace(register, tokens=left))
    typer.echo(f"token {said.name} counts no more")


def accounts(folder: Path, *, as_json: bool) -> None:
    """Show all accounts with their tokens."""
    register, now_s = read_register(folder), time.time()
    known = sorted(register.accounts.items())
    own = {name: [one for one in register.tokens if one.account == name and one.expires > now_s] for name, _ in known}
    if as_json:
        tokens = {name: [{"id": t.id, "expires": t.expires} for t in own[name]] for name, _ in known}
        print_json([{"name": name, **to_builtins(one), "tokens": tokens[name]} for name, one in known])
        return
    if not known:
        typer.echo("no accounts: who calls on the engine's own machine, or with the site's token, may do everything")
        show_next("formiga access add NAME --role operator")
        return
    rows: list[tuple[str, ...]] = [("ACCOUNT", "ROLES", "IS AGENT", "TASKS", "LET IN", "TOKENS")]
    for name, one in known:
        ids = ", ".join(f"{token.id} until {_day(token.expires)}" for token in own[name])
        tasks_ = ", ".join(one.tasks) or "all"
        rows.append((name, ", ".join(one.roles), one.agent, tasks_, "no" if one.disabled else "yes", ids))
    print_table(rows)


def audit(folder: Path, *, as_json: bool) -> None:
    """Show who asked for what, the newest last."""
    lines = [*read_audit(folder)]
    if as_json:
        print_json(lines)
        return
    # A path is what a stranger sent: it must not steer the terminal of whoever reads it.
    cells = [{name: visible(str(value)) for name, value in one.items()} for one in lines[-SHOWN:]]
    rows = [
        (one.get("at", ""), one.get("who") or "unknown", *(one.get(key, "") for key in ("from", "asked", "status")))
        for one in cells
    ]
    print_table([("AT", "WHO", "FROM", "ASKED", "STATUS"), *rows])


def _roles(words: Sequence[str]) -> tuple[Role, ...]:
    known = [one.value for one in Role]
    wrong = [one for one in words if one not in known]
    if wrong or not words:
        what = f"'{wrong[0]}' is no role" if wrong else "say which roles"
        raise UnusableFile(f"{what}: {', '.join(known)}")
    return tuple(dict.fromkeys(Role(one) for one in words))


def _account(register: Register, name: str) -> Account:
    if name not in register.accounts:
        known = ", ".join(sorted(register.accounts)) or "none"
        raise FormigaError(
            f"there is no account {name}; there are: {known}", help="formiga access add NAME --role ROLE"
        )
    return register.accounts[name]


def _write(folder: Path, register: Register, name: str, account: Account) -> None:
    write_register(folder, replace(register, accounts={**register.accounts, name: account}))


def _role_of(name: str) -> str:
    return f"other roles: formiga access role {name} ROLE ..."


def _lasts_s(text: str) -> int:
    found = parse_quantity(text)
    if found is None or found[0] != "duration" or not 60 <= found[1] <= LONGEST_S:
        raise UnusableFile(f"--expires: '{text}' is no time from 1 min to 366 d, for example 90d")
    return int(found[1])


def _day(instant: int) -> str:
    return datetime.fromtimestamp(instant, UTC).date().isoformat()
