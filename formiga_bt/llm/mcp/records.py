"""What an assistant may say to a tool, and what it is answered. The schemas that it is shown are made from these.

What everybody sees are the facts of `show.facts`; here is what only an assistant asks and gets.

Sizes are bounded here, so that nothing that is too large goes any further.
"""

from typing import Annotated, Any

from msgspec import Meta, Struct

from formiga_bt.base.clock import Micros
from formiga_bt.show.facts import AgentFact, Because, ParamFact, QuestionFact, TaskFact

MAX_YAML: int = 65_536
"""Bytes of a task."""
MAX_PARAMS: int = 100
MAX_VALUE: int = 4_000
"""Characters of a parameter's value."""
MAX_WHY: int = 2_000

Word = Annotated[str, Meta(max_length=100)]
Yaml = Annotated[
    str, Meta(max_length=MAX_YAML, description="A whole task file, YAML; at most 64 kB. Give this, or `task`.")
]
Task = Annotated[
    str, Meta(max_length=100, description="Name of a task that is there already (list_tasks). Give this, or `yaml`.")
]
Params = Annotated[
    dict[Word, str | int | float | bool | list[Any] | dict[str, Any]],
    Meta(
        max_length=MAX_PARAMS,
        description='Values by parameter name, with units: {"target": "north_field", "height": "60 m"}. A place is a'
        " name of the site, 'LAT,LNG' or {east: 10 m, north: 20 m}.",
    ),
]
Answers = Annotated[
    dict[Word, Annotated[list[Word], Meta(max_length=50)]],
    Meta(
        max_length=50,
        description="What people answer in the dry run, by id, one after another; without it the first option.",
    ),
]


# -- what is asked ------------------------------------------------------------------------------------------------------
class Nothing(Struct, forbid_unknown_fields=True):
    """No arguments."""


class OfType(Struct, forbid_unknown_fields=True):
    """Which actions."""

    agent_type: Annotated[str, Meta(max_length=100, description="Only the actions of this type, for example lwd.")] = ""


class TaskQuery(Struct, forbid_unknown_fields=True):
    """Which tasks."""

    find: Annotated[str, Meta(max_length=100, description="Only tasks with this in name or description.")] = ""


class Topic(Struct, forbid_unknown_fields=True):
    """A page of the language."""

    topic: Annotated[
        str, Meta(max_length=60, description="A topic that the short form lists; without it that form.")
    ] = ""


class Which(Struct, forbid_unknown_fields=True):
    """A schema."""

    form: Annotated[str, Meta(pattern="^(yaml|json)$", description="yaml: of task files. json: of the JSON form.")] = (
        "yaml"
    )


class Code(Struct, forbid_unknown_fields=True):
    """A code of the checker or a reason."""

    code: Annotated[str, Meta(max_length=60, description="For example E030, W064, no_clearance.")]


class TaskText(Struct, forbid_unknown_fields=True):
    """A task to check."""

    yaml: Yaml


class DrawQuery(Struct, forbid_unknown_fields=True):
    """A task to draw: a text, a name, or the id of one that runs."""

    yaml: Yaml = ""
    task: Task = ""
    id: Annotated[
        str, Meta(max_length=100, description="Id of a task of the running engine, for example PickUp-12.")
    ] = ""


class Flown(Struct, forbid_unknown_fields=True):
    """A task to fly in virtual time."""

    yaml: Yaml = ""
    task: Task = ""
    params: Params = {}
    answers: Answers = {}
    hours: Annotated[float, Meta(gt=0.0, le=24.0, description="Give up after so many hours of virtual time.")] = 6.0


class Proposed(Struct, forbid_unknown_fields=True):
    """A task to put before a person."""

    why: Annotated[
        str, Meta(min_length=1, max_length=MAX_WHY, description="What the person asked for, in their own words.")
    ]
    yaml: Yaml = ""
    task: Task = ""
    params: Params = {}
    answers: Answers = {}


class OfId(Struct, forbid_unknown_fields=True):
    """A task or an agent of the running engine."""

    id: Annotated[str, Meta(min_length=1, max_length=100, description="For example PickUp-12, or hwd_1.")]


# -- what is answered ---------------------------------------------------------------------------------------------------
class ListedAgent(Struct):
    """A machine or a person of the site."""

    id: str
    type: str
    kind: str
    """machine or person."""
    home: str = ""
    here: bool | None = None
    """Whether it is heard of now; null: no engine runs."""
    now: AgentFact | None = None
    """How it is, if it is heard of; places are metres from the base station."""


class ListedAgents(Struct):
    """The fleet."""

    site: str
    mode: str
    engine: str
    """running, or why nothing is known of the present."""
    agents: list[ListedAgent]
    places: list[str]
    regions: list[str]
    people: dict[str, list[str]]
    """Site roles and who has them."""
    notice: str = ""


class CatalogueAction(Struct):
    """An action of the catalogue."""

    name: str
    help: str
    agent_types: list[str]
    fields: list[ParamFact]
    result: dict[str, str]
    requires: str = ""
    """airborne or grounded: how the machine must be."""
    leaves: str = ""
    """How it is afterwards."""


class ActionsOut(Struct):
    """The catalogue."""

    actions: list[CatalogueAction]
    types: dict[str, list[str]]
    """Agent types and what they extend."""


class OfferedTask(Struct):
    """A task that can be requested."""

    task: str
    description: str
    params: list[ParamFact]
    roles: dict[str, str]
    aliases: list[str]
    own: bool
    """Of this site, not one that ships."""


class OfferedTasks(Struct):
    """The library."""

    tasks: list[OfferedTask]


class PageOut(Struct):
    """A text to read."""

    title: str
    text: str
    topics: list[str] = []


class SchemaOut(Struct):
    """A JSON Schema."""

    form: str
    schema: dict[str, Any]


class ProblemOut(Struct):
    """A problem and how to mend it."""

    code: str
    severity: str
    line: int
    column: int
    message: str
    help: str = ""
    within: str = ""
    source: str = ""
    """The line that it stands in."""
    file: str = ""
    """If it is not the given text."""


class CheckOut(Struct):
    """What the checker says."""

    ok: bool
    task: str
    errors: int
    warnings: int
    problems: list[ProblemOut]
    rendered: str
    """The same as people read it."""


class TreeOut(Struct):
    """A task as a tree."""

    task: str
    status: str
    tree: str
    notice: str = ""


class Did(Struct):
    """An action of a dry run; seconds since the task was requested."""

    agent: str
    action: str
    start_s: float
    end_s: float | None
    state: str
    where: str


class Asked(Struct):
    """A question of a dry run."""

    who: str
    text: str
    options: list[str]


class FlightOut(Struct):
    """What a dry run showed."""

    ok: bool
    """It succeeded, and nothing crashed or broke a rule."""
    task: str
    status: str
    """SUCCEEDED, FAILED, CANCELED, UNFINISHED (its time was up), or REFUSED (it did not start)."""
    code: str = ""
    reason: str = ""
    duration_s: float = 0.0
    agents: dict[str, list[str]] = {}
    """By role."""
    actions: list[Did] = []
    questions: list[Asked] = []
    log: list[str] = []
    least_battery_percent: dict[str, float] = {}
    crashes: int = 0
    unsafe_starts: int = 0
    low_flights: int = 0
    closest_pass_m: float | None = None
    why: str = ""
    """Why it ended so, if it did not succeed."""
    tree: str = ""
    """With how each step ended."""
    warnings: list[str] = []
    left_out: int = 0
    """So many actions and lines of the log are not listed."""


class ProposedOut(Struct):
    """A proposal that waits for a person."""

    proposal: int
    task: str
    file: str
    status: str
    """Of its dry run."""
    next: list[str]
    """What a person does now: commands, one after another."""
    warnings: list[str] = []


class NowOut(Struct):
    """The site at this moment."""

    site: str
    mode: str
    engine: str
    airborne: int
    needs_a_person: int
    lockdown: str
    counts: dict[str, int]
    at: Micros
    """Engine time; as all instants, in microseconds."""
    tasks: list[TaskFact]
    more_tasks: int
    questions: list[QuestionFact]
    log: list[str]
    notice: str = ""


class ExplainOut(Struct):
    """Why something stands as it does."""

    of: str
    because: list[Because]
    notice: str = ""
