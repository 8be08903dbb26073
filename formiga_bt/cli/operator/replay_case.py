"""`formiga replay --task ID --as-test FILE`: writes the case, plays it, and tells whether it comes out as it was."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

import typer

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.base.packaged import folder
from formiga_bt.cli.past import zone

if TYPE_CHECKING:
    from formiga_bt.rehearsal.cases.judging import Differs
    from formiga_bt.show.replay.case_story import CaseStory
    from formiga_bt.show.replay.machine import TimeMachine

SUFFIX: Final = ".test.yaml"
TRIES: Final = 4


def write_case(machine: "TimeMachine", task_id: str, out: Path, *, force: bool) -> None:
    """Write a task's story as a case that `formiga test` plays.

    Raises:
        UnusableFile: there is no such story, or the file cannot be written.
        FormigaError: the journal has not the task's files.
    """
    from formiga_bt.show.replay.case import LOOSE, told
    from formiga_bt.show.replay.case_story import story_of

    if not out.name.endswith(SUFFIX):
        raise UnusableFile(f"{out}: formiga test finds files that end in {SUFFIX}; say for example {out.stem}{SUFFIX}")
    if out.exists() and not force:
        raise UnusableFile(f"{out} is there already; --force replaces it")
    story = story_of(machine, task_id)
    loose, differs = _write_and_play(machine, story, out)
    if differs and story.first.number < len(story.runs):  # what ended its earlier runs does not come again
        shorter = story_of(machine, task_id, last_run=True)
        again = _write_and_play(machine, shorter, out)
        if again[1]:
            loose, differs = _write_and_play(machine, story, out)
        else:
            story, (loose, differs) = shorter, again
    left = [one for one in LOOSE if one in loose]
    typer.echo(
        f"written: {out}" + (f" (without {', '.join(left)}: in simulation they come otherwise)" if left else ""),
        err=True,
    )
    for text in told(story):
        typer.echo(f"note: {text}", err=True)
    if differs:
        found = "\n".join(f"  {one}" for one in differs)
        raise FormigaError(f"the case does not come out as {task_id} did; fix it by hand:\n{found}")
    typer.echo(f"it passes: formiga test {out}", err=True)


def _write_and_play(machine: "TimeMachine", story: "CaseStory", out: Path) -> "tuple[set[str], list[Differs]]":
    """Write a case, leaving out what does not come again in simulation; return what was left out, and what differs still."""
    from formiga_bt.show.replay.case import LOOSE, text_of

    task = story.task
    model = machine.files.task(task.name, task.request.bundle)
    if model is None:
        raise FormigaError(f"the journal has not the files that {task.id} ran; it cannot be played again")
    files = _files(machine, story, out)
    loose: set[str] = set()
    for _ in range(TRIES):
        _write(out, text_of(story, machine.files.site, model, files, zone(), loose))
        differs = _play(machine, out)
        more = {_part(one) for one in differs} & set(LOOSE) - loose
        if not more:
            break
        loose |= more
    return loose, differs


def _part(differs: "Differs") -> str:
    from formiga_bt.rehearsal.cases.cases import AnswerRule, GoalRule
    from formiga_bt.show.replay.case import CLEARANCE

    match differs.rule:
        case AnswerRule(text=text) if CLEARANCE in text:
            return "clearances"
        case GoalRule(does="fail"):
            return "after"
    return differs.what


def _play(machine: "TimeMachine", out: Path) -> "list[Differs]":
    from formiga_bt.rehearsal.cases.judging import judge
    from formiga_bt.rehearsal.cases.reading import load_cases
    from formiga_bt.rehearsal.cases.running import play

    read = load_cases(out, catalogue=machine.files.catalogue)
    if read.cases is None:
        told = "\n".join(str(one) for one in read.diagnostics if one.severity == "error")
        raise FormigaError(f"the case that was written has errors; this is a bug of formiga:\n{told}")
    return judge(read.cases.cases[0], play(read.cases, read.cases.cases[0]))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UnusableFile(f"cannot write {path}: {error.strerror or error}") from error


# -- the files of the task and the site ----------------------------------------------------------------------------------
def _files(machine: "TimeMachine", story: "CaseStory", out: Path) -> dict[str, str]:
    """Return what the case names as task and site; what is not on disk as it was is written beside the case."""
    row, site = machine.files.rows[story.task.name, story.task.request.bundle], machine.files.of_site
    site_text = site.texts.get(site.file, "") if site is not None else ""
    texts = {path: text for path, text in row.texts.items() if text != site_text}
    beside = out.parent / f"{out.name.removesuffix(SUFFIX)}_files"
    names = {"task": _known(row.file, texts, out) or _kept(row.file, texts, beside, out)}
    if site is not None and site_text:
        name = _known(site.file, {site.file: site_text}, out) or _kept(site.file, {site.file: site_text}, beside, out)
        if name != "demo-site.yaml":
            names["site"] = name
    return names


def _known(file: str, texts: "dict[str, str]", out: Path) -> str:
    """Return how a file is named that ships, or lies on disk as it was with all that it imports; else ""."""
    path, ships = Path(file), folder("trees") / Path(file).name
    if _says(ships, texts[file]) and all(
        _says(folder("trees") / _tail(one), text) for one, text in texts.items() if one != file
    ):
        return path.name
    if all(_says(Path(one), text) for one, text in texts.items()):
        return os.path.relpath(path.resolve(), out.parent.resolve())
    return ""


def _tail(path: str) -> Path:
    return Path(*Path(path).parts[-2:])


def _says(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False


def _kept(file: str, texts: "dict[str, str]", beside: Path, out: Path) -> str:
    home = Path(file).parent
    for one, text in texts.items():
        path = Path(one)
        inside = path.is_relative_to(home)
        _write(beside / (path.relative_to(home) if inside else _tail(one)), text)
    return os.path.relpath((beside / Path(file).name).resolve(), out.parent.resolve())
