"""`formiga up`: start the engine of a site as a service, and keep it until it is told to end."""

import os
import signal
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from msgspec.structs import replace

from formiga_bt.base.endpoints import reached_at
from formiga_bt.base.errors import FormigaError, SiteError, TreeError
from formiga_bt.base.site_folder import FOLDER, SiteFolder, check_free
from formiga_bt.base.visible import visible
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import CheckWorld, UnusableFile, is_demo, read_world, rendered
from formiga_bt.cli.operator.library import check_options, read_library, warn_of_waits

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from formiga_bt.lang.model import Site
    from formiga_bt.services.collector import Collector
    from formiga_bt.services.host import EngineHost
    from formiga_bt.services.simulated import Simulated
    from formiga_bt.services.supervised import Supervisor

TOLD = frozenset({"alarm", "question", "notice", "task", "order", "lockdown", "library"})
"""Events that are printed; of agents only take-overs and handbacks."""
SHOWN = 5
"""So many files that are not served are named."""


class Durability(StrEnum):
    """What of the journal survives a power cut."""

    full = "full"
    normal = "normal"


def command(
    site: Annotated[
        Path, typer.Option(help="Site file, or `demo` for the one that ships with formiga.", metavar="FILE")
    ] = Path("site.yaml"),
    tasks: Annotated[
        list[Path] | None,
        typer.Option(help="Task file or folder; may be repeated. Default: trees/ beside the site file.", metavar="DIR"),
    ] = None,
    actions: ActionsOption = None,
    speed: Annotated[
        float, typer.Option(help="Engine seconds per wall second, up to 20.", metavar="X", min=0.1, max=20.0)
    ] = 1.0,
    http: Annotated[str, typer.Option(help="Where the API is served; port 0 takes a free one.")] = "127.0.0.1:8420",
    listen: Annotated[
        str,
        typer.Option(
            help="Where agents connect; beyond this machine by TLS only. Default: what the site file says.",
            metavar="ENDPOINT",
        ),
    ] = "",
    keys: Annotated[
        Path | None,
        typer.Option(
            help="The site's folder of keys: the engine connects by TLS to `formiga router`. Default: what the site file says.",
            metavar="FOLDER",
        ),
    ] = None,
    desk: Annotated[
        list[str] | None,
        typer.Option(help="Somebody who answers by `formiga answer`; may be repeated.", metavar="PERSON[:TYPE]"),
    ] = None,
    sim: Annotated[
        bool, typer.Option("--sim", help="Start the site's agents too, simulated, each in a process of its own.")
    ] = False,
    token: Annotated[
        bool,
        typer.Option(
            "--token",
            help="Ask every caller for the site's token, also on this machine. In mode real that is always so.",
        ),
    ] = False,
    journal: Annotated[
        str,
        typer.Option(
            help="File or PostgreSQL URL of the journal. Default: the last one; at first journal.db in the runtime folder.",
            metavar="URL",
        ),
    ] = "",
    durability: Annotated[
        Durability,
        typer.Option(help="Whether the journal's newest steps survive a power cut (full), or may not (normal)."),
    ] = Durability.full,
    no_journal: Annotated[
        bool, typer.Option("--no-journal", help="Keep no history: a killed engine knows nothing of its tasks.")
    ] = False,
    start_anew: Annotated[
        bool,
        typer.Option(
            "--start-anew",
            help="Begin a new history: tasks, orders and lockdown of the last engine are forgotten; its journal is set aside.",
        ),
    ] = False,
    metrics: Annotated[
        bool, typer.Option("--metrics", help="Show the engine's figures (/metrics) beyond this machine, too.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not print what happens.")] = False,
) -> None:
    """Start the engine of a site as a service: it takes tasks over HTTP and from the other verbs.

    Ctrl-C aborts all tasks and ends when their machines have landed; a second one ends at once. `formiga down` and SIGTERM
    end at once: agents go on with the goals they have; simulated ones of --sim end too. The next `formiga up` goes on with the
    tasks from the journal, also after a crash. Exit code 0 if it ended on request.
    """
    world = site_world(actions or [], site)
    assert world.site is not None
    for gap in gaps(world.site, speed):
        typer.echo(f"warning: {gap}\n", err=True)
    beside = Path() if is_demo(site) else site.parent
    check_free(beside, world.site.name)
    if sim:
        _check_sim(beside, world.site)
    if no_journal and journal:
        raise UnusableFile("--no-journal and --journal URL: say one of them")
    texts: dict[str, dict[str, str]] = {}
    served, refused = read_library(tasks, beside, _with_fleet(world, beside), texts, check_options(site, actions or ()))
    warn_of_waits(served, world)
    for rule in world.site.rules.values():
        if rule.task not in served:
            typer.echo(f"warning: rule:{rule.name} requests {rule.task}, which is not served: {rule.mark}\n", err=True)
    people = _people(desk or [], world)
    from formiga_bt.engine.drivers.failpoints import named
    from formiga_bt.services.collector import Collector
    from formiga_bt.services.host import EngineHost
    from formiga_bt.services.kept.journaling import SITE_FILES, JournalAt
    from formiga_bt.services.supervised import Supervisor
    from formiga_bt.services.thread_switching import short_turns

    texts[SITE_FILES] = dict(world.sources)
    kept = None if no_journal else JournalAt(journal, durability.value)
    if journal:
        report_others(journal, world.site.name)

    host = EngineHost(
        world.site, world.catalogue, served,
        beside=beside, speed=speed, http=http, desk=people, listen=listen, keys=keys, refused=refused, needs_token=token,
        journal=kept, texts=texts, failpoint=named(os.environ, world.site.mode),
        start_anew=start_anew, metrics=metrics,
    )  # fmt: skip
    with host, _fleet(host, world, people, sim, keys) as agents, Collector() as collector, short_turns():
        _banner(host, people, sim)
        supervisor = Supervisor(os.environ)
        _serve(host, agents, collector, supervisor, quiet=quiet)
        supervisor.ends()
        left = host.open_tasks()
    host.check()
    if left:
        names = ", ".join(left[:5]) + (f" and {len(left) - 5} more" if len(left) > 5 else "")
        _say(f"the engine has ended; not ended: {names}; {host.fate}")
    else:
        _say("the engine has ended")


def site_world(actions: list[Path], site: Path) -> CheckWorld:
    """Return a site with its catalogue; warnings are told.

    Raises:
        UnusableFile: a file cannot be read.
        TreeError: the site or its catalogue has errors.
    """
    if not site.exists() and not is_demo(site):
        raise UnusableFile(
            f"there is no {site}", help="make a site with `formiga init`, or name its file: formiga up --site FILE"
        )
    world = read_world(actions, site)
    errors = [d for d in world.diagnostics if d.severity == "error"]
    if errors or world.site is None:
        typer.echo("\n\n".join(rendered(errors, world.sources)), err=True)
        raise TreeError("the site or its catalogue has errors; nothing was started")
    for text in rendered([d for d in world.diagnostics if d.severity != "error"], world.sources):
        typer.echo(f"warning: {text}\n", err=True)
    return world


def report_others(journal: str, site: str) -> None:
    """Say if a journal that is named has the history of other sites, and none of this one: it may be the wrong file."""
    from formiga_bt.journal.reading import others_in

    if others := others_in(journal, site):
        typer.echo(
            f"note: {journal} also keeps the journal of {', '.join(others)}; that of {site} begins in it", err=True
        )


def gaps(site: "Site", speed: float) -> list[str]:
    """Return what a site in mode real leaves open that people near machines should know, in sentences.

    Raises:
        UnusableFile: its clock would not be that of the real world.
    """
    if site.mode != "real":
        return []
    if speed != 1.0:
        raise UnusableFile(f"--speed is for simulations; {site.name} is in mode real, where a second is a second")
    found = []
    if site.fence is None:
        found.append(
            f"{site.name} is in mode real without a fence: nothing keeps machines in\n  help: fence: in site.yaml"
        )
    if site.heights is None and not site.relief_m:
        found.append(
            f"{site.name} is in mode real without terrain: its ground counts as flat, as high as the base\n"
            "  help: terrain: in site.yaml"
        )
    if not site.people.get("approvers"):
        found.append(
            f"{site.name} is in mode real and has no approvers: no task can be approved, so none will fly\n"
            "  help: people: {approvers: [...]} in site.yaml"
        )
    if not any(agent.home for agent in site.agents.values()):
        found.append(
            f"{site.name} is in mode real and lists no machine: none is admitted\n"
            "  help: list each under agents: in site.yaml, with its port"
        )
    return found


def _with_fleet(world: CheckWorld, beside: Path) -> CheckWorld:
    """Return what tasks are checked against: agents that people added, and actions that agents announced, count too."""
    from formiga_bt.lang.growing import growing
    from formiga_bt.services import discovered
    from formiga_bt.services.members import with_added

    assert world.site is not None
    runtime, catalogue = beside / FOLDER / world.site.name, growing(world.catalogue)
    try:
        discovered.restore(runtime, catalogue, world.site)
        return replace(world, site=with_added(world.site, runtime), catalogue=catalogue)
    except SiteError:  # the start sets a file aside that cannot be read, and says so
        return world


def _people(words: list[str], world: CheckWorld) -> dict[str, str]:
    assert world.site is not None
    found: dict[str, str] = {}
    for word in words:
        person, _, kind = word.partition(":")
        listed = world.site.agents.get(person)
        kind = kind or (listed.type if listed else "")
        known = world.catalogue.types.get(kind)
        if not person or known is None or not known.human:
            humans = ", ".join(name for name, t in world.catalogue.types.items() if t.human)
            raise UnusableFile(f"--desk {word}: say PERSON:TYPE, with one of the types {humans}")
        found[person] = kind
    return found


def _check_sim(beside: Path, site: "Site") -> None:
    if site.mode != "simulation":
        raise FormigaError(f"--sim is for sites in mode simulation; {site.name} is in mode {site.mode}")
    from formiga_bt.services.simulated import check_unsimulated

    check_unsimulated(SiteFolder(beside, site.name).path)


def _fleet(
    host: "EngineHost", world: CheckWorld, people: dict[str, str], sim: bool, keys: Path | None
) -> "AbstractContextManager[Simulated | None]":
    from contextlib import nullcontext

    if not sim:
        return nullcontext()
    from formiga_bt.services.listening import keys_of
    from formiga_bt.services.simulated import Simulated

    assert world.site is not None
    if not host.endpoint:
        raise UnusableFile(
            "--sim: simulated agents come by Zenoh, and the site file names other transports only; add zenoh: {}"
        )
    host.with_simulated = True
    return Simulated(
        world.site, world.catalogue, connect=reached_at(host.endpoint), folder=host.runtime_folder, without=people,
        keys=keys or keys_of(world.site),
    )  # fmt: skip


def _banner(host: "EngineHost", people: dict[str, str], sim: bool) -> None:
    served = host.served
    refused = [one for one in host.refused if not one.shipped]
    where = f"they connect at {host.endpoint}" if host.endpoint else "by the wires that the site names"
    rows = [
        f"site {host.site.name} ({host.site.mode}), start {host.epoch} of its engine, process {os.getpid()}",
        f"  tasks   {', '.join(served) or 'none'}",
        *(f"  refused {one.text}" for one in refused[:SHOWN]),
        *([f"  refused {len(refused) - SHOWN} more: formiga tasks --library"] if len(refused) > SHOWN else []),
        f"  agents  {'simulated ones, each a process of its own; ' if sim else ''}{where}",
        f"  people  {', '.join(people) + ' answer here: formiga inbox' if people else 'answer with their own apps'}",
        f"  API     {host.address.url}/v1   (OpenAPI: {host.address.url}/v1/openapi.json)",
        f"  journal {host.journaling.text}",
        *([f"  clock   {host.clock_text}"] if host.clock_text else []),
        *(f"  open    {text}" for text in _open(host)),
    ]
    rows += [f"  aside   {text}" for text in (*host.journaling.aside, *host.set_aside)]
    rows += [f"  resume  {text}" for text in host.resumed]
    rows += [f"  note    {text}" for text in host.restored]
    first = "Hello" if "Hello" in served else "TASK"
    rows.append(f"next, in another terminal in this folder: formiga run {first} --follow    or: formiga agents")
    _say("\n".join(rows))


def _open(host: "EngineHost") -> list[str]:
    """Return who may command this site without being asked for more, as far as its people must know, in sentences."""
    from formiga_bt.base.endpoints import is_local, is_tls
    from formiga_bt.base.person_secrets import command as command_for

    found = []
    if host.needs_token:
        file = host.runtime_folder / "token"
        found.append(f"each request must bring the site's token ({file}); the commands in this folder do")
    if silent := host.proofs.without():
        who, verb = ", ".join(silent), "have" if len(silent) > 1 else "has"
        found.append(f"{who} {verb} no secret yet, so cannot approve or go on duty: {command_for(silent[0])}")
    beyond = not is_local(host.endpoint)
    if is_tls(host.endpoint):
        found.append(f"agents prove by certificates who they are, to the router at {host.endpoint}: formiga router")
    elif host.endpoint and (beyond or host.site.mode == "real"):
        who = "other machines" if beyond else "processes of this machine"
        found.append(f"the wire is not checked: {who} that reach {host.endpoint} can be any agent, or command each")
    return found


def _serve(
    host: "EngineHost", agents: "Simulated | None", collector: "Collector", supervisor: "Supervisor", *, quiet: bool
) -> None:
    asked: list[int] = []

    def note(number: int, frame: Any) -> None:  # noqa: ARG001
        asked.append(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    handled, seen = 0, 0
    supervisor.ready()  # not before a signal ends it in order
    try:
        while not host.is_over():
            host.wait(0.2)
            if host.alive().alive:
                supervisor.works()
            seen = seen if quiet else _print_news(host, seen)
            for text in agents.look() if agents is not None else ():
                _say(text)
            for number in asked[handled:]:
                handled += 1
                if number != signal.SIGINT or handled > 1 or not host.open_tasks():
                    host.request_stop()
                else:
                    told = host.abort_all("Ctrl-C")
                    what = (
                        f"{told} {'task is' if told == 1 else 'tasks are'} aborted" if told else "all tasks end already"
                    )
                    now = "end now, the simulated agents too" if host.with_simulated else "end now"
                    _say(f"\n{what}; waiting until their machines have landed{host.kept}. Ctrl-C again: {now}")
            if collector.is_due and not host.open_tasks():
                collector.thaw()
        if not quiet:
            _print_news(host, seen)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _print_news(host: "EngineHost", seen: int) -> int:
    events, _ = host.feed.after(seen)
    for event in events:
        seen = event.n
        if event.type in TOLD or "taken" in event.data:  # taken over, or handed back
            _say(f"{_clock(event.at)}  {'ALARM ' if event.type == 'alarm' else ''}{event.text}")
    return seen


def _say(text: str) -> None:
    """Print a line; an engine does not end because nobody reads what it prints."""
    with suppress(OSError):
        print(visible(text), flush=True)


def _clock(at: int) -> str:
    from datetime import datetime

    return f"{datetime.fromtimestamp(at / 1e6).astimezone():%H:%M:%S}"
