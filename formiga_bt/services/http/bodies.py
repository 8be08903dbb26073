"""What requests of the API bring, as pydantic models: they validate it. What it answers are the facts of `show.facts`."""

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

Id = Annotated[str, Field(min_length=1, max_length=200)]
Name = Annotated[str, Field(max_length=200)]

LONGEST_S: Final = 30 * 86400.0
"""That a request may say it waits."""


class RequestBody(BaseModel):
    """A request; a key that nobody reads is a mistake of its writer."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class ByBody(RequestBody):
    """Who gives the order."""

    by: Name = ""
    """A person, or a program."""


# -- tasks -------------------------------------------------------------------------------------------------------------
class ValueFileBody(RequestBody):
    """The text of a file with values of parameters, as `formiga run --params-from` sends it."""

    file: Annotated[str, Field(max_length=300)]
    """Its name says how it is read: .csv, .geojson, .json or .yaml."""
    text: str
    param: Name = ""
    """Which parameter it is for; empty: the one that is called as the file is, or several."""


class SubmitBody(RequestBody):
    """Start a task. Each parameter is a text as on the command line ("60 m", "camp", "66.501,25.703") or JSON."""

    task: Id
    params: dict[str, Any] = {}
    params_from: Annotated[list[ValueFileBody], Field(default_factory=list, max_length=20)]
    """Further parameters, from files."""
    priority: Literal["low", "medium", "high"] | None = None
    by: Name = ""
    """Who requests it."""
    bundle: Annotated[str, Field(max_length=64)] = ""
    """Of the version that is meant, as GET /v1/library lists it; empty: the newest."""
    wait_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = None
    """How long at most it waits for its first agents, instead of what its roles say; then it ends FAILED `no_agent`."""
    expires_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] | None = None
    """The longest time PENDING, instead of the task's own; then it ends FAILED `task_expired`."""
    not_before: Annotated[str, Field(max_length=40)] = ""
    """It is not served before: `14:00` of today or a date and time, in the site's time zone unless it has an offset."""
    after: Annotated[list[Id], Field(default_factory=list, max_length=100)]
    """It is not served before these tasks have SUCCEEDED; if one ends otherwise it ends FAILED `after_failed`."""
    deadline: Annotated[str, Field(max_length=40)] = ""
    """Its end is wanted by then, written as `not_before`."""
    if_late: Literal["run", "drop", "fail"] = "run"
    """At the deadline: it goes on; it ends FAILED `late` if it has not begun; it ends so in any case."""


class AbortBody(ByBody):
    """End a task. `now` skips its cleanup; `abandon` leaves its agents quarantined where they are, and must be confirmed."""

    how: Literal["", "now", "abandon"] = ""
    confirmed: bool = False


class DraftedBody(RequestBody):
    """A model wrote the task, as the sender knows: who asked for it, and which model."""

    by: Annotated[list[Name], Field(default_factory=list, max_length=10)]
    model: Name = ""
    also: Annotated[list[Name], Field(default_factory=list, max_length=10)]
    """Other names of those who asked."""


class LoadBody(ByBody):
    """A task and what it imports, as texts by their paths below the site's folder; `file` is the task's.

    What ships with formiga_bt is not sent. The whole body may have 1,000,000 bytes.
    """

    file: Id
    texts: Annotated[dict[Id, str], Field(min_length=1, max_length=100)]
    drafted: DraftedBody | None = None
    """On a site in mode real such a task needs the approval of another person. It cannot be taken back."""


# -- machines and people -----------------------------------------------------------------------------------------------
class AgentOrderBody(ByBody):
    """An order for one machine. `cut` stops its motors, also in the air: `confirmed` must repeat the machine's id."""

    order: Literal["hold", "return", "land", "cut", "continue"]
    confirmed: Name = ""


class TaskOrderBody(ByBody):
    """An order for all machines of a task; `restart`: it begins anew from its first step."""

    order: Literal["hold", "return", "land", "continue", "restart"]


class AllOrderBody(ByBody):
    """An order for every machine of the site."""

    order: Literal["hold", "return", "land", "continue"]


class AssignBody(ByBody):
    """Give an agent to a task that waits for agents."""

    agent: Id
    role: Name = ""
    """Of the task; needed if the agent could take several."""


class PriorityBody(ByBody):
    """Another priority for a task that waits; `first`: it is served before all others of that priority."""

    priority: Literal["low", "medium", "high"]
    first: bool = False


class RuleBody(ByBody):
    """A word on what a standing rule has waiting; `agent`: to whom it happened, needed if several wait."""

    agent: Name = ""


class AcknowledgeBody(ByBody):
    """Who takes care of an alarm, and what they say of it."""

    note: Annotated[str, Field(max_length=500)] = ""


class LockdownBody(ByBody):
    """Press lockdown: machines in the air do `how`; or release it."""

    how: Literal["hold", "return", "land", "release"] = "return"


class HandbackBody(ByBody):
    """Give a machine back that its pilot had taken over.

    `continue`: the interrupted step is sent again. `return`: it flies to its port, its task stays HELD. `end`: the interrupted
    step fails with `taken_over`.
    """

    how: Literal["continue", "return", "end"] = "end"


class OutBody(ByBody):
    """Take a machine out of service."""

    reason: Annotated[str, Field(min_length=1, max_length=200)]


class ZoneBody(ByBody):
    """Close a region, or 30 m around a place, for machines."""

    reason: Annotated[str, Field(min_length=1, max_length=200)]


class RemovedBody(ByBody):
    """A person took a lost machine away, and says so: `confirmed` must repeat its id."""

    confirmed: Name = ""


class MemberBody(ByBody):
    """Add an agent to the fleet."""

    type: Name = ""
    """Empty: as it announced itself."""
    home: Name = ""
    """Its own port or station; empty: a free port for what flies."""


class AnswerBody(RequestBody):
    """An answer to a question; `by` is the person's agent id, needed if several people of this desk are asked."""

    option: Id
    by: Name = ""
    fields: dict[str, Any] = {}
    """Of its form, by name: as text ("60 m", "camp") or JSON."""


class EventBody(RequestBody):
    """An event that a person at this desk reports; the fields as text ("60 m", "camp") or JSON."""

    event: Id
    fields: dict[str, Any] = {}


class ApprovalBody(RequestBody):
    """Approve a task as it is served. `typed`: the first 8 characters of the digest, typed by the person `by`.

    With `revoke` an approval is taken back; then `typed` is not needed.
    """

    task: Id
    by: Id
    digest: Annotated[str, Field(max_length=64)] = ""
    typed: Name = ""
    revoke: bool = False


class DutyBody(ByBody):
    """A pilot goes on duty, or off."""

    on: bool
