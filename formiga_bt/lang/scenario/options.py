"""The keys of a scenario file, of its parts, and of each kind of fault and order."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from formiga_bt.lang.kinds import Option
from formiga_bt.lang.scenario.clock import CLOCK
from formiga_bt.lang.scenario.entries import FaultKind

FASTEST: Final = 20.0
"""People are asked: 60 s of engine time stay at least 3 s of wall time."""

SCENARIO: Final = (
    Option("scenario", "name", "The scenario's name.", required=True),
    Option("site", "value", "The site file.", required=True),
    Option("speed", "value", "Engine seconds per wall second (1).", least=0.1, most=FASTEST, default=1.0),
    Option("seed", "value", "Of the wire's accidents in virtual time (0).", type="int", least=0),
    Option("agents", "value", "The fleet.", required=True),
    Option("tasks", "value", "What is to be done, and when."),
    Option("faults", "value", "What goes wrong, and when."),
    Option("orders", "value", "What people order, and when."),
    Option("results", "value", "What simulated agents give, in which goals they fail or begin late."),
    Option("wind", "options", "Where the wind blows to: east, north (no wind)."),
    *CLOCK,
)
BATTERY: Final = Option("battery", "value", "Its charge (100 %).", type="percent", least=0.0, most=100.0, default=100.0)
CHARGES: Final = Option("charges", "flag", "Whether it charges where there is a charger (true).")
PAYLOAD: Final = Option("payload", "value", "What a drone carries (0 kg).", type="mass", least=0.0)
WALK: Final = Option("walk", "value", "The way this person walks from the beginning: places.")
AGENT: Final = (
    Option("id", "name", "Its id.", required=True),
    Option("type", "name", "Its type; not needed for an agent that the site lists."),
    Option("at", "value", "Where it begins: a port, a place, a point; a drone without it stands at its home."),
    BATTERY,
    CHARGES,
    Option("person", "options", "What a person does: answers, walk."),
    PAYLOAD,
    Option("cut", "flag", "Whether a drone announces what cuts its motors."),
    Option(
        "on_link_loss",
        "word",
        "What a drone does without a link (return).",
        values=("return", "land", "hold"),
        default="return",
    ),
)
FOR_DRONES_ONLY: Final = ("charges", "payload", "cut", "on_link_loss")
PERSON: Final = (
    Option("answers", "value", "The script of answers."),
    WALK,
)
ANSWER: Final = (
    Option("match", "text", "A word of the question or of an option; * fits all.", default="*"),
    Option("options", "words", "The successive answers; the last one again and again."),
    Option("after", "value", "How long it takes (3 s).", type="duration", least=0.0, default=3.0),
    Option("never", "flag", "Such questions stay open."),
    Option("fields", "map", "What is filled in, where the question has a form."),
)
PARAMS_FROM: Final = Option("params_from", "value", "Files with parameters: spots.csv, or {spots: spots.csv}.")
TASK: Final = (
    Option("at", "value", "When it is submitted (0 s).", type="duration", least=0.0),
    Option("task", "name", "Which task.", required=True),
    Option("params", "map", "Its parameters."),
    PARAMS_FROM,
    Option("priority", "word", "Instead of the task's own.", values=("low", "medium", "high")),
    Option("wait", "value", "How long it waits for its agents (as its roles say).", type="duration", least=0.0),
    Option("expires", "value", "The longest time PENDING (as the task says).", type="duration", least=0.0),
)
FAULT: Final = (
    Option("at", "value", "When it begins.", type="duration", required=True, least=0.0),
    Option("agent", "name", "Whom it befalls.", required=True),
    Option("kind", "word", "What goes wrong.", required=True),
)
CHECKS: Final = ("armable", "home", "gnss", "control", "storage", "battery")
WIND: Final = (
    Option("east", "value", "Where it blows to (0 m/s).", type="speed"),
    Option("north", "value", "Where it blows to (0 m/s).", type="speed"),
)
_FOR: Final = Option("for", "value", "How long it lasts; without it, for good.", type="duration", least=0.0)
_COUNT: Final = Option("count", "value", "How many of them (1).", type="int", least=1, default=1)

FAULTS: Final[Mapping[str, tuple[Option, ...]]] = MappingProxyType(
    {
        "kill": (_FOR,),
        "restart": (),
        "freeze": (_FOR,),
        "thaw": (),
        "nan": (_COUNT,),
        "wrong_id": (_COUNT, Option("as", "name", "The id that its statuses carry.")),
        "slow": (_FOR, Option("delay", "value", "How late it speaks.", type="duration", required=True, least=0.0)),
        "refuse": (_COUNT, Option("code", "name", "The reason it gives (not_now).")),
        "take_over": (_FOR,),
        "hand_back": (),
        "lose_result": (_COUNT,),
        "never_confirm": (_FOR,),
        "link_loss": (
            _FOR,
            Option("presence", "word", "Whether its presence goes too (gone).", values=("gone", "stays")),
        ),
        "battery": (
            Option("charge", "value", "Its charge from now on.", type="percent", required=True, least=0.0, most=100.0),
        ),
        "wind": (*WIND,),
        "preflight": (
            _FOR,
            Option("check", "word", "Which check fails.", values=CHECKS, required=True),
            Option("text", "text", "What the drone says of it (broken)."),
        ),
        "event": (
            Option("event", "name", "What it reports of itself: an event of its type.", required=True),
            Option("fields", "map", "The fields of the event."),
        ),
        "drift": (
            _FOR,
            Option("east", "value", "How far its fix is off (0 m).", type="distance", least=-20.0, most=20.0),
            Option("north", "value", "How far its fix is off (0 m).", type="distance", least=-20.0, most=20.0),
        ),
        "unsure": (_FOR,),
    }
)
"""Kinds of faults with the options that each has besides `at`, `agent` and `kind`."""

ENDS: Final[Mapping[str, FaultKind]] = MappingProxyType(
    {"kill": "restart", "freeze": "thaw", "take_over": "hand_back", "slow": "slow",
     "never_confirm": "never_confirm", "link_loss": "link_loss", "preflight": "preflight", "drift": "drift",
     "unsure": "unsure"}
)  # fmt: skip
"""What ends a fault that lasts for a while."""
FOR_DRONES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "take_over": "nobody can take over",
        "hand_back": "nobody can take over",
        "battery": "no charge to change",
        "wind": "a drone flies in it",
        "preflight": "no checks before a flight",
        "drift": "a drone has a fix",
        "unsure": "a drone stands or flies",
    }
)
"""Faults that befall no person, and why."""

BY: Final = Option("by", "name", "Who orders it (operator).")
_AT: Final = Option("at", "value", "When.", type="duration", required=True, least=0.0)
_TARGET: Final = Option("target", "name", "An agent, a task, or all.", required=True)
ORDER: Final = (
    _AT,
    Option("order", "word", "What is ordered.", required=True),
    _TARGET,
    BY,
)
HANDBACK: Final = Option(
    "how", "word", "What it does then (continue).", values=("continue", "return", "end"), default="continue"
)
LOCKDOWN: Final = (
    _AT,
    Option("lockdown", "word", "What flies does so, or: release.", values=("return", "hold", "land", "release")),
    BY,
)
ABORT: Final = (
    _AT,
    Option("abort", "name", "Which task."),
    Option("how", "word", "How it ends; without: in order.", values=("now", "abandon")),
    BY,
)
ORDERS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "hold": ("agent", "task", "all"),
        "return": ("agent", "task", "all"),
        "land": ("agent", "task", "all"),
        "cut": ("agent",),
        "continue": ("agent", "task", "all"),
        "restart": ("task",),
        "handback": ("agent",),
        "clear": ("agent",),
        "removed": ("agent",),
    }
)
"""What each order may be given for."""
