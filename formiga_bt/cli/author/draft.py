"""`formiga draft`: a mission in words becomes a task that was checked and flown in virtual time.

Nothing runs without a person.
"""

import json
import os
import re
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from formiga_bt.base.visible import visible
from formiga_bt.cli.actions_option import ActionsOption
from formiga_bt.cli.inputs import UnusableFile, added_catalogues, is_demo, readable, site_file, written
from formiga_bt.cli.printing import user

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from formiga_bt.lang.model import Task
    from formiga_bt.llm.drafts import KeptDraft
    from formiga_bt.llm.records import Draft
    from formiga_bt.llm.world import RequestWorld
    from formiga_bt.show.styled import StyledLine


def command(
    request: Annotated[str, typer.Argument(help="The mission in words.", metavar="REQUEST")],
    provider: Annotated[str, typer.Option(help="Who answers: groq, openai, ollama, local, ...", metavar="NAME")] = "",
    model: Annotated[str, typer.Option(help="The model, as the provider calls it.", metavar="NAME")] = "",
    base_url: Annotated[str, typer.Option(help="An endpoint that speaks OpenAI's protocol.", metavar="URL")] = "",
    adapter: Annotated[
        str,
        typer.Option(
            help="A LoRA adapter (GGUF) for a local model; none: without the one of the project.", metavar="FILE"
        ),
    ] = "",
    site: Annotated[
        Path | None,
        typer.Option(help="Site file. Default: site.yaml of this folder, else the demo site.", metavar="FILE"),
    ] = None,
    actions: ActionsOption = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Write the task there.", metavar="FILE")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file.")] = False,
    run: Annotated[bool, typer.Option("--run", help="Ask, and have the running engine read and start it.")] = False,
    go_on: Annotated[bool, typer.Option("--continue", help="Change the newest draft of this site.")] = False,
    edit: Annotated[Path | None, typer.Option(help="Change this task.", metavar="FILE")] = None,
    form: Annotated[str, typer.Option(help="short, or full: the whole language, for large models.")] = "",
    candidates: Annotated[int, typer.Option(help="Ask for so many first answers.", min=1, max=10)] = 1,
    rounds: Annotated[int, typer.Option(help="Most repairs.", min=0, max=3)] = 3,
    map_: Annotated[bool, typer.Option("--map", help="Draw where the machines went in the dry run.")] = False,
    gantt: Annotated[bool, typer.Option("--gantt", help="Draw the actions of the dry run over time.")] = False,
    by: Annotated[str, typer.Option(help="Who asks. Default: you.", metavar="NAME")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")] = False,
) -> None:
    """Write a task for a mission in words; check it, fly it in virtual time, and show what it would do.

    Nothing is started. With --run a person types the task's name at the terminal; on a site in mode real an approver
    approves it first (`formiga approve`). Exit code 0: a task that passes all checks (with --run: it was started). 1: none,
    but a question, a reason why it cannot be, or what is wrong; or the model does not answer; or it was not started. 2: the
    command line or a file cannot be used.
    """
    from msgspec.structs import replace

    from formiga_bt.llm.client import open_chat
    from formiga_bt.llm.draft import Options, draft
    from formiga_bt.llm.drafts import TASK, drafts_folder, numbers, read_draft
    from formiga_bt.llm.following import following
    from formiga_bt.llm.origin import kept_with_origin
    from formiga_bt.llm.world import world_of

    here = Path("site.yaml")
    named = site or (here if here.is_file() else None)
    path = None if named is None or is_demo(named) else readable(site_file(named))
    world = world_of(path, added_catalogues(actions or ()))
    if run and not _is_terminal():
        raise UnusableFile("--run asks a person, and this is no terminal", help="-o FILE, then formiga run")
    if go_on and edit is not None:
        raise UnusableFile("--continue changes the newest draft, --edit a file; leave one out")
    folder = drafts_folder(path, world.site.name)
    there = numbers(folder) if go_on else []
    if go_on and not there:
        raise UnusableFile(f"there is no draft in {folder} to go on with")
    _can_be_written(out, force=force)
    asked, chosen, before = request, _form(form), None
    if there:
        last = read_draft(folder, there[-1])
        after = following(last.draft, request, world, chosen, _shown(last.folder / TASK))
        asked, before, chosen = after.request, after.before, after.form
    if edit is not None:
        before, chosen = _edited(edit, world, chosen)
    options = Options(form=chosen or "short", candidates=candidates, rounds=rounds)
    chat = open_chat(provider, model, base_url=base_url, adapter=adapter, is_change=before is not None)
    if note := getattr(chat, "note", ""):
        typer.echo(f"note: {note}", err=True)
    progress = _Progress(quiet=as_json)
    try:
        made = draft(asked, world, chat, options=options, edit=before, on_progress=progress.show)
    finally:
        progress.clear()
        chat.close()
    now = int(time.time() * 1000)
    kept = kept_with_origin(made, folder, world, by=by or user(), unix_millis=now, people=[user()])
    made = replace(made, yaml=kept.draft.yaml)
    task = _task(made, world)
    if out is not None and task is not None and made.is_flyable:
        with _naming(kept):
            written(made.yaml, out, force=force)
    if as_json:
        typer.echo(json.dumps(visible(_as_json(made, kept.folder)), indent=2, ensure_ascii=False))
    else:
        _print(made, task, draw_map=map_, draw_gantt=gantt)
        typer.echo(visible(f"\n{_closing(made)}; kept in {_shown(kept.folder)}"))
    if task is None or not made.is_flyable:
        raise typer.Exit(1)
    if run:
        _run(made, task, world, path, kept, out, by or user())
    elif not as_json and out is None:
        typer.echo(
            f"next: -o FILE writes it; formiga draft --continue '...' changes it; the file: {_shown(kept.folder)}/task.yaml"
        )


def _is_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _form(word: str) -> Literal["short", "full"] | None:
    if word not in ("", "short", "full"):
        raise typer.BadParameter(f"'{word}' is not short or full", param_hint="--form")
    return word or None  # type: ignore[return-value]


def _edited(
    path: Path, world: "RequestWorld", chosen: Literal["short", "full"] | None
) -> tuple[tuple[str, str], Literal["short", "full"] | None]:
    """Return a task file as what was asked before and answered, and the form of the answer."""
    from formiga_bt.lang.loader import load_task
    from formiga_bt.llm.following import shown

    loaded = load_task(readable(path), catalogue=world.catalogue, site=world.site)
    if loaded.task is None:
        raise UnusableFile(f"{path} has errors", help=f"formiga check {path}")
    purpose, answer, form = shown(path.read_text(encoding="utf-8"), world, chosen, str(path))
    return (purpose, answer), form


def _can_be_written(out: Path | None, *, force: bool) -> None:
    """Refuse a file that could not be written, before a model is asked.

    Raises:
        UnusableFile: it is there and may not be replaced, or its folder cannot be written.
    """
    if out is None:
        return
    if out.exists() and not force:
        raise UnusableFile(f"{out} exists; to replace it say --force")
    if out.is_dir():
        raise UnusableFile(f"cannot write {out}: it is a folder")
    if not out.exists() and not out.parent.is_dir():
        raise UnusableFile(f"cannot write {out}: there is no folder {out.parent}")
    if not os.access(out if out.exists() else out.parent, os.W_OK):
        raise UnusableFile(f"cannot write {out}: Permission denied")


@contextmanager
def _naming(kept: "KeptDraft") -> "Iterator[None]":
    """Say of a file that cannot be written where the draft is, so that nobody asks a model again."""
    from formiga_bt.llm.drafts import TASK

    try:
        yield
    except UnusableFile as error:
        raise UnusableFile(f"{error}", help=f"the draft is kept: {_shown(kept.folder / TASK)}") from error


class _Progress:
    """One line on the terminal while a model thinks."""

    def __init__(self, *, quiet: bool) -> None:
        self._is_on = sys.stderr.isatty() and not quiet
        self._began = time.monotonic()

    def show(self, stage: str, tokens: int) -> None:
        """Redraw the line."""
        if self._is_on:
            said = f"{stage}: {tokens} tokens, {time.monotonic() - self._began:.0f} s"
            sys.stderr.write(f"\r\x1b[K{said}")
            sys.stderr.flush()

    def clear(self) -> None:
        """Remove the line."""
        if self._is_on:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def _task(made: "Draft", world: "RequestWorld") -> "Task | None":
    if not made.yaml:
        return None
    from formiga_bt.lang.loader import load_task_text

    loaded = load_task_text(made.yaml, "draft.yaml", catalogue=world.catalogue, site=world.site, library=world.folders)
    return loaded.task


def _print(made: "Draft", task: "Task | None", *, draw_map: bool, draw_gantt: bool) -> None:
    from formiga_bt.cli.picture_out import columns, is_plain
    from formiga_bt.llm.summary import in_words

    width, plain = columns(None), is_plain(False)
    for said in in_words(made, task, width=width):
        typer.echo(visible(said))
    flight = made.flight
    if task is None or flight is None or flight.drawing is None:
        return
    from formiga_bt.show.tree.terminal import draw

    typer.echo("\nThe tree:")
    steps = {fact.path: fact for fact in flight.steps}
    for line in draw(flight.drawing, steps, width=width, ascii_only=plain, head=False):
        typer.echo(line.plain())
    if draw_map and flight.chart is not None:
        from formiga_bt.show.map import text as map_text

        _lines(map_text.drawn(flight.chart, width, ascii_only=plain, ids=(made.task,)))
    if draw_gantt and flight.timeline is not None:
        from formiga_bt.show.gantt import text as gantt_text

        _lines(gantt_text.drawn(flight.timeline, width, ascii_only=plain))


def _lines(texts: "Iterable[StyledLine]") -> None:
    typer.echo()
    for text in texts:
        typer.echo(text.plain)


def _closing(made: "Draft") -> str:
    many = len(made.rounds)
    return f"{made.kind} after {many} answer{'' if many == 1 else 's'} of {made.provider} {made.model}, {made.seconds:.0f} s"


def _as_json(made: "Draft", kept: Path) -> dict[str, Any]:
    from msgspec import to_builtins

    from formiga_bt.llm.judging.outcome import facts

    usage = [one.reply.usage for one in made.rounds]
    return {
        "kind": made.kind,
        "request": made.request,
        "plan": made.plan,
        "say": made.say,
        "task": made.task,
        "yaml": made.yaml,
        "values": [{**to_builtins(one), "assumed": not one.words} for one in made.values],
        "shortfalls": to_builtins(made.shortfalls),
        "flight": facts(made.flight) if made.flight is not None else None,
        "rounds": [
            {"answer": one.reply.text, "shortfalls": to_builtins(one.shortfalls), "mends": list(one.mends),
             "seconds": one.reply.seconds}
            for one in made.rounds
        ],
        "provider": made.provider,
        "model": made.model,
        "seconds": made.seconds,
        "tokens": {"prompt": sum(u.prompt for u in usage), "completion": sum(u.completion for u in usage)},
        "kept": str(kept),
    }  # fmt: skip


def _run(
    made: "Draft", task: "Task", world: "RequestWorld", site: Path | None, kept: "KeptDraft", out: Path | None, by: str
) -> None:
    """Ask the person, then have the engine of the site read the task and start it."""
    from formiga_bt.cli.loading import load_file
    from formiga_bt.cli.printing import show_next
    from formiga_bt.client import connect
    from formiga_bt.llm.origin import approve

    file = out if out is not None else _task_file(task.name, site)
    typer.echo()
    if world.site.mode == "real":
        from formiga_bt.safety.approval import others_than

        with _naming(kept):
            _keep_file(made, file, out)
        approver = next(iter(others_than([by, user()], world.site.people.get("approvers", ()))), "NAME")
        typer.echo(f"{world.site.name} is a real site: an approver who did not ask for it reads {file} and approves it")
        show_next(f"formiga load {file}, then: formiga approve {file} --by {approver}, then: formiga run {file}")
        raise typer.Exit(1)
    typed = typer.prompt("Run it? Type the task's name", default="", show_default=False)
    if typed.strip() != task.name:
        typer.echo("not started")
        raise typer.Exit(1)
    with _naming(kept):
        _keep_file(made, file, out)
    client = connect(site)
    bundle = load_file(client, file, by=by, site=site).bundle  # of what was read just now, whatever becomes of the file
    approve(kept, approved_by=by, bundle=bundle)
    key = f"draft-{kept.number}-{kept.origin.unix_millis}"
    task_id = client.request(task.name, by=by, bundle=bundle, key=key)
    typer.echo(task_id)
    show_next(f"formiga why {task_id}", "formiga tasks", f"formiga abort {task_id}")


def _keep_file(made: "Draft", file: Path, out: Path | None) -> None:
    """Write the task's file, unless it is there as it is; another text under that name is not replaced."""
    if out is not None:
        return
    with suppress(OSError, UnicodeDecodeError):  # what is there and cannot be read is another text
        if file.read_text(encoding="utf-8") == made.yaml:
            return
    try:
        file.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise UnusableFile(f"cannot write {file}: {file.parent}: {error.strerror or error}") from error
    written(made.yaml, file, force=False)


def _task_file(name: str, site: Path | None) -> Path:
    snake = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    folder = (site.parent if site is not None else Path()) / "trees"
    return folder / f"{snake}.yaml"


def _shown(path: Path) -> str:
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
