"""`formiga new`: a commented task file to start from. Each kind checks without a warning and flies in `formiga dryrun`."""

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer

from formiga_bt.cli.author.starts import start
from formiga_bt.cli.inputs import UnusableFile, read_world
from formiga_bt.cli.printing import show_next


class StartKind(StrEnum):
    """What a new task does."""

    survey = "survey"
    fetch = "fetch"
    ask = "ask"
    patrol = "patrol"
    empty = "empty"


_NAME: Final = re.compile(r"[A-Z][A-Za-z0-9]*")
_TYPE: Final = re.compile(r"^    type: (\w+)", re.MULTILINE)
_TRY: Final = re.compile(r"^#   (?:check|try) it: +(formiga .*)$", re.MULTILINE)


def command(
    name: Annotated[str, typer.Argument(help="The task's name, CamelCase; or `agent`.", metavar="NAME")],
    file: Annotated[
        str,
        typer.Argument(help="After `agent`: its Python file, such as rover.py.", metavar="FILE", show_default=False),
    ] = "",
    kind: Annotated[
        StartKind | None, typer.Option(help="What it does. Default: survey, if the site has a machine that can.")
    ] = None,
    of_type: Annotated[
        str, typer.Option("--for", help="An agent type: each of its actions once.", metavar="TYPE", show_default=False)
    ] = "",
    folder: Annotated[
        Path | None, typer.Option("--in", help="The folder. Default: trees/ if there is one, else this.", metavar="DIR")
    ] = None,
) -> None:
    """Make a task file to start from: it checks without a warning and flies in `formiga dryrun`. Or an agent of your own.

    Where nobody of the site can do a survey, the task tries each action of the site's first type; --for names another one.

    `formiga new agent rover.py` makes a machine in Python, a task that sends it its first goal, and what of the catalogue and
    the site is not there yet. Exit code 2: the name cannot be one, or the file is there already.
    """
    if name == "agent" or file:
        from formiga_bt.cli.author import new_agent

        if name != "agent" or not file:
            raise UnusableFile("name the agent's Python file", help="such as: formiga new agent rover.py")
        new_agent.make(file, folder)
        return
    if not _NAME.fullmatch(name):
        words = re.findall(r"[A-Za-z0-9]+", name)
        meant = "".join(word[:1].upper() + word[1:] for word in words)
        hint = f"; such as: {meant}" if _NAME.fullmatch(meant) else "; such as: LookAround"
        raise UnusableFile(f"a task's name is CamelCase, this is '{name}'{hint}")
    place = folder if folder is not None else Path("trees") if Path("trees").is_dir() else Path()
    path = place / f"{re.sub(r'(?<=[a-z0-9])(?=[A-Z])', '_', name).lower()}.yaml"
    text = _text(name, path, kind, of_type)
    try:
        place.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as new:
            new.write(text)
    except FileExistsError as error:
        raise UnusableFile(f"{path} is there already; nothing was changed", help="choose another name") from error
    except OSError as error:
        raise UnusableFile(f"cannot write {path}: {error.strerror or error}") from error
    typer.echo(f"made {path}")
    show_next(*_TRY.findall(text))


def _text(name: str, path: Path, kind: StartKind | None, of_type: str) -> str:
    """Return the new file: of a kind; or of a type, if one is named, or if nobody of the site can do a survey.

    Raises:
        UnusableFile: no type is called so.
    """
    from formiga_bt.cli.author.first_task import text_for

    if kind is not None and of_type:
        raise UnusableFile("--kind and --for exclude each other", help="leave one out")
    site_file = Path("site.yaml")
    world = read_world(site=site_file) if site_file.is_file() else read_world()
    types = world.catalogue.types
    text = start((kind or StartKind.survey).value)
    if kind is None and not of_type and world.site is not None:
        here = [one.type for one in world.site.agents.values() if one.type in types]
        can = {name for one in here for name in (one, *types[one].extends)}
        if here and not can.issuperset(_TYPE.findall(text)):
            of_type = min(here, key=lambda one: types[one].human)
    if of_type:
        found = types.get(of_type)
        if found is None:
            raise UnusableFile(f"no type is called '{of_type}'", help=f"types: {', '.join(types)}")
        return text_for(found, name, str(path), world.catalogue, world.site)
    return text.replace("@file", str(path)).replace("@Task", name)
