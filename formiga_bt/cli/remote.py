"""A source of pictures that asks a running engine over HTTP: what `show.source.Source` promises, from this machine or another.

The engine draws its answers from the same facts (`services.http.seeing_routes`), so a picture is the same from both ends.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from formiga_bt.base.errors import FormigaError, TaskError
from formiga_bt.cli.calling import ApiError, Client, connect, segment
from formiga_bt.cli.client import tell_clock
from formiga_bt.show.facts import Because, Chart, Now, Stats, TaskPicture, Timeline
from formiga_bt.show.why.near import shortened

T = TypeVar("T")
UNKNOWN: Final = frozenset({"unknown_task", "unknown_agent"})


class _Why(msgspec.Struct):
    """What `/v1/tasks/{id}/why` answers."""

    task: str
    status: str
    held: list[str]
    because: list[Because]


class RemoteSource:
    """Asks one engine; implements `Source`."""

    def __init__(self, client: Client) -> None:
        self.client = client

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant."""
        return self._get(Now, "/v1/now", first=first, count=count, find=find, over="1" if over else "")

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        return self._get(TaskPicture, f"/v1/tasks/{segment(task_id)}/picture")

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task or an agent stands, and the chain of causes."""
        try:
            found = self._get(_Why, f"/v1/tasks/{segment(of)}/why")
        except TaskError as unknown:
            try:
                found = self._get(_Why, f"/v1/agents/{segment(of)}/why")
            except TaskError as error:
                near = next((one for one in (unknown, error) if "did you mean" in str(one)), None)
                help_ = "formiga tasks and formiga agents list them"
                raise near or TaskError(
                    unknown.code, f"there is no task '{shortened(of)}', and no agent\n  help: {help_}"
                ) from None
        return f"{found.task} {found.status}".rstrip() + (" HELD" if found.held else ""), found.because

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all."""
        return self._get(Timeline, "/v1/timeline", task=list(tasks))

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map."""
        return self._get(Chart, "/v1/chart", task=list(tasks))

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread."""
        return self._get(Stats, "/v1/stats", task=task, hours=hours or "")

    def _get(self, kind: type[T], path: str, **query: Any) -> T:
        try:
            text = self.client.read(path, query)
        except ApiError as error:
            if error.code in UNKNOWN:
                raise TaskError(error.code, str(error)) from error
            if error.code == "no_such_route":
                raise self._other_version() from error
            raise
        try:
            return msgspec.json.decode(text, type=kind)
        except msgspec.DecodeError as error:  # a ValidationError is one too
            raise self._other_version() from error

    def _other_version(self) -> FormigaError:
        return FormigaError(
            f"the engine at {self.client.address.url} is of another version of formiga\n"
            "  help: formiga --version tells yours, GET /v1/health its own; install the same on both sides"
        )


class _Past(msgspec.Struct):
    """What `/v1/past/tasks/{id}` answers."""

    picture: TaskPicture
    because: list[Because]


class RemotePast(RemoteSource):
    """Asks one engine about a moment of its journal; implements `Source`.

    Args:
        client: of the engine.
        moment: as people write it.
    """

    def __init__(self, client: Client, moment: str) -> None:
        super().__init__(client)
        self.moment = moment

    def now(self, *, first: int = 0, count: int = 100, find: str = "", over: bool = False) -> Now:
        """Return the site at its instant."""
        more = {"first": first, "count": count, "find": find, "over": "1" if over else "0"}
        return self._get(Now, "/v1/past", at=self.moment, **more)

    def task(self, task_id: str) -> TaskPicture:
        """Return one task with its tree."""
        return self._of(task_id).picture

    def why(self, of: str) -> tuple[str, list[Because]]:
        """Return how a task stands, and the chain of causes."""
        found = self._of(of)
        task = found.picture.task
        return f"{task.id} {task.status}" + (" HELD" if task.held else ""), found.because

    def timeline(self, tasks: Sequence[str] = ()) -> Timeline:
        """Return the actions of some tasks, or of all of a day."""
        return self._get(Timeline, "/v1/past/timeline", at=self.moment, task=list(tasks))

    def chart(self, tasks: Sequence[str] = ()) -> Chart:
        """Return the site's map."""
        return self._get(Chart, "/v1/past/chart", at=self.moment, task=list(tasks))

    def stats(self, *, task: str = "", hours: float = 0.0) -> Stats:
        """Return durations with their spread."""
        return self._get(Stats, "/v1/past/stats", at=self.moment, task=task, hours=hours or "")

    def _of(self, task_id: str) -> _Past:
        return self._get(_Past, f"/v1/past/tasks/{segment(task_id)}", at=self.moment)


def connect_source(site: Path | None = None, url: str = "", token_file: Path | None = None) -> RemoteSource:
    """Return a source that asks the engine at an address, or the one of this folder; see `calling.connect`.

    Raises:
        NoEngine: none runs.
        UnusableFile: the address or the token cannot be used.
    """
    client = connect(site, url, token_file)
    tell_clock(client)
    return RemoteSource(client)
