"""`formiga export`: write a task in another tool's format."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import near, read_task, read_world, readable, rendered, written


class Target(StrEnum):
    """Formats that a task can be written in."""

    BTCPP = "btcpp"


def command(
    file: Annotated[Path, typer.Argument(help="Task file.", metavar="FILE")],
    to: Annotated[Target, typer.Option("--to", help="The format: XML of BehaviorTree.CPP 4.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write to this file.", metavar="FILE")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE of --out.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse if anything is lost.")] = False,
    site: Annotated[Path | None, typer.Option(help="Site file.", metavar="FILE")] = None,
    actions: ActionsOption = None,
) -> None:
    """Write a task in another tool's format, and report what that format cannot say.

    What is lost is listed with its place, and in the file. Exit code 0: written. 1: the task has errors, or --strict
    refused.
    """
    from formiga_bt.bridges.btcpp_out import export_btcpp

    assert to is Target.BTCPP
    world = read_world(actions or (), site, near=near(file))
    read = read_task(readable(file), world)
    errors = [d for d in (*world.diagnostics, *read.diagnostics) if d.severity == "error"]
    if errors:
        typer.echo("\n\n".join(rendered(errors, {**world.sources, **read.sources})), err=True)
        raise typer.Exit(1)
    if read.task is None:
        typer.echo(f"formiga: {file} holds subtrees only; export a task that uses them", err=True)
        raise typer.Exit(1)
    done = export_btcpp(read.task, world.catalogue, read.sources)
    for text in rendered(done.lost, read.sources):
        typer.echo(text + "\n", err=True)
    if strict and done.lost:
        typer.echo(f"refused: {_count(len(done.lost))} in {file} without a counterpart", err=True)
        raise typer.Exit(1)
    written(done.xml, out, force=force)
    if done.lost:
        typer.echo(f"written, with {_count(len(done.lost))} without a counterpart", err=True)


def _count(number: int) -> str:
    return f"{number} thing{'' if number == 1 else 's'}"
