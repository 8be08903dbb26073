"""The keys of a test file and of its parts."""

from typing import Final

from formiga_bt.lang.kinds import Option
from formiga_bt.lang.scenario.clock import CLOCK, NOW
from formiga_bt.lang.scenario.options import BATTERY, CHARGES, PARAMS_FROM, PAYLOAD, WALK

FILE: Final = (
    Option("formiga_test", "value", "Version of the format.", type="int", required=True),
    Option("task", "text", "The task's file, beside this one or of the library.", required=True),
    Option("site", "text", "The site's file; without it the demo site."),
    *CLOCK,
    Option("cases", "value", "What is tried.", required=True),
)
CASE: Final = (
    Option("name", "text", "What is tried, in words.", required=True),
    Option("params", "map", "The task's parameters."),
    PARAMS_FROM,
    Option("profile", "text", "A profile whose values hold for parameters that are not given."),
    Option("agents", "map", "What differs from the site, by agent or role: battery, at, absent."),
    Option("answers", "value", "How questions are answered, and what becomes of goals."),
    Option("results", "value", "What simulated agents give, in which goals they fail or begin late; as in a scenario."),
    Option("faults", "value", "What goes wrong, and when; as in a scenario."),
    Option("orders", "value", "What people order, and when; as in a scenario."),
    NOW,
    Option(
        "limit",
        "value",
        "The longest it may go on, in virtual time (12 h).",
        type="duration",
        least=1.0,
        default=12 * 3600.0,
    ),
    Option("abort_at", "value", "When the task is aborted.", type="duration", least=0.0),
    Option("expect", "options", "What must have come.", required=True),
)
AGENT: Final = (
    Option("type", "name", "Of an agent that the site does not list."),
    Option("at", "value", "Where it begins: a port, a place, a point."),
    BATTERY,
    CHARGES,
    PAYLOAD,
    WALK,
    Option("absent", "flag", "It is not there (false)."),
)
ANSWER: Final = (
    Option("ask", "text", "Which question: its number, or a part of its text.", required=True),
    Option("answer", "text", "What is answered."),
    Option("fields", "map", "What is filled in of its form."),
    Option("by", "name", "Who answers, of those who are asked; the others say nothing. Without it: the first of them."),
    Option("never", "flag", "It is never answered (false)."),
    Option("after", "value", "How long it takes (3 s).", type="duration", least=0.0, default=3.0),
)
GOAL: Final = (
    Option("do", "action", "Whose goals: role.Action, or agent.Action.", required=True),
    Option("nth", "value", "Which of these goals of the case; without it each.", type="int", least=1),
    Option("fail", "name", "It fails on the way with this code."),
    Option("reject", "name", "It is refused with this code."),
    Option("result", "map", "It ends well with this result, and nothing else happens."),
    Option(
        "after",
        "value",
        "How long until then (1 s); alone: how late it begins.",
        type="duration",
        least=0.0,
        default=1.0,
    ),
)
DURING: Final = (
    Option("during", "action", "In the course of which goal: role.Action, or agent.Action.", required=True),
    Option("nth", "value", "Of these goals of the case (1).", type="int", least=1, default=1),
)
EXPECT: Final = (
    Option(
        "status", "word", "How it ends (succeeded).", values=("succeeded", "failed", "canceled"), default="succeeded"
    ),
    Option("code", "name", "The reason code of its end."),
    Option("actions", "words", "The goals sent, in order; .. stands for any others."),
    Option("end_state", "map", "How machines are then, by role or agent."),
    Option("max_time", "value", "The longest it may take.", type="duration", least=0.0),
    Option("answers_asked", "value", "How many questions its asks put.", type="int", least=0),
    Option("notices", "value", "A part of the text of each notice, in order."),
    Option("rules", "map", "How many tasks standing rules of the site requested, by rule."),
    Option("crashes", "value", "How many crashes (0).", type="int", least=0),
)
STANDINGS: Final = ("grounded", "airborne", "at_port", "parked_away", "quarantined")
