"""`formiga run`: request a task of a running engine, and with --follow watch it to its end."""

import shutil
import sys
import time
import uuid
from pathlib import Path
from typing import Annotated, Literal

import typer

from formiga_bt.cli.loading import is_file_word, load_file
from formiga_bt.cli.operator.inbox import answer_command
from formiga_bt.cli.operator.why import OVER
from formiga_bt.cli.options import JsonOption, SiteOption, interrupts
from formiga_bt.cli.params import ParamsFromOption, ProfileOption, of_profile_by_name, read_params, value_files
from formiga_bt.cli.printing import print_json, show_next, user
from formiga_bt.client import ApiError, Client, connect
from formiga_bt.show.facts import EventFact, TaskDetail, TaskLoaded
from formiga_bt.show.why import text

WHY_AFTER_S = 5.0
EXIT_INTERRUPTED = 130


def command(
    task: Annotated[str, typer.Argument(help="The task's name, for example PickUp; or a task file.", metavar="TASK")],
    param: Annotated[
        list[str] | None,
        typer.Option(
            "--param", "-p", metavar="NAME=VALUE",
            help="A parameter; may be repeated. camp, 66.501,25.703, 60 m, @area.geojson",
        ),
    ] = None,
    params_from: ParamsFromOption = None,
    priority: Annotated[str, typer.Option(help="low, medium or high. Default: the task's own.")] = "",
    wait: Annotated[
        str,
        typer.Option(help="How long at most it waits for its agents: 10 min. Default: as its roles say.", metavar="TIME"),
    ] = "",
    expires: Annotated[
        str, typer.Option(help="The longest time PENDING: 2 h. Default: as the task says.", metavar="TIME")
    ] = "",
    not_before: Annotated[
        str, typer.Option(help="Not before: 14:00 of today, or 2026-08-20T14:00; the site's time.", metavar="WHEN")
    ] = "",
    after: Annotated[
        list[str] | None, typer.Option(help="Not before this task has SUCCEEDED; may be repeated.", metavar="TASK")
    ] = None,
    deadline: Annotated[str, typer.Option(help="By when its end is wanted: 15:30.", metavar="WHEN")] = "",
    if_late: Annotated[
        str, typer.Option(help="At the deadline: run (it goes on), drop (unless it has begun) or fail.")
    ] = "",
    profile: ProfileOption = "",
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Watch it to its end.")] = False,
    by: Annotated[str, typer.Option(help="Who requests it. Default: you.", metavar="NAME")] = "",
    as_json: JsonOption = False,
    site: SiteOption = None,
) -> None:  # fmt: skip
    """Request a task; print its id. A task file is read by the engine first, as `formiga load` does it.

    With --follow: prints what happens, and why when it waits longer than 5 s. Exit code 0 if it succeeded, 1 if not. Ctrl-C
    aborts the task and waits until its machines are home; a second one stops watching.
    """
    if if_late and (if_late not in ("run", "drop", "fail") or not deadline):
        why = "it says what happens at --deadline" if not deadline else f"'{if_late}' is not run, drop or fail"
        raise typer.BadParameter(why, param_hint="--if-late")
    params, files = read_params(param or []), value_files(params_from or [])
    client = connect(site)
    loaded: TaskLoaded | None = None
    file = task if is_file_word(task) else ""
    if file:
        loaded = load_file(client, Path(file), by=by or user(), site=site, quiet=as_json)
        task = loaded.task
    if profile:
        from formiga_bt.lang.request.value_files import given_in

        params |= of_profile_by_name(profile, task, [*params, *given_in(files)], client.library().tasks)
    bundle = loaded.bundle if loaded is not None else ""
    wait_s, expires_s = _duration(wait, "--wait"), _duration(expires, "--expires")
    try:
        task_id = client.request(
            task, params, priority=_priority(priority), by=by or user(), bundle=bundle,
            wait_s=wait_s, expires_s=expires_s, not_before=not_before, after=after or (), deadline=deadline,
            if_late=if_late or "run", key=uuid.uuid4().hex,
            params_from=[{"file": one.file, "text": one.text, "param": one.param} for one in files],
        )  # fmt: skip
    except ApiError as error:
        if error.code == "not_approved" and file:
            show_next(f"formiga approve {file} --by NAME")
        raise
    if not follow:
        if as_json:
            print_json({"id": task_id})
        else:
            typer.echo(task_id)
            show_next(f"formiga why {task_id}", "formiga tasks", f"formiga abort {task_id}")
        return
    interrupted = _Follow(client, task_id, by or user(), quiet=as_json).run()
    end = client.detail(task_id)
    if as_json:
        print_json(end)
    else:
        _closing(end)
    if interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if end.task.status != "SUCCEEDED":
        raise typer.Exit(1)


def _duration(text: str, option: str) -> float | None:
    """Return a duration in seconds, or None if none was given."""
    if not text:
        return None
    from formiga_bt.base.units import parse_quantity

    found = parse_quantity(text.strip())
    if found is None or found[0] != "duration" or found[1] < 0.0:
        raise typer.BadParameter(f"'{text}' is no duration: 30 s, '10 min', 2h", param_hint=option)
    return found[1]


def _priority(word: str) -> Literal["low", "medium", "high"] | None:
    if word not in ("", "low", "medium", "high"):
        raise typer.BadParameter(f"'{word}' is not low, medium or high", param_hint="--priority")
    return word or None  # type: ignore[return-value]


class _Follow:
    """Prints the events of one task until it has ended."""

    def __init__(self, client: Client, task_id: str, by: str, *, quiet: bool) -> None:
        self._client = client
        self._by = by
        self._quiet = quiet
        self._is_terminal = sys.stdout.isatty() and not quiet
        self._task = task_id
        self._waits_since = time.monotonic()
        self._told = False
        self._began: int | None = None

    def run(self) -> bool:
        """Watch; return whether a person broke it off."""
        try:
            return self._watch()
        finally:
            self._progress("")

    def _watch(self) -> bool:
        with interrupts() as seen:
            aborted = False
            task = self._client.detail(self._task).task
            self._began = task.submitted_at
            self._say(f"{self._task} {task.status}")
            if task.status in OVER:
                return False
            # From its beginning: what happened between the request and this line is not missed.
            for event in self._client.events(after=f"{self._client.address.epoch}.0", task=self._task):
                if seen and not aborted:
                    aborted = True
                    self._abort()
                if event is None:
                    self._show_progress()
                elif event.type != "gap":
                    self._print(event)
                if self._is_over() if event is None or event.type == "gap" else event.section == "done":
                    return aborted
                self._explain()
            return aborted

    def _say(self, text: str) -> None:
        if not self._quiet:
            self._progress("")
            typer.echo(text)

    def _show_progress(self) -> None:
        """Show in one line, redrawn in place, what goes on just now; for terminals only."""
        if self._is_terminal:
            found = self._client.detail(self._task)
            task = found.task
            doing = ", ".join(f"{g.agent} {g.action} {g.phase}".rstrip() for g in found.goals)
            held = f" HELD ({', '.join(task.held)})" if task.held else ""
            self._progress(f"{_lasted_s(found):8.1f} s  {task.status}{held}  {doing}")

    def _progress(self, text: str) -> None:
        if self._is_terminal:
            columns = shutil.get_terminal_size().columns
            sys.stdout.write(f"\r\x1b[K{text[: columns - 1]}")
            sys.stdout.flush()

    def _is_over(self) -> bool:
        return self._client.detail(self._task).task.status in OVER

    def _abort(self) -> None:
        self._say(f"aborting {self._task}; waiting until its machines are home. Ctrl-C again: stop watching")
        try:
            self._client.abort(self._task, by=self._by)
        except ApiError as error:
            self._say(str(error))

    def _print(self, event: EventFact) -> None:
        if event.type == "task" and event.status == "ASSIGNED":
            self._told = True  # it got its agents
        if not _telling(event):
            return
        at = (event.at - (self._began or 0)) / 1e6
        mark = "ALARM " if event.type == "alarm" else ""
        self._say(f"{at:8.1f} s  {mark}{event.text}")
        if event.type == "question" and event.state == "open":
            for question in self._client.questions().questions:
                if question.number == event.question and question.here:
                    self._say(f"            answer: {answer_command(question, '|'.join(question.options))}")
        sys.stdout.flush()

    def _explain(self) -> None:
        if not self._told and time.monotonic() - self._waits_since > WHY_AFTER_S:
            self._told = True
            self._say(text.in_words(*self._client.why(self._task)))


def _telling(event: EventFact) -> bool:
    """Return whether an event is worth a line."""
    if event.type == "task":
        return event.section != "done" and event.status not in ("PENDING", "ASSIGNED")
    if event.type == "goal":
        return event.state not in ("sent", "accepted") and bool(event.state != "gated" or event.code)
    if event.type == "agent":
        return event.pool in ("QUARANTINED", "PARKED_AWAY") or event.control != "engine" or event.liveness != "ALIVE"
    return True


def _lasted_s(found: TaskDetail) -> float:
    """Return how long a task lasts, or lasted, in seconds of engine time."""
    return ((found.at if found.task.ended_at is None else found.task.ended_at) - found.task.submitted_at) / 1e6


def _closing(end: TaskDetail) -> None:
    task = end.task
    why = f": {task.code} {task.reason}".rstrip() if task.code else ""
    done = sum(action.ended_well for action in end.actions)
    agents = ", ".join(end.granted) or "nobody"
    typer.echo(f"{task.id} {task.status} after {_lasted_s(end):.0f} s, {done} actions by {agents}{why}")
    show_next("formiga tasks" if task.status == "SUCCEEDED" else f"formiga why {task.id}")
