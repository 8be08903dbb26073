"""Which scenario a word on the command line means, read and checked. Used by `sim` and `demo`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.packaged import folder
from formiga_bt.cli.inputs import UnusableFile, added_catalogues, readable

if TYPE_CHECKING:
    from formiga_bt.lang.scenario import Scenario


def shipped() -> list[str]:
    """Return the names of the scenarios that ship with formiga."""
    return sorted(path.stem for path in (folder("trees") / "scenarios").glob("*.yaml"))


def find_scenario(word: str) -> Path:
    """Return the file that a word names: a path, else a scenario that ships with formiga.

    Raises:
        UnusableFile: neither.
    """
    path = Path(word)
    if path.is_file() or path.suffix or len(path.parts) > 1:
        return readable(path)
    inside = folder("trees") / "scenarios" / f"{word}.yaml"
    if word in shipped():
        return inside
    from formiga_bt.lang.text.reading import did_you_mean

    what = f"no scenario is called '{word}'{did_you_mean(word, shipped())}"
    raise UnusableFile(f"{what}", help=f"name a file, or one of {', '.join(shipped())}")


def read_scenario(word: str, actions: Sequence[Path] = ()) -> "Scenario":
    """Read and check a scenario with all that it names.

    Raises:
        UnusableFile: there is no such file.
        FormigaError: it has errors; the text tells all of them.
    """
    from formiga_bt.base.diagnostics import render
    from formiga_bt.lang.scenario import load_scenario

    path = find_scenario(word)
    loaded = load_scenario(path, actions=added_catalogues(actions))
    errors = [problem for problem in loaded.diagnostics if problem.severity == "error"]
    if loaded.scenario is None or errors:
        texts = [render(problem, loaded.sources) for problem in errors]
        raise FormigaError("\n\n".join([*texts, f"{path} cannot be played"]))
    return loaded.scenario


def note_of_clock(play: "Scenario") -> None:
    """Say that a scenario's `now` does not count where the clock is that of an engine."""
    if play.now is not None:
        typer.echo(
            "note: 'now' of the scenario counts with formiga sim --virtual; here the clock is the engine's", err=True
        )
