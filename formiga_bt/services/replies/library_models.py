"""What the API takes and shows of the tasks that are served."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from formiga_bt.services.replies.models import Id, Name, ParamOut, RequestBody


class DraftedBody(RequestBody):
    """A model wrote the task, as the sender knows: who asked for it, and which model."""

    by: Annotated[list[Name], Field(default_factory=list, max_length=10)]
    model: Name = ""
    also: Annotated[list[Name], Field(default_factory=list, max_length=10)]
    """Other names of those who asked."""


class LoadBody(RequestBody):
    """A task and what it imports, as texts by their paths below the site's folder; `file` is the task's.

    What ships with formiga_bt is not sent. The whole body may have 1,000,000 bytes.
    """

    file: Id
    texts: Annotated[dict[Id, str], Field(min_length=1, max_length=100)]
    by: Name = ""
    drafted: DraftedBody | None = None
    """On a site in mode real such a task needs the approval of another person. It cannot be taken back."""


class LoadOut(BaseModel):
    """What became of a bundle that was loaded."""

    task: str
    bundle: str
    """SHA-256 of the task's text, its imports and the catalogue; as `bundle` of POST /v1/tasks it asks for this version."""
    version: int
    what: Literal["new", "changed", "same"]
    text: str
    warnings: list[str]


class VersionOut(BaseModel):
    """A version of a task."""

    version: int
    bundle: str
    tasks: list[str]
    """Open tasks that run it."""


class LibraryTask(BaseModel):
    """A task that can be requested."""

    task: str
    aliases: list[str] = []
    """Other names under which it may be requested."""
    description: str
    file: str
    params: list[ParamOut]
    bundle: str = ""
    """Of the version that new requests get."""
    version: int = 1
    versions: list[VersionOut] = []
    """Oldest first; those that nobody can ask for any more are left out."""


class LibraryOut(BaseModel):
    """The tasks that this engine serves, and the files that it does not for their errors."""

    tasks: list[LibraryTask]
    refused: list[str]
