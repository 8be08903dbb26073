"""Words of other tools, and small slips, with the word of this language that was meant.

Every synonym is an error whose fix is mechanical; none is silently accepted. The loader asks here before it
says "unknown".
"""

import difflib
import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final

KIND_SYNONYMS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "selector": "fallback",
        "select": "fallback",
        "try": "fallback",
        "action": "do",
        "run": "do",
        "execute": "do",
        "sleep": "wait",
        "delay": "wait",
        "loop": "repeat",
        "forEach": "for",
        "foreach": "for",
        "for_each": "for",
        "each": "for",
        "map": "for",
        "do_while": "repeat",
        "repeat_until": "repeat",
        "until": "repeat",
        "forever": "repeat",
        "times": "repeat",
        "break": "break_if",
        "leave": "break_if",
        "exit_if": "break_if",
        "stop_if": "break_if",
        "any_of_these": "race",
        "first_of": "race",
        "concurrent": "parallel",
        "concurrently": "parallel",
        "simultaneously": "parallel",
        "together": "parallel",
        "par": "parallel",
        "monitor": "guard",
        "watch": "guard",
        "invariant": "guard",
        "wait_while": "wait_until",
        "waitUntil": "wait_until",
        "wait_for_condition": "wait_until",
        "free": "release",
        "unassign": "release",
        "give_back": "release",
        "confirm": "ask",
        "prompt": "ask",
        "wait_for_confirmation": "ask",
        "subtree": "call",
        "include": "call",
        "condition": "check",
        "assert": "check",
        "log": "notify",
    }
)
"""Step kinds of other languages."""

KEY_SYNONYMS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "goal": "with",
        "args": "with",
        "arguments": "with",
        "params": "with",
        "parameters": "with",
        "inputs": "with",
        "children": "steps",
        "tasks": "steps",
        "on_error": "on_failure",
        "catch": "on_failure",
        "roles": "agents",
        "parameters_": "params",
        "inputs_": "params",
        "if_": "when",
        "body": "steps",
        "interval": "every",
        "period": "every",
        "rate": "every",
        "hz": "every",
        "frequency": "every",
        "max_rounds": "max",
        "max_iterations": "max",
        "max_repeats": "max",
        "limit": "max",
        "concurrency": "max_parallel",
        "at_once": "max_parallel",
        "success_threshold": "need",
        "success_count": "need",
        "required": "need",
        "ensure": "finally",
        "always": "finally",
        "retries": "retry",
        "answers": "options",
        "choices": "options",
        "to": "of",
        "whom": "of",
        "output": "save_as",
        "register": "save_as",
    }
)
"""Options of other languages."""

_HANDLER: Final = (
    "a handler is a branch of a race: repeat: forever, with wait_for: role.event and since: task, then what is done"
)

ADVICE: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(("on", "on_event", "handler", "handlers"), _HANDLER),
        "else_if": "write else: with another `if` step in it",
        "elif": "write else: with another `if` step in it",
        "in": "the lists stand under for: itself, as in for: {drone: ${drones}}",
        "continue": "there is no continue: put the rest of the round under if:, or give its steps when:",
        "until": "repeat: forever with until: (after a round) or break_if: (within it)",
        "wait_while": "wait_until: not ...",
        "memory": "a sequence remembers where it was; reactive: true re-checks its checks",
        "on_breach": "what follows a breach is the site's word (site.yaml) or the agent type's (catalogue)",
        "within": "timeout: bounds a step or a task; expect: {max_time: 20 min} what a case of a test takes",
        "loop": "repeat: N for a number of rounds, for: for a list, while: for a condition",
    }
)
"""Help for the words whose mend is more than one word."""


BY_HAND: Final = frozenset({"wait_while", "until", "do_while", "repeat_until", "retries", "forever"})
"""Synonyms whose mend is more than another word in their place: they are named, and no fix is offered for the word alone."""

_DIGITS: Final = re.compile(r"\d+")
_CLEARLY: Final = 0.1
"""So much more alike than any other name must a name be."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the known name most like `word`, or "" when none is near."""
    names = list(known)
    folded = _fold(word)
    for name in names:
        if _fold(name) == folded:
            return name
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.7)
    return close[0] if close else ""


def surely(word: str, known: Iterable[str]) -> str:
    """Return the known name that alone can have been meant by `word`, or "": what a program may write by itself."""
    names = list(known)
    meant = nearest(word, names)
    return meant if meant and is_sure(word, meant, names) else ""


def is_sure(word: str, meant: str, known: Iterable[str]) -> bool:
    """Return whether no other known name is about as near to `word` as `meant`, and no number differs."""
    if _fold(word) == _fold(meant):
        return True
    if _DIGITS.findall(word) != _DIGITS.findall(meant):
        return False
    best = difflib.SequenceMatcher(None, meant, word).ratio()
    others = [difflib.SequenceMatcher(None, name, word).ratio() for name in known if name != meant]
    return max(others, default=0.0) < max(0.6, best - _CLEARLY)


def kind_for(word: str, known: Iterable[str]) -> str:
    """Return the step kind meant by an unknown word, or ""."""
    return KIND_SYNONYMS.get(word) or nearest(word, known)


def key_for(word: str, known: Iterable[str]) -> str:
    """Return the option meant by an unknown key among the `known` ones, or ""."""
    names = list(known)
    meant = KEY_SYNONYMS.get(word, "")
    return meant if meant in names else nearest(word, names)


def action_for(word: str, actions: Mapping[str, str]) -> str:
    """Return the action meant by a slip such as `Takeoff`, `take_off`, `Land` or `goto`, or "".

    Args:
        word: what was written.
        actions: the effect (or any mark of meaning) by name of each action that the agent has.
    """
    folded = _fold(word)
    same = [name for name in actions if _fold(name) == folded]
    if same:
        return same[0]
    meanings = {"land": "grounded", "landing": "grounded", "launch": "airborne", "liftoff": "airborne"}
    moves = {
        "moveto": "moves",
        "flyto": "moves",
        "move": "moves",
        "fly": "moves",
        "navigate": "moves",
        "gotopose": "moves",
    }
    want = meanings.get(folded) or moves.get(folded)
    if want is not None:
        fit = [name for name, meaning in actions.items() if meaning == want]
        return fit[0] if len(fit) == 1 else ""
    return nearest(word, actions)


def _fold(word: str) -> str:
    return word.replace("_", "").replace("-", "").lower()
