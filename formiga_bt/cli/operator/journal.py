"""`formiga journal`: what is in a journal, tables of it, and removing what is old."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.site_folder import JOURNAL, is_running
from formiga_bt.cli.options import JsonOption, lasted, print_table
from formiga_bt.cli.past import machine_at, moment_of, place_of, zone
from formiga_bt.cli.printing import print_json

if TYPE_CHECKING:
    from formiga_bt.cli.past import JournalAddress
    from formiga_bt.journal.figures import Leaving
    from formiga_bt.journal.keep import Retention
    from formiga_bt.journal.store import Journal
    from formiga_bt.show.replay.machine import TimeMachine


class JournalCommand(StrEnum):
    """What is done with it."""

    STATS = "stats"
    COMPACT = "compact"
    EXPORT = "export"


class ExportTable(StrEnum):
    """Tables of `export`."""

    STEPS = "steps"
    TASKS = "tasks"
    GOALS = "goals"
    TRACKS = "tracks"
    QUESTIONS = "questions"


def command(
    what: Annotated[JournalCommand, typer.Argument(help="stats, compact or export.")],
    journal: Annotated[
        str,
        typer.Option("--journal", help="The journal: file or URL. Default: that of this folder.", metavar="FILE|URL"),
    ] = "",
    history: Annotated[
        float, typer.Option("--history", help="Days that steps are kept (stats, compact).", min=0.0, metavar="DAYS")
    ] = 30.0,
    tracks: Annotated[
        float, typer.Option("--tracks", help="Days that way points are kept.", min=0.0, metavar="DAYS")
    ] = 7.0,
    tables: Annotated[
        list[ExportTable] | None, typer.Option("--what", help="Only this table (export); may be repeated.")
    ] = None,
    form: Annotated[Literal["csv", "parquet"], typer.Option("--format", help="Of the tables.")] = "csv",
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Folder for the tables.", metavar="FOLDER"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files in FOLDER of --out.")] = False,
    since: Annotated[str, typer.Option(help="Rows from then on, for example '-8 h'.", metavar="TIME")] = "",
    until: Annotated[str, typer.Option(help="Rows until then.", metavar="TIME")] = "",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before something is removed (compact).")] = False,
    site: Annotated[
        Path | None,
        typer.Option(help="Site file. Default: the site of this folder, or of one above it.", metavar="FILE"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show what is in a journal, write tables of it, or remove what is older than is kept.

    stats and export work while an engine runs; compact does not: a running engine does that by itself, each hour. compact says
    what would be gone, and asks.
    Example: formiga journal export --what tasks --what goals --since "-7 d" -o week
    """
    from formiga_bt.journal.keep import Retention

    before = (
        _bytes(journal) if journal and what is JournalCommand.COMPACT else None
    )  # whoever opens it empties its log into the file
    place = place_of(site, journal)
    rule = Retention(history_days=history, telemetry_days=tracks)
    if what is JournalCommand.COMPACT:
        _compact(place, rule, before or _bytes(place.where), yes=yes, as_json=as_json)
        return
    with machine_at(place) as machine:
        if what is JournalCommand.STATS:
            _stats(machine, rule, as_json=as_json)
        else:
            _export(machine, out, form, [str(one) for one in tables or ()], since, until, force=force)


# -- stats -------------------------------------------------------------------------------------------------------------
def _stats(machine: "TimeMachine", rule: "Retention", *, as_json: bool) -> None:
    from formiga_bt.journal.figures import kinds, leaving
    from formiga_bt.journal.keep import DAY_US, stats
    from formiga_bt.show.replay.when import in_words

    found, parts = stats(machine.journal), kinds(machine.journal)
    first, last = machine.first, machine.last
    days = (last - first) / DAY_US
    whole = found.bytes_file if found.bytes_file is not None else sum(one.bytes for one in parts)
    a_day = round(whole / days) if days > 0.01 else None
    gone = leaving(machine.journal, last, rule)
    if as_json:
        print_json({
            "site": found.site, "journal": found.where, "unix_millis_first": first // 1000,
            "unix_millis_last": last // 1000, "bytes": whole, "bytes_a_day": a_day,
            "kinds": [{"kind": one.name, "count": one.count, "bytes": one.bytes} for one in parts],
            "starts": found.starts, "bundles": found.bundles, "gaps": found.gaps,
            "retention": {"history_days": rule.history_days, "tracks_days": rule.telemetry_days, "steps": gone.steps,
                          "snapshots": gone.snapshots, "points": gone.points},
        })  # fmt: skip
        return
    typer.echo(f"{found.where}, site {found.site}")
    typer.echo(f"from {in_words(first, zone())} to {in_words(last, zone())}, {_days(days)}")
    typer.echo(f"{size(whole)}" + (f", {size(a_day)} a day" if a_day is not None else ""))
    rest = f"{_many(found.starts, 'start')} of an engine, {_many(found.bundles, 'version')} of files"
    typer.echo(rest + (f", {_many(found.gaps, 'gap')} that could not be written" if found.gaps else ""))
    rows: list[tuple[str, ...]] = [("KIND", "COUNT", "BYTES", "EACH")]
    rows += [(one.name, f"{one.count}", size(one.bytes), size(one.bytes / one.count)) for one in parts]
    print_table(rows)
    typer.echo(f"{_kept(rule)}: {removed_words(gone.steps, gone.snapshots, gone.points)} would be removed now")


def _kept(rule: "Retention") -> str:
    return f"steps are kept for {rule.history_days:g} days, way points for {rule.telemetry_days:g}"


def _days(days: float) -> str:
    return lasted(days * 86_400)


def size(count: float) -> str:
    """Return bytes in words."""
    for unit, most in (("B", 1e3), ("kB", 1e6), ("MB", 1e9)):
        if count < most:
            return f"{count / most * 1e3:.3g} {unit}"
    return f"{count / 1e9:.3g} GB"


def removed_words(steps: int, snapshots: int, points: int) -> str:
    """Return how much is removed."""
    parts = [(steps, "step"), (snapshots, "snapshot"), (points, "way point")]
    return ", ".join(_many(count, name) for count, name in parts if count) or "nothing"


def _many(count: int, name: str) -> str:
    return f"{count} {name}{'' if count == 1 else 's'}"


# -- compact -----------------------------------------------------------------------------------------------------------
def _bytes(where: str) -> int | None:
    from formiga_bt.journal.keep import file_bytes

    return file_bytes(where)


def _compact(place: "JournalAddress", rule: "Retention", before: int | None, *, yes: bool, as_json: bool) -> None:
    from formiga_bt.journal.figures import leaving
    from formiga_bt.journal.keep import Removed, compact
    from formiga_bt.journal.past import Past

    with _alone(place) as journal:
        now = journal.last()[1]
        gone = leaving(journal, now, rule)
        lines: list[str] = []
        if not (gone.is_nothing or yes):
            open_ = {task.id for task in Past(journal).state().tasks.values() if not task.ended}
            lines = _losses(gone, len(open_), len(gone.tasks & open_))
    done, after = Removed(), before
    if not gone.is_nothing:
        if not yes:
            _confirm(place.where, lines)
        with _alone(place) as journal:  # it is not kept from engines while a person thinks
            done = compact(journal, now, rule)
        after = _bytes(place.where)  # closed: nothing waits in its log any more
    if as_json:
        found: dict[str, Any] = {"steps": done.steps, "snapshots": done.snapshots, "points": done.points}
        print_json({**found, "bytes_before": before, "bytes_after": after})
        return
    if gone.is_nothing:
        left = f"; {size(before)}" if before is not None else ""
        typer.echo(f"nothing to remove: {_kept(rule)}{left}")
        return
    sizes = f"; {size(before)} before, {size(after)} now" if before is not None and after is not None else ""
    typer.echo(f"removed: {removed_words(done.steps, done.snapshots, done.points)}{sizes}")


def _losses(gone: "Leaving", open_: int, shorter: int) -> list[str]:
    """Return what a compaction removes and what it leaves, in lines."""
    from formiga_bt.show.replay.when import in_words

    lines = [f"{removed_words(gone.steps, gone.snapshots, gone.points)}: about {size(gone.bytes)}"]
    if gone.first is not None and gone.until is not None:
        span = f"from {in_words(gone.first, zone())} to {in_words(gone.until, zone())}"
        lines += [
            f"all moments {span}",
            f"what {_many(len(gone.tasks), 'task')} did then: no verb shows or explains it any more",
        ]
    stays = "what an engine needs to go on stays"
    if open_:
        stays += f", with {_many(open_, 'open task')}" + (
            f", of which {shorter} would lose {'its' if shorter == 1 else 'their'} beginning" if shorter else ""
        )
    return [*lines, stays]


def _confirm(where: str, lines: list[str]) -> None:
    """Have a person confirm what is lost.

    Raises:
        UnusableFile: this is no terminal.
    """
    text = "\n".join(f"  {line}" for line in lines)
    if not sys.stdin.isatty():
        raise UnusableFile(f"to compact {where} removes for ever\n{text}", help="confirm it: --yes")
    typer.echo(f"To compact {where} removes for ever\n{text}", err=True)
    typer.confirm("Remove it?", abort=True, err=True)


@contextmanager
def _alone(place: "JournalAddress") -> Iterator["Journal"]:
    """Open a journal that no engine writes; none gets it until it is closed.

    Raises:
        FormigaError: an engine writes it.
        JournalError: there is none, or it cannot be written.
    """
    from formiga_bt.journal.store import Journal

    Journal(place.where, place.site, read_only=True).close()  # it is there, and nothing is made where there is none
    file = Path(place.where)
    is_busy = file.name == JOURNAL and is_running(file.parent)
    busy = FormigaError(
        f"an engine writes {place.where} now; it removes by itself what is old, each hour",
        help="to remove more, end it first: formiga down",
    )
    if is_busy:
        raise busy
    with Journal(place.where, place.site) as journal:
        if not journal.hold():
            raise busy
        yield journal


# -- export ------------------------------------------------------------------------------------------------------------
def _export(
    machine: "TimeMachine",
    out: Path | None,
    form: Literal["csv", "parquet"],
    tables: list[str],
    since: str,
    until: str,
    *,
    force: bool,
) -> None:
    from formiga_bt.journal.export import export, paths

    if out is None:
        raise UnusableFile("where to? Name a folder: formiga journal export -o FOLDER")
    there = [one for one in paths(out, form, tables) if one.exists()]
    if there and not force:
        more = f", and {len(there) - 1} more of its tables" if len(there) > 1 else ""
        raise UnusableFile(f"{there[0]} is there already{more}; --force replaces what is there")
    first = moment_of(machine, since, or_first=True) if since else 0
    last = moment_of(machine, until) if until else None
    for file in export(machine.journal, out, form=form, since=first, until=last, what=tables):
        typer.echo(f"written: {file}", err=True)
