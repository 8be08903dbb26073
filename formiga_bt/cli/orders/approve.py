"""`formiga approve`: a person reads what a task may do on a real site, and says that it may fly.

No program approves: the person types the beginning of the digest at a terminal. With an engine of the site the word goes to it;
without one it is kept in the site's runtime folder, where the next engine finds it.
"""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from formiga_bt.base.errors import FormigaError, TreeError
from formiga_bt.base.packaged import folder
from formiga_bt.base.site_folder import FOLDER, SiteFolder, is_running
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import (
    CheckWorld,
    UnusableFile,
    find_tasks,
    is_demo,
    read_task,
    read_world,
    rendered,
    task_files,
)
from formiga_bt.cli.options import print_table
from formiga_bt.cli.printing import print_json, show_next
from formiga_bt.cli.proving import as_header, check_secret, own_secret
from formiga_bt.client import Client, connect
from formiga_bt.safety.approval import (
    RULES,
    TYPED,
    approval_digest,
    lands_away,
    others_than,
    rules_digest,
    same_person,
)
from formiga_bt.safety.drafted import Drafted
from formiga_bt.services.kept.drafted import known_below, texts_of, who_drafted
from formiga_bt.show.clean import cleaned
from formiga_bt.show.facts import OrderDone

if TYPE_CHECKING:
    from formiga_bt.lang.model import Site, Task

APPROVERS = "approvers"


def command(
    task: Annotated[
        str, typer.Argument(help="A task file, the name of a task, or rules: the standing rules.", metavar="[TASK]")
    ] = "",
    by: Annotated[str, typer.Option(help="Who approves: one of the site's `people: approvers`.", metavar="NAME")] = "",
    revoke: Annotated[bool, typer.Option("--revoke", help="Take the approval back.")] = False,
    listed: Annotated[bool, typer.Option("--list", help="List what is approved.")] = False,
    site: Annotated[Path, typer.Option(help="Site file.", metavar="FILE")] = Path("site.yaml"),
    actions: ActionsOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="With --list: print JSON instead of text.")] = False,
) -> None:
    """Approve a task for flights on a site in mode real: as it is now, with its imports, the catalogue and the site's fences.

    Shows what it may do, and asks to type the first 8 characters of the digest, and for the secret of NAME (formiga access
    secret NAME; scripts: FORMIGA_SECRET, or the file that FORMIGA_SECRET_FILE names). Any change of the task, of the types and
    actions that it uses, or of the site but for its agents and people, voids the approval. A task that lands away from its
    machine's home must be approved by another person than its requester; one that a language model wrote also by another than
    who had it written.
    """
    if not site.exists():
        raise UnusableFile(f"there is no {site}", help="name the site's file: formiga approve ... --site FILE")
    world = read_world(actions or [], site)
    errors = [d for d in world.diagnostics if d.severity == "error"]
    if errors or world.site is None:
        typer.echo("\n\n".join(rendered(errors, world.sources)), err=True)
        raise TreeError("the site or its catalogue has errors")
    runtime = (Path() if is_demo(site) else site.parent).resolve() / FOLDER / world.site.name
    if listed:
        _show_list(runtime, site, as_json=as_json)
        return
    if not task or not by:
        raise UnusableFile(
            f"say what and who: formiga approve TASK --by {_approvers(world.site)}    or: formiga approve --list"
        )
    if task == RULES:
        _approve_rules(runtime, site, world.site, by, revoke=revoke)
        return
    found = _task(task, site, world)
    digest = approval_digest(found, world.site)
    _check(world.site, by)
    if not revoke:
        wrote = who_drafted(found, known_below(runtime.parent.parent), texts_of(found))
        typer.echo("\n".join(summary(found, world, digest, wrote)))
        _check_another(world.site, found.name, wrote, by)
        _ask(found.name, digest)
    _say(runtime, site, world.site.name, found.name, digest, by, revoke=revoke)
    show_next("formiga approve --list", f"formiga run {found.name}")


def _say(runtime: Path, site: Path, name: str, what: str, digest: str, by: str, *, revoke: bool) -> None:
    """Give a person's word to the engine of the site, or keep it where the next one finds it."""
    body = {"task": what, "by": by, "digest": digest, "typed": digest[:TYPED], "revoke": revoke}
    secret = own_secret(by)
    with _keeper(runtime, site, name) as client:
        said = (
            client.post(OrderDone, "/v1/approvals", body, headers=as_header(secret)).text
            if client is not None
            else _keep(runtime, body, secret)
        )
    typer.echo(said)


def _approve_rules(runtime: Path, site: Path, of: "Site", by: str, *, revoke: bool) -> None:
    """Approve the standing rules of a site, all of them as they are."""
    if not of.rules:
        raise UnusableFile(f"{site} has no rules", help="rules: in the site file, or files in rules/ beside it")
    _check(of, by)
    digest = rules_digest(of)
    if not revoke:
        typer.echo("\n".join(summary_of_rules(of, digest)))
        _ask(RULES, digest)
    _say(runtime, site, of.name, RULES, digest, by, revoke=revoke)
    show_next("formiga approve --list", "formiga rules")


def summary_of_rules(site: "Site", digest: str) -> list[str]:
    """Return what a person should know before rules may request tasks, in lines."""
    files = dict.fromkeys((*(rule.mark.file for rule in site.rules.values()), site.file))
    lines = [f"the rules of {site.name}", "  made of", *(f"    {name}" for name in files), f"  digest  {digest}"]
    for rule in site.rules.values():
        after = f" for {rule.after_us / 1e6:g} s" if rule.after_us else ""
        of = ", ".join(rule.of) or "any"
        args = ", ".join(f"{name}: {expr.source}" for name, expr in rule.args.items())
        lines.append(f"  {rule.name}: on {rule.source}{after}, of {of}")
        lines.append(f"    requests {rule.task} ({args}), priority {rule.priority or 'its own'}, at most {rule.limit}")
    lines.append("  you are the requester of these tasks: one that lands away from home needs another approver")
    return lines


def _check(site: "Site", by: str) -> None:
    if site.mode != "real":
        raise FormigaError(f"{site.name} is in mode {site.mode}: its tasks need no approval")
    approvers = site.people.get(APPROVERS, ())
    if by not in approvers:
        known = ", ".join(approvers) or "nobody: name people in site.yaml under people: approvers"
        raise FormigaError(f"{by} is no approver of {site.name}; it has {known}")


def _check_another(site: "Site", task: str, wrote: Drafted | None, by: str) -> None:
    """Refuse the word of who had a model write a task; a running engine refuses it too."""
    if wrote is not None and any(same_person(by, one) for one in wrote.people):
        others = ", ".join(others_than(wrote.people, site.people.get(APPROVERS, ())))
        known = others or "nobody else is named in site.yaml under people: approvers"
        raise FormigaError(f"{task} {wrote.told}; another approver ({known}) must approve it")


def _approvers(site: "Site") -> str:
    return "|".join(site.people.get(APPROVERS, ())) or "NAME"


def _ask(name: str, digest: str) -> None:
    """Have a person type the digest.

    Raises:
        FormigaError: this is no terminal, or something else was typed.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise FormigaError("no program approves: a person reads this, and types the digest at a terminal")
    typed = typer.prompt(
        f"You say that {name} may fly so. Type the first {TYPED} characters of the digest",
        default="",
        show_default=False,
    )
    if typed.strip().lower() != digest[:TYPED]:
        raise FormigaError("that is not the digest; nothing was approved")


@contextmanager
def _keeper(runtime: Path, site: Path, name: str) -> Iterator[Client | None]:
    """Hold the site against an engine that starts just now, or return a client of the one that runs."""
    if is_running(runtime):
        yield connect(site)
        return
    with SiteFolder(runtime.parent.parent, name):
        yield None


def _keep(runtime: Path, body: dict[str, Any], secret: str) -> str:
    from formiga_bt.services.crew import keep, standing

    check_secret(runtime, body["by"], secret)
    revoke, digest = body["revoke"], body["digest"]
    what = f"{body['task']} ({digest[:TYPED]})"
    if revoke and not any(one.digest == digest for one in standing(runtime)):
        raise FormigaError(f"{what} is not approved")
    keep(runtime, digest=digest, task=body["task"], by=body["by"], at=time.time_ns() // 1000, revoke=revoke)
    return f"the approval of {what} is taken back" if revoke else f"{what} is approved by {body['by']}"


# -- which task, and what it may do ------------------------------------------------------------------------------------
def _task(word: str, site: Path, world: CheckWorld) -> "Task":
    """Return the task of a file, or of this name among those that `formiga up` serves: the site's own, then the shipped."""
    path = Path(word)
    if path.suffix in (".yaml", ".yml") or path.is_file():
        read = read_task(path, world)
        errors = [d for d in read.diagnostics if d.severity == "error"]
        if read.task is None or errors:
            typer.echo("\n\n".join(rendered(errors, read.sources)), err=True)
            raise TreeError(f"{path} has errors, or is no task")
        return read.task
    own = site.parent / "trees"
    mine = find_tasks([own] if own.is_dir() else [], may_be_empty=True).tasks
    names = []
    for file in (*mine, *(f for f in task_files([folder("trees")]) if f not in mine)):
        read = read_task(file, world)
        if read.task is not None and not any(d.severity == "error" for d in read.diagnostics):
            if read.task.name == word:
                return read.task
            names.append(read.task.name)
    raise UnusableFile(f"there is no task '{word}'", help=f"one of {', '.join(sorted(set(names)))}, or a file")


def summary(task: "Task", world: CheckWorld, digest: str, wrote: Drafted | None = None) -> list[str]:
    """Return what a person should know before a task flies, in lines."""
    site = world.site
    assert site is not None
    away = lands_away(task, world.catalogue)
    lines = [f"{task.name}: {cleaned(task.description)}".rstrip(": "), "  made of"]
    lines += [f"    {name}" for name in (*task.files, *_catalogue_files(world), site.file)]
    if wrote is not None:
        lines.append(f"  origin  it {wrote.told}: who asked for it, or requests it, may not approve it")
    lines.append(f"  digest  {digest}")
    home = "only at its machines' own homes"
    lines.append(f"  lands   {'AWAY from home, so that its requester may not approve it:' if away else home}")
    lines += [f"    {text}" for text in away]
    corners = len(site.fence.corners) if site.fence is not None else 0
    lines.append(
        f"  fence   {f'{corners} corners{_extent(site)}' if corners else 'NONE'}; no-fly zones: {len(site.no_fly)}"
    )
    for name, limits in _limits(task, world).items():
        lines.append(f"  limits  {name}: {limits}")
    return lines


def _catalogue_files(world: CheckWorld) -> list[str]:
    assert world.site is not None
    kinds, actions = world.catalogue.types.values(), world.catalogue.actions.values()
    return sorted({kind.mark.file for kind in kinds} | {action.mark.file for action in actions})


def _extent(site: "Site") -> str:
    corners = site.fence.corners
    east = [c.east_m for c in corners]
    north = [c.north_m for c in corners]
    return f", {min(east):.0f} to {max(east):.0f} m east, {min(north):.0f} to {max(north):.0f} m north"


def _limits(task: "Task", world: CheckWorld) -> dict[str, str]:
    """Return the limits of each type of machine that a task may be granted: the strictest of type, site and task."""
    from formiga_bt.lang.walk import all_roles
    from formiga_bt.safety.rules import rules_of

    assert world.site is not None
    wanted = {t for role in all_roles(task) for t in role.types}
    found = {}
    for kind in world.catalogue.types.values():
        if not kind.human and (kind.name in wanted or wanted & set(kind.extends)):
            rules = rules_of(kind, world.site, task.envelope)
            found[kind.name] = (
                f"reserve {rules.reserve_pct:g} %, at most {rules.max_height_m:g} m high, wind up to"
                f" {rules.wind_max_m_s:g} m/s, {rules.terrain_clearance_m:g} m over the ground,"
                f" {rules.people_clearance_m:g} m from people{', by daylight only' if rules.daylight_only else ''}"
            )
    return found


# -- the list ----------------------------------------------------------------------------------------------------------
def _show_list(runtime: Path, site: Path, *, as_json: bool) -> None:
    from formiga_bt.services.crew import standing, utc

    given = standing(runtime)
    if as_json:
        print_json(given)
        return
    if not given:
        typer.echo(f"nothing is approved on the site of {site}")
        show_next("formiga approve TASK --by NAME")
        return
    print_table([("TASK", "DIGEST", "BY", "AT"), *((g.task, g.digest[:TYPED], g.by, utc(g.at)) for g in given)])
