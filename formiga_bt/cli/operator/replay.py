"""`formiga replay`: the past, from the journal: a player in the terminal, or text; a task's story, also as a test case."""

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from formiga_bt.base.errors import UnusableFile
from formiga_bt.cli.options import JsonOption, print_table
from formiga_bt.cli.past import AtOption, JournalOption, machine_of, moment_of, report_end, zone
from formiga_bt.cli.printing import print_json

if TYPE_CHECKING:
    from formiga_bt.show.replay.machine import TimeMachine
    from formiga_bt.show.replay.source import JournalSource


def command(
    at: AtOption = "",
    task: Annotated[str, typer.Option(help="The story of this task, for example PickUp-12.", metavar="TASK-ID")] = "",
    speed: Annotated[
        float | None,
        typer.Option(help="Play at once, so many times as fast as it was.", min=0.01, max=10_000, metavar="X"),
    ] = None,
    as_test: Annotated[
        Path | None,
        typer.Option("--as-test", help="Write the task's story as a case for formiga test.", metavar="FILE.test.yaml"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE of --as-test.")] = False,
    as_json: JsonOption = False,
    ascii_only: Annotated[bool, typer.Option("--ascii", help="Use plain ASCII characters.")] = False,
    text: Annotated[bool, typer.Option("--text", help="Print it; no player.")] = False,
    site: Annotated[
        Path | None,
        typer.Option(help="Site file. Default: the site of this folder, or of one above it.", metavar="FILE"),
    ] = None,
    journal: JournalOption = "",
) -> None:
    """Look at the past of a site: play it, step from event to event, jump; without a terminal print it.

    It works with and without a running engine, and changes nothing. ? shows the keys. Examples: formiga replay --at 10:15;
    formiga replay --task PickUp-12 --speed 10; formiga replay --task PickUp-12 --as-test pickup.test.yaml
    """
    if as_test is not None and not task:
        raise UnusableFile("--as-test writes the story of a task; say which: --task PickUp-12")
    with machine_of(site, journal) as machine:
        if as_test is not None:
            from formiga_bt.cli.operator.replay_case import write_case

            write_case(machine, task, as_test, force=force)
            return
        is_there = sys.stdin.isatty() and sys.stdout.isatty() and sys.stderr.isatty()
        if is_there and not (text or as_json):
            _play(machine, at, task, speed, ascii_only=ascii_only)
            return
        if speed is not None:
            raise UnusableFile("--speed plays, and that needs a terminal; without it the past is printed")
        _print(machine, at, task, as_json=as_json)


def _play(machine: "TimeMachine", at: str, task: str, speed: float | None, *, ascii_only: bool) -> None:
    from formiga_bt.cli.operator.watch import can_draw
    from formiga_bt.show.replay.cursor import Cursor, is_event, is_failure
    from formiga_bt.show.watch.player import Player

    begin = at or (f"{task} start" if task else "start" if speed is not None else "end")
    cursor = Cursor(machine, moment_of(machine, begin), task=task, speed=speed or 1.0)
    cursor.plays = speed is not None
    colour = not os.environ.pop("NO_COLOR", "") and os.environ.get("TERM") != "dumb"
    for name in ("COLUMNS", "LINES"):
        os.environ.pop(name, None)
    Player(
        cursor,
        lambda direction, failure: cursor.step(direction, is_failure if failure else is_event),
        lambda words: cursor.go(moment_of(machine, words)),
        clock=time.monotonic,
        task=task,
        ascii_only=ascii_only or not can_draw(),
        colour=colour,
    ).run(mouse=False)


# -- without a terminal ------------------------------------------------------------------------------------------------
def _print(machine: "TimeMachine", at: str, task: str, *, as_json: bool) -> None:
    import msgspec

    from formiga_bt.show.replay.source import JournalSource
    from formiga_bt.show.replay.story import tale

    source = JournalSource(machine, moment_of(machine, at) if at else machine.last, zone())
    if at:
        report_end(machine, at)
    if as_json:
        print_json(msgspec.to_builtins(tale(source, task) if task else source.now(count=10_000, over=True)))
    elif task:
        _tell(source, task)
    else:
        _state(source)


def _tell(source: "JournalSource", task_id: str) -> None:
    from formiga_bt.show.replay.story import tale
    from formiga_bt.show.replay.when import in_words
    from formiga_bt.show.why import text

    told = tale(source, task_id)
    task = told.task
    typer.echo(f"{task.id}, requested {in_words(task.submitted_at, zone())} by {task.by or 'somebody'}")
    for one in told.events:
        sign = {"info": " ", "warning": "!", "alarm": "!"}[one.severity]
        typer.echo(f"{(one.at - task.submitted_at) / 1e6:8.1f} s {sign} {one.text}")
    typer.echo(text.in_words(f"{task.id} {task.status}" + (" HELD" if task.held else ""), list(told.because)))


def _state(source: "JournalSource") -> None:
    from formiga_bt.show.listed import where_words
    from formiga_bt.show.replay.when import in_words

    now = source.now(count=1000, over=True)
    counts = ", ".join(f"{count} {status}" for status, count in sorted(now.counts.items())) or "no tasks"
    typer.echo(f"{now.site} as of {in_words(now.at, zone())}: {counts}")
    if now.top.lockdown:
        typer.echo(now.top.lockdown)
    if now.tasks:
        rows: list[tuple[str, ...]] = [("TASK", "STATUS", "AGENTS", "DOES")]
        rows += [
            (
                one.id,
                one.status + (" HELD" if one.held else ""),
                " ".join(one.agents),
                one.needs or one.doing or f"{one.code} {one.reason}".strip(),
            )
            for one in now.tasks
        ]
        print_table(rows)
        if now.total > len(now.tasks):
            typer.echo(f"... and {now.total - len(now.tasks)} that ended before")
    if now.agents:
        rows = [("AGENT", "LINK", "STANDS", "CHARGE", "TASK", "DOES", "WHERE")]
        for agent in now.agents:
            stands = agent.landed if agent.mobility == "air" else ""
            does = (agent.task, agent.action, where_words(agent))
            rows.append((agent.id, agent.liveness, stands, agent.charge, *does))
        print_table(rows)
    for question in now.questions:
        typer.echo(f"{question.number} of {question.task} asks {', '.join(question.asked)}: {question.text}")
