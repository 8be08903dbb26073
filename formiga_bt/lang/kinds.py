"""The one table of step kinds, their options, and the keys of every other mapping of a task file.

The validator, the docs and the editor and LLM schemas all read it, so that a key exists in one place only. `form`
says what a value may be; `docs/reference.md` shows them all.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal

from msgspec import Struct

Form = Literal[
    "action",  # role.Action
    "text",  # text, may hold ${...}
    "word",  # one of `values`, or an identifier
    "words",  # a list of words
    "flag",  # true or false
    "value",  # a literal or ${...} of the type in `type`
    "cond",  # a bare condition
    "expr",  # a bare expression
    "name",  # the name of a subtree, task, role or a new name
    "roles",  # a list of roles or site roles
    "map",  # names to values
    "steps",  # a list of steps
    "options",  # a mapping with the keys in `keys`
]
"""What the value of a key looks like."""


class Option(Struct, frozen=True):
    """A key of a mapping: its name, the form of its value, and one line for people."""

    name: str
    form: Form
    doc: str
    type: str = ""
    """Of a `value`: the type's name."""
    values: tuple[str, ...] = ()
    """Of a `word`: what it may be; empty = free."""
    keys: tuple["Option", ...] = ()
    """Of `options`."""
    required: bool = False
    like: str = ""
    """A value as an example, where it is required."""
    default: float | str | None = None
    """Of a number (SI) or a word: what holds where nothing is written; None = 0, or empty."""
    least: float | None = None
    most: float | None = None
    """Limits of a number, SI, that are within them."""
    above: float | None = None
    """A limit of a number, SI, that is not."""


class StepKind(Struct, frozen=True):
    """A step kind: the form of its own value, its options, and one line for people."""

    name: str
    form: Form
    doc: str
    options: tuple[Option, ...] = ()
    type: str = ""

    def option(self, name: str) -> Option | None:
        """Return the option called `name`, or None."""
        return next((option for option in self.options if option.name == name), None)


_WITH = Option("with", "map", "The arguments, by name.")
_SAVE = Option("save_as", "name", "Keep the result under this name.")
_EXPECT = Option("expect", "cond", "Fail unless this holds; it sees `result`.")
_STEPS = Option("steps", "steps", "The body.", required=True)
_REACTIVE = Option("reactive", "flag", "The checks before the running step stay live.")
_CHILD_FAILURE = Option(
    "on_child_failure",
    "word",
    "After a failure, wait for the others or cancel them (finish).",
    values=("finish", "cancel"),
    default="finish",
)
_ROUNDS = (
    _STEPS,
    Option("until", "cond", "Leave after a round in which this holds."),
    Option("every", "value", "Start of round to start of round.", type="duration"),
    Option("max", "value", "Most rounds.", type="int"),
)

RETRY: Final[tuple[Option, ...]] = (
    Option("attempts", "value", "How often to try, the first time included.", type="int", required=True, like="3"),
    Option("delay", "value", "How long to wait between attempts (0 s).", type="duration"),
    Option("backoff", "value", "Factor by which the delay grows each time (1).", type="number"),
    Option("attempt_timeout", "value", "Bound of a single attempt.", type="duration"),
    Option("agent", "word", "Who tries again (same).", values=("same", "another"), default="same"),
    Option("on", "words", "Only after failures with these reason codes.", like="[timeout]"),
    Option("unless", "words", "Not after failures with these reason codes.", like="[expect]"),
)

CLEARS: Final[tuple[Option, ...]] = (
    Option("role", "name", "The machine that people then stand clear of.", required=True, like="ROLE"),
    Option("on", "words", "The answers that say so.", required=True, like="[yes]"),
)

TRACK: Final[tuple[Option, ...]] = (
    Option("every", "value", "How often to look, from 100 ms to 10 s.", type="duration", required=True, like="2 s"),
    Option("within", "value", "How far off the target may be before the agent is told (1 m).", type="distance"),
)
"""Of `do`: what `with` reads is followed while the agent is under way."""

FORM: Final[tuple[Option, ...]] = (
    Option("type", "name", "The type.", required=True),
    Option("values", "words", "Of an enum: what it may be."),
    Option("min", "value", "The smallest value."),
    Option("max", "value", "The largest value."),
    Option("help", "text", "A line of help for who fills it in."),
)

MODIFIERS: Final[tuple[Option, ...]] = (
    Option("name", "text", "What the step is called where people see it."),
    Option("note", "text", "Shown to people beside the step."),
    Option("when", "cond", "Only if this holds at entry; else the step is skipped."),
    Option("timeout", "value", "Bound of the whole step, its retries included.", type="duration"),
    Option("retry", "options", "Try again after a failure.", keys=RETRY),
    Option("ignore_failure", "flag", "A failure counts as success."),
    Option("critical", "flag", "No preemption while this step runs."),
)
"""Modifiers of any step. Nesting: when( ignore_failure( timeout( retry( step))))."""

_KINDS: Final = (
    StepKind(
        "do",
        "action",
        "Send a goal to an agent and run until its result.",
        (_WITH, Option("track", "options", "Follow what `with` reads while it moves.", keys=TRACK), _SAVE, _EXPECT),
    ),
    StepKind(
        "ask",
        "text",
        "Put a question to people; the result is {answer, by, at}.",
        (
            Option("of", "roles", "Whom to ask, in order: roles or site roles.", required=True, like="[ROLE]"),
            Option("options", "words", "The possible answers ([yes, no]; with a form [done])."),
            Option("form", "map", "What else is filled in: names and types; fields of the result.", keys=FORM),
            Option("policy", "word", "Whose answer counts (any).", values=("any", "all"), default="any"),
            Option("escalate_after", "value", "Ask the next one too after this long.", type="duration"),
            Option("clears", "options", "Which answers say that people stand clear of a machine.", keys=CLEARS),
            Option("if_no_answer", "text", "Shown to people: what happens without an answer."),
            _SAVE,
            _EXPECT,
        ),
    ),
    StepKind("call", "name", "Run a subtree in its own scope.", (_WITH, _SAVE)),
    StepKind(
        "request",
        "name",
        "Start another task.",
        (
            _WITH,
            Option("priority", "word", "Of the new task.", values=("low", "medium", "high")),
            Option("wait", "flag", "Wait for its end (true)."),
            Option("detached", "flag", "Let it outlive this task (false)."),
            _SAVE,
        ),
    ),
    StepKind("wait", "value", "Wait this long.", type="duration"),
    StepKind("wait_until", "cond", "Wait until this holds."),
    StepKind(
        "wait_for",
        "name",
        "Wait for an event of an agent: role.event.",
        (Option("since", "word", "Which events count (step).", values=("step", "task"), default="step"), _SAVE),
    ),
    StepKind("check", "cond", "Succeed or fail now.", (Option("message", "text", "Why it failed, for people."),)),
    StepKind("set", "map", "Assign vars."),
    StepKind(
        "notify",
        "text",
        "Notify people; never fails.",
        (
            Option("to", "roles", "Whom to notify (the site's watchers)."),
            Option("severity", "word", "How loud (info).", values=("info", "warning", "alarm"), default="info"),
        ),
    ),
    StepKind(
        "fail",
        "text",
        "Fail with this message.",
        (
            Option("code", "word", "A snake_case word, shown as failed:code."),
            Option("with", "map", "Values that the failure carries, by name; read as error.data."),
        ),
    ),
    StepKind("release", "name", "Give an agent back before the end."),
    StepKind(
        "sequence",
        "steps",
        "Steps one after another.",
        (_REACTIVE, Option("finally", "steps", "Always, when the sequence ends.")),
    ),
    StepKind("fallback", "steps", "The first that succeeds.", (_REACTIVE,)),
    StepKind(
        "parallel",
        "steps",
        "Branches at the same time.",
        (Option("need", "value", "How many must succeed: all, any or a number (all)."), _CHILD_FAILURE),
    ),
    StepKind("race", "steps", "Branches at the same time; the first that ends decides, the others are stopped."),
    StepKind(
        "if",
        "cond",
        "Branch on a condition.",
        (
            Option("then", "steps", "If it holds.", required=True),
            Option("else", "steps", "If it does not."),
        ),
    ),
    StepKind(
        "switch",
        "expr",
        "Branch on a value.",
        (
            Option("cases", "map", "Steps by value.", required=True),
            Option("default", "steps", "If no case fits."),
        ),
    ),
    StepKind("while", "cond", "Repeat as long as this holds.", _ROUNDS),
    StepKind("repeat", "value", "Repeat a number of times, for a duration, or forever.", _ROUNDS),
    StepKind(
        "for",
        "map",
        "Once for each item of a list.",
        (
            _STEPS,
            Option(
                "mode", "word", "One after another, or together (each).", values=("each", "parallel"), default="each"
            ),
            Option("max_parallel", "value", "Most at a time.", type="int"),
            Option("need", "value", "How many must succeed (all)."),
            _CHILD_FAILURE,
            Option("collect", "name", "Gather this saved name of the body as a list."),
            Option("first", "name", "End with the first item that saves this name, and keep it."),
        ),
    ),
    StepKind("break_if", "cond", "Leave the nearest loop with success."),
    StepKind("guard", "cond", "Stop the steps and fail as soon as this is false.", (_STEPS,)),
    StepKind("with_agents", "map", "Extra agents for this block.", (_STEPS,)),
    StepKind(
        "with_resource",
        "words",
        "Resources of the site for this block, taken all at once: lift_1, or [lift_1, dock_bay: 2].",
        (_STEPS, Option("wait", "value", "How long to wait for them (15 min).", type="duration")),
    ),
)

KINDS: Final[Mapping[str, StepKind]] = MappingProxyType({kind.name: kind for kind in _KINDS})
"""Every step kind by its name, in the order of the docs."""

PARAM: Final[tuple[Option, ...]] = (
    Option("type", "name", "The type.", required=True),
    Option("default", "value", "Used when it is not given."),
    Option("optional", "flag", "It may be missing; test is_set() before use."),
    Option("values", "words", "Of an enum: what it may be."),
    Option("of", "words", "Of an agent: its agent types."),
    Option("min", "value", "The smallest value."),
    Option("max", "value", "The largest value."),
    Option("label", "text", "Its name in forms."),
    Option("help", "text", "A line of help in forms."),
    Option("choices", "words", "Values that a form offers."),
    Option("aliases", "words", "Other names under which callers may pass it."),
)

VAR: Final[tuple[Option, ...]] = (
    Option("type", "name", "The type of a var that has no value yet; test is_set() before use.", required=True),
    Option("values", "words", "Of an enum: what it may be."),
)

RECORD_FIELD: Final[tuple[Option, ...]] = (
    Option("type", "name", "The type.", required=True),
    Option("values", "words", "Of an enum: what it may be."),
)

COUNT: Final[tuple[Option, ...]] = (
    Option("min", "value", "The fewest that will do (1).", type="int"),
    Option("max", "value", "The most that are taken, if so many are free.", type="int"),
)

ROLE: Final[tuple[Option, ...]] = (
    Option("type", "name", "The agent type."),
    Option("any_of", "words", "Several agent types that fit."),
    Option("id", "value", "This very agent.", type="agent"),
    Option("near", "value", "The nearest fit one to this place.", type="place"),
    Option("prefer", "value", "This agent, if it is free and fit.", type="agent"),
    Option(
        "count", "value", "How many: a number, all, or {min, max}; the role is then a list.", type="int", keys=COUNT
    ),
    Option("battery_min", "value", "The least charge at the start.", type="percent"),
    Option("capabilities", "words", "What else the agent must be able to do."),
    Option("wait", "value", "How long to queue for it (as long as it takes; of with_agents 15 min).", type="duration"),
    Option(
        "if_lost",
        "word",
        "What a lost agent means (fail).",
        values=("fail", "rebind", "fail_block"),
        default="fail",
    ),
    Option("hand_over_at", "value", "Of with_agents: at this charge another one takes over.", type="percent"),
    Option(
        "preempt",
        "flag",
        "Of a high task: take busy agents too, beyond the fewest that will do (true), or none (false).",
    ),
    Option("away", "flag", "Agents grounded away from a port, or idle in the air, fit too."),
)

SUBTREE: Final[tuple[Option, ...]] = (
    Option("params", "map", "Its parameters."),
    Option("steps", "steps", "Its body.", required=True),
    Option("returns", "value", "What a caller may save."),
)

ENVELOPE: Final[tuple[Option, ...]] = (
    Option("reserve", "value", "Charge that is kept for the way home.", type="percent"),
    Option("max_height", "value", "Over the ground.", type="distance"),
    Option("terrain_clearance", "value", "Least distance from the ground.", type="distance"),
    Option("keep_in", "word", "The region that no machine leaves.", values=("fence",)),
    Option("keep_out", "word", "The regions that no machine enters.", values=("no_fly", "no_go")),
    Option("max_speed", "value", "The greatest speed of who drives.", type="speed"),
    Option("people_clearance", "value", "Least distance from people at take-off and landing.", type="distance"),
    Option("link_silence", "value", "Silence after which the agent acts by itself.", type="duration"),
    Option("wind_max", "value", "The strongest wind.", type="speed"),
    Option("daylight_only", "flag", "No flight between sunset and sunrise."),
)
"""Limits of machines, of a type, a site or a task."""

TASK: Final[tuple[Option, ...]] = (
    Option("formiga", "value", "The language version.", type="int", required=True),
    Option("task", "name", "The task's name, CamelCase.", required=True),
    Option("aliases", "words", "Other names under which callers may request it."),
    Option("version", "text", "The version of this task."),
    Option("description", "text", "What it is for."),
    Option("imports", "words", "Library files."),
    Option("records", "map", "Records of its own: name -> {field: type}; types like any other."),
    Option("priority", "word", "Its class in the queue (medium).", values=("low", "medium", "high")),
    Option("params", "map", "Its parameters."),
    Option("vars", "map", "Named values, computed at admission."),
    Option("agents", "map", "Its roles, granted together before the first step."),
    Option("timeout", "value", "From the moment it is ACTIVE.", type="duration"),
    Option("expires", "value", "The longest time PENDING.", type="duration"),
    Option("if_preempted", "word", "What follows a preemption (restart).", values=("restart", "fail")),
    Option("preemptible", "flag", "Whether it may be preempted (true for low and medium)."),
    Option("envelope", "options", "Limits of machines that are stricter for this task.", keys=ENVELOPE),
    Option("steps", "steps", "What is done.", required=True),
    Option("on_failure", "steps", "After a failed step or the task's timeout."),
    Option("on_abort", "steps", "After an operator's abort or a preemption."),
    Option("finally", "steps", "Always, last."),
    Option("cleanup_timeout", "value", "Bound of the three sections together (5 min).", type="duration"),
    Option("subtrees", "map", "Bodies that steps may call."),
)

LIBRARY: Final[tuple[Option, ...]] = (
    Option("formiga", "value", "The language version.", type="int", required=True),
    Option("imports", "words", "Library files."),
    Option("records", "map", "Records of its own: name -> {field: type}; whoever imports it has them too."),
    Option("subtrees", "map", "The subtrees.", required=True),
)


def names(options: tuple[Option, ...]) -> tuple[str, ...]:
    """Return the keys of a mapping described by `options`."""
    return tuple(option.name for option in options)
