"""What a journal holds, as values: steps, starts, files, gaps."""

from typing import Final, Literal

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.engine.kernel.inputs import EngineStep
from formiga_bt.journal.outbox import NewsItem


class StepRow(Struct, frozen=True):
    """A step ready to be written."""

    seq: int
    at: Micros
    wall: Micros
    kind: str
    tasks: tuple[str, ...]
    blob: bytes
    news: tuple[NewsItem, ...] = ()
    """For the outbox."""


class KeptStep(Struct, frozen=True):
    """A step as it was written."""

    seq: int
    at: Micros
    wall: Micros
    """Wall time when it was written."""
    kind: str
    step: EngineStep


class Start(Struct, frozen=True):
    """A start of an engine."""

    epoch: int
    seq: int
    """Its first step comes after."""
    at: Micros
    wall: Micros
    versions: dict[str, str]
    ended: Micros | None
    """Wall time of its clean end."""


class BundleRow(Struct, frozen=True):
    """The exact files of a task (or of the site) that an engine had."""

    name: str
    """The task; `!site` = the site file and the catalogue."""
    bundle: str
    file: str
    texts: dict[str, str]
    origin: Literal["base", "loaded"]
    epoch: int


SITE_FILES: Final = "!site"


class Gap(Struct, frozen=True):
    """Steps that could not be written, and did not fit into memory any more."""

    seq: int
    """Of the first."""
    to_seq: int
    at: Micros
    to_at: Micros
    why: str
