"""What passes between the parts of a draft: replies of a model, rounds, what a dry run showed, and the draft itself."""

from typing import Any, Literal

from msgspec import Struct

from formiga_bt.show.facts import Chart, Drawing, LineFact, StepFact, Timeline

Rung = Literal["strict", "schema", "json", "text"]
"""How a model was held to the form: by a strict schema, by a schema, by JSON mode and the schema in the prompt, or by words."""


class Usage(Struct, frozen=True):
    """Tokens of one reply, and what they cost, if a price is known (US dollars)."""

    prompt: int = 0
    cached: int = 0
    """Of the prompt: what the server had ready from an earlier request."""
    completion: int = 0
    cost_usd: float | None = None


class ModelReply(Struct, frozen=True, kw_only=True):
    """What a model answered."""

    text: str
    data: Any = None
    """The JSON value in it; None: there is none."""
    finish: str = "stop"
    """`stop`, or `length`: it was cut off, which is never a usable answer."""
    rung: Rung = "schema"
    usage: Usage = Usage()
    seconds: float = 0.0
    model: str = ""


class Message(Struct, frozen=True):
    """One message of the talk with a model."""

    role: Literal["system", "user", "assistant"]
    text: str


class ParamValue(Struct, frozen=True):
    """A value that the task is run with."""

    name: str
    text: str
    """As on the command line: `60 m`, `camp`."""
    words: str = ""
    """The words of the request that it comes from; "" = assumed."""


class Shortfall(Struct, frozen=True):
    """Something that was asked for and is not so, or that happened and was not asked for; or a diagnostic of the checker."""

    code: str
    """`E020` and the like of the checker; or of the comparison: `place_not_visited`, `moved_unasked`, `not_landed`, ..."""
    text: str
    """For people and for the model."""
    where: str = ""
    """JSON path in the tree, or a step's place, or empty."""
    help: str = ""
    severity: Literal["error", "warning"] = "error"
    about: str = ""
    """What it speaks of, for programs: the name of a place, or the words of an amount or of a number of times."""
    wanted: int = 0
    """How often something was asked for."""
    unknown: str = ""
    """Of the checker: a word that names nothing here."""


class RehearsedFlight(Struct, frozen=True, kw_only=True):
    """What a dry run showed."""

    task: str
    status: str
    """SUCCEEDED, FAILED, CANCELED, UNFINISHED, or REFUSED (it did not start)."""
    code: str = ""
    reason: str = ""
    breach: float | None = None
    """Of a limit for which the gate refused the last goal: how far it would have gone, SI, percent 0..100."""
    short: dict[str, str] = {}
    """By machine that was full and has too little charge to go there and come home: the numbers, in words."""
    duration_s: float = 0.0
    agents: dict[str, tuple[str, ...]] = {}
    """By role."""
    visited: dict[str, tuple[str, ...]] = {}
    """By machine: the named places of the site, and params, that it was over or landed at, in order."""
    landed: dict[str, tuple[str, ...]] = {}
    """By machine: where it landed, in order: a named place, `home`, or `12 E 40 N`."""
    stands: dict[str, str] = {}
    """By machine that took part: where it stands at the end (a place's name, `12 E 40 N`), or `in the air`."""
    moved_unasked: tuple[str, ...] = ()
    """Machines that moved and were in no role."""
    asked: tuple[str, ...] = ()
    """People who were asked something."""
    crashes: int = 0
    least_battery: dict[str, float] = {}
    drawing: Drawing | None = None
    steps: tuple[StepFact, ...] = ()
    timeline: Timeline | None = None
    chart: Chart | None = None
    lines: tuple[LineFact, ...] = ()


class Round(Struct, frozen=True, kw_only=True):
    """One question to the model and what came of it."""

    messages: tuple[Message, ...]
    reply: ModelReply
    yaml: str = ""
    shortfalls: tuple[Shortfall, ...] = ()
    flight: RehearsedFlight | None = None
    mends: tuple[str, ...] = ()
    """What was put right without asking the model."""
    answer: str = ""
    """JSON of the answer that was judged, where a program had edited it; "" = the reply."""


class Draft(Struct, frozen=True, kw_only=True):
    """What came of a request."""

    request: str
    kind: Literal["task", "question", "impossible", "failed"]
    """`failed`: no round gave a task that passes."""
    plan: str = ""
    say: str = ""
    """The question, or why it cannot be done and what could be instead, or why it failed."""
    task: str = ""
    """The task's name."""
    yaml: str = ""
    values: tuple[ParamValue, ...] = ()
    flight: RehearsedFlight | None = None
    shortfalls: tuple[Shortfall, ...] = ()
    """Of the last round: warnings of a task that passes, errors of one that does not."""
    rounds: tuple[Round, ...] = ()
    provider: str = ""
    model: str = ""
    seconds: float = 0.0

    @property
    def is_flyable(self) -> bool:
        """Return whether a person may be asked to approve it."""
        return self.kind == "task"


class Origin(Struct, frozen=True, kw_only=True):
    """Where a task came from, kept with it."""

    by: str
    request: str
    provider: str
    model: str
    prompt_sha256: str
    rounds: int
    bundle: str = ""
    """Hash of the task as approved."""
    approved_by: str = ""
    unix_millis: int = 0
