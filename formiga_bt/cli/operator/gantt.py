"""`formiga gantt`: the actions of agents over time, in the terminal or as a picture."""

from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.base.errors import UnusableFile
from formiga_bt.cli.past import AtOption, JournalOption
from formiga_bt.cli.picture_out import (
    HERE,
    AllOption,
    AsciiOption,
    OutOption,
    TasksArgument,
    UrlOption,
    WidthOption,
    chosen,
    columns,
    draw,
    form_of,
    is_plain,
    source_of,
)


def command(
    tasks: TasksArgument = None,
    every: AllOption = False,
    out: OutOption = None,
    begin: Annotated[
        str, typer.Option("--from", help="Show it from then on, counted from the first request.", metavar="DURATION")
    ] = "",
    end: Annotated[str, typer.Option("--to", help="Show it until then, likewise.", metavar="DURATION")] = "",
    clock: Annotated[bool, typer.Option("--clock", help="The time of the day at the axis, of this machine.")] = False,
    page: Annotated[int, typer.Option(min=1, help="Of a chart with too many rows for one.")] = 1,
    ascii_only: AsciiOption = False,
    width: WidthOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what it is drawn from as JSON.")] = False,
    site: Annotated[
        Path | None, typer.Option(help="Site file of the engine. Default: the engine of this folder.", metavar="FILE")
    ] = None,
    url: UrlOption = "",
    journal: JournalOption = "",
    at: AtOption = "",
) -> None:
    """Draw what each agent of some tasks did when, and what they waited for.

    Bars carry the names of actions, or letters that the legend tells; a bar that ended badly is marked. Examples:
    formiga gantt PickUp-12; formiga gantt --all --from "10 min" -o day.html
    """
    ids = chosen(tasks, every, "gantt")
    if out is not None and out != HERE:
        form_of(out)
    from_us, to_us = duration("--from", begin), duration("--to", end)
    timeline = source_of(site, url, journal, at).timeline(ids)
    if as_json:
        import msgspec

        typer.echo(msgspec.json.format(msgspec.json.encode(timeline), indent=2).decode())
        return
    from datetime import UTC, datetime, tzinfo

    from formiga_bt.show.gantt.files import made
    from formiga_bt.show.gantt.text import drawn

    zone: tzinfo = datetime.now().astimezone().tzinfo or UTC
    plain, room = is_plain(ascii_only), columns(width)
    draw(
        out,
        lambda form: made(timeline, form, clock=clock, zone=zone, from_us=from_us, to_us=to_us, page=page),
        lambda: drawn(
            timeline, room, ascii_only=plain, clock=clock, zone=zone, from_us=from_us, to_us=to_us, page=page
        ),
    )


def duration(option: str, text: str) -> int | None:
    """Return a duration of the command line in microseconds, None if it is not given.

    Raises:
        UnusableFile: it is none.
    """
    from formiga_bt.base.clock import micros
    from formiga_bt.base.units import parse_quantity

    if not text:
        return None
    found = parse_quantity(text)
    if found is None or found[0] != "duration":
        raise UnusableFile(f'{option}: \'{text}\' is no duration; write for example {option} "90 s" or "5 min"')
    return micros(found[1])
