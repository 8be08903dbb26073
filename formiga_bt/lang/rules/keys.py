"""The keys of a rule, and of a file of rules."""

from typing import Final

from formiga_bt.lang.kinds import Option

RULE: Final = (
    Option("on", "text", "What happens: an event, leaves, enters, crosses, silent (..).", required=True, like="picker.sos"),
    Option("of", "value", "For which agents: any, or a list of their ids (any)."),
    Option("for", "value", "For so long it must be so (0 s).", type="duration", least=0.0, most=86_400.0),
    Option("request", "name", "The task that is requested then.", required=True, like="WatchDogSOS"),
    Option("with", "map", "Its params; they may read `event`."),
    Option("priority", "word", "Instead of the task's own.", values=("low", "medium", "high")),
    Option("at_most", "text", "Its tasks that run at once: `2 running`, `1 running per agent` (1 running per agent)."),
)  # fmt: skip
RULES_FILE: Final = (
    Option("formiga_rules", "value", "Version of the format of rules.", type="int", required=True, like="1"),
    Option("rules", "map", "The rules by name.", required=True),
)
FOLDER: Final = "rules"
"""Beside the site file: each file in it has rules of the site."""
