"""The table of keys: what the keys do, for the program, its help and its documentation."""

from typing import Final

from msgspec import Struct


class Key(Struct, frozen=True):
    """A key, and what it does."""

    key: str
    words: str
    group: str
    guard: str = ""
    """What is asked first."""


TABLE: Final = (
    Key("up down", "choose a row (also k, j; PgUp, PgDn, Home, End)", "look"),
    Key("n", "what needs you; its first row is chosen", "look"),
    Key("t", "the tasks", "look"),
    Key("a", "the agents", "look"),
    Key("v", "the events", "look"),
    Key("Tab", "the next pane (Shift+Tab: the one before)", "look"),
    Key("Enter", "into a task: its tree, values, goals, agents, events; of an agent: its task", "look"),
    Key("Esc", "back", "look"),
    Key("w", "why: what it waits for, who holds it, why it failed", "look"),
    Key("/", "find: tasks whose id, agents or words contain a text; Esc forgets it", "look"),
    Key("o", "ended tasks too, or not", "look"),
    Key("p", "all tasks that wait for agents, or the next few of many", "look"),
    Key("?", "this help", "look"),
    Key("q", "leave; the engine goes on", "look"),
    Key("1 ... 9", "answer a question, hand a machine back, clear one", "order", "where it clears a take-off: y"),
    Key("h", "hold: what flies hovers", "order"),
    Key("r", "return: to the port", "order"),
    Key("l", "land where it is", "order", "y, unless it stands"),
    Key("c", "continue what was stopped", "order", "y"),
    Key("b", "hand a machine back that its pilot gave back", "order", "a number, then y"),
    Key("C", "clear a quarantined machine that you looked at", "order", "y"),
    Key("A", "abort a task", "order", "y"),
    Key("x", "cut: motors off, in the air it falls", "order", "the machine's id, typed"),
    Key("H", "hold ALL", "order"),
    Key("R", "return ALL", "order", "y"),
    Key("L", "land ALL where they are", "order", "y"),
    Key("!", "lockdown: nothing starts, what flies comes home", "order", "! again within 2 s"),
    Key("U", "release the lockdown", "order", "y"),
)


def help_lines(read_only: bool) -> list[str]:
    """Return the help, a line for each key."""
    lines = ["Looking"]
    lines += [f"  {one.key:<8} {one.words}" for one in TABLE if one.group == "look"]
    lines += ["", "Orders, to the chosen row" + (" (off: --read-only)" if read_only else "")]
    for one in TABLE:
        if one.group == "order":
            lines.append(f"  {one.key:<8} {one.words}" + (f"   [asks: {one.guard}]" if one.guard else ""))
    lines += [
        "",
        "The choice follows its row, wherever that goes. When the row is gone, nothing is chosen until you move.",
    ]
    return lines
