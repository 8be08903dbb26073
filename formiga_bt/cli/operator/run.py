"""`formiga run`: request a task of a running engine, and with --follow watch it to its end."""

import shutil
import sys
import time
import uuid
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from formiga_bt.cli.client import (
    ApiError,
    Client,
    JsonOption,
    SiteOption,
    connect,
    interrupts,
    print_json,
    segment,
    show_next,
    user,
)
from formiga_bt.cli.loading import is_file_word, load_file
from formiga_bt.cli.operator.inbox import answer_command
from formiga_bt.cli.operator.why import OVER, in_words
from formiga_bt.cli.params import ProfileOption, of_profile_by_name, read_params

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
    priority: Annotated[str, typer.Option(help="low, medium or high. Default: the task's own.")] = "",
    wait: Annotated[
        str,
        typer.Option(help="How long at most it waits for its agents: 10 min. Default: as its roles say.", metavar="TIME"),
    ] = "",
    expires: Annotated[
        str, typer.Option(help="The longest time PENDING: 2 h. Default: as the task says.", metavar="TIME")
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
    params = read_params(param or [])
    client = connect(site)
    loaded: dict[str, Any] = {}
    file = task if is_file_word(task) else ""
    if file:
        loaded = load_file(client, Path(file), by=by or user(), site=site, quiet=as_json)
        task = loaded["task"]
    if profile:
        params |= of_profile_by_name(profile, task, params, client.get("/v1/library")["tasks"])
    body: dict[str, Any] = {"task": task, "params": params, "priority": _priority(priority), "by": by or user()}
    body |= _duration("wait_s", wait, "--wait") | _duration("expires_s", expires, "--expires")
    task_id = _requested(client, {**body, "bundle": loaded["bundle"]} if loaded else body, file)
    if not follow:
        if as_json:
            print_json({"id": task_id})
        else:
            typer.echo(task_id)
            show_next(f"formiga why {task_id}", "formiga tasks", f"formiga abort {task_id}")
        return
    interrupted = _Follow(client, task_id, by or user(), quiet=as_json).run()
    end = client.get(f"/v1/tasks/{segment(task_id)}")
    if as_json:
        print_json(end)
    else:
        _closing(end)
    if interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)
    if end["status"] != "SUCCEEDED":
        raise typer.Exit(1)


def _requested(client: Client, body: dict[str, Any], file: str) -> str:
    try:
        return str(client.post("/v1/tasks", body, key=uuid.uuid4().hex)["id"])
    except ApiError as error:
        if error.code == "not_approved" and file:
            show_next(f"formiga approve {file} --by NAME")
        raise


def _duration(key: str, text: str, option: str) -> dict[str, float]:
    """Return the key with a duration in seconds, or nothing if none was given."""
    if not text:
        return {}
    from formiga_bt.base.units import parse_quantity

    found = parse_quantity(text.strip())
    if found is None or found[0] != "duration" or found[1] < 0.0:
        raise typer.BadParameter(f"'{text}' is no duration: 30 s, '10 min', 2h", param_hint=option)
    return {key: found[1]}


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
        self._path = f"/v1/tasks/{segment(task_id)}"
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
            task = self._client.get(self._path)
            self._began = task["unix_millis_submitted"]
            self._say(f"{self._task} {task['status']}")
            if task["status"] in OVER:
                return False
            # From its beginning: what happened between the request and this line is not missed.
            for event in self._client.events(after=f"{self._client.address.epoch}.0", task=self._task):
                if seen and not aborted:
                    aborted = True
                    self._abort()
                if event.type and event.type != "gap":
                    self._print(event.data)
                elif not event.type:
                    self._show_progress()
                if event.data.get("section") == "done" or (event.type in ("", "gap") and self._is_over()):
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
            task = self._client.get(self._path)
            doing = ", ".join(f"{g['agent']} {g['action']} {g['phase']}".rstrip() for g in task["goals"])
            held = f" HELD ({', '.join(task['held'])})" if task["held"] else ""
            self._progress(f"{task['duration_s']:8.1f} s  {task['status']}{held}  {doing}")

    def _progress(self, text: str) -> None:
        if self._is_terminal:
            columns = shutil.get_terminal_size().columns
            sys.stdout.write(f"\r\x1b[K{text[: columns - 1]}")
            sys.stdout.flush()

    def _is_over(self) -> bool:
        return self._client.get(self._path)["status"] in OVER

    def _abort(self) -> None:
        self._say(f"aborting {self._task}; waiting until its machines are home. Ctrl-C again: stop watching")
        try:
            self._client.post(f"{self._path}/abort", {"by": self._by})
        except ApiError as error:
            self._say(str(error))

    def _print(self, data: dict[str, Any]) -> None:
        if data["type"] == "task" and data.get("status") == "ASSIGNED":
            self._told = True  # it got its agents
        if not _telling(data):
            return
        at = (data["unix_millis"] - (self._began or 0)) / 1000
        mark = "ALARM " if data["type"] == "alarm" else ""
        self._say(f"{at:8.1f} s  {mark}{data['text']}")
        if data["type"] == "question" and data.get("state") == "open":
            for question in self._client.get("/v1/inbox")["questions"]:
                if question["number"] == data["question"] and question["here"]:
                    self._say(f"            answer: {answer_command(question, '|'.join(question['options']))}")
        sys.stdout.flush()

    def _explain(self) -> None:
        if not self._told and time.monotonic() - self._waits_since > WHY_AFTER_S:
            self._told = True
            self._say(in_words(self._client.get(f"{self._path}/why")))


def _telling(data: dict[str, Any]) -> bool:
    """Return whether an event is worth a line."""
    if data["type"] == "task":
        return data["section"] != "done" and data["status"] not in ("PENDING", "ASSIGNED")
    if data["type"] == "goal":
        return data["state"] not in ("sent", "accepted") and bool(data["state"] != "gated" or data["code"])
    if data["type"] == "agent":
        return (
            data["pool"] in ("QUARANTINED", "PARKED_AWAY") or data["control"] != "engine" or data["liveness"] != "ALIVE"
        )
    return True


def _closing(end: dict[str, Any]) -> None:
    why = f": {end['code']} {end['reason']}".rstrip() if end["code"] else ""
    done = sum(action["state"] == "succeeded" for action in end["actions"])
    agents = ", ".join(end["agents"]) or "nobody"
    typer.echo(f"{end['id']} {end['status']} after {end['duration_s']:.0f} s, {done} actions by {agents}{why}")
    show_next("formiga tasks" if end["status"] == "SUCCEEDED" else f"formiga why {end['id']}")
