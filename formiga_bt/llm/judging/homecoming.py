"""Who comes home: all of them where a request says so; of two, of which one is sent on to a place, only the other one."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import INTENTS, Words

_ONE: Final = (
    r"\b(?:(?:the |drone |number )?(?:first|one)(?: one| drone| of (?:them|the two))?|drone 1|lead|(?:el )?primer[oa]?|"
    r"uno(?: de ellos)?)\b"
)
_OTHER: Final = (
    r"\b(?:(?:the |drone |number )?(?:other|second|two)(?: one| drone)?|drone 2|wing|one|(?:el )?(?:otro|segundo))\b"
)
_ALL: Final = re.compile(
    r"\b(?:both|all|each|they|everybody|everyone|amb[oa]s|tod[oa]s)\b(?! (?:of them )?(?:land|aterri))"
    r"|\b(?:too|also|likewise|afterwards|later|again|también|luego)\b"
)
_END: Final = re.compile(r"[.;:!?](?!\d)")
_WITH: Final = (
    r"(?:\s+(?:of\s+(?:them|the\s+(?:two|three|drones))|then|later|finally|afterwards|drones|machines|ones?|tres|luego|"
    r"después)){0,3}"
)
_EVERYBODY: Final = re.compile(
    rf"\b(?:both|all(?:\s+(?:two|three|four))?|each|every\s+(?:drone|machine)|everybody|everyone|amb[oa]s|tod[oa]s|"
    rf"l[oa]s\s+(?:dos|tres))\b{_WITH}\s*,?\s+(?:and\s+|y\s+)?$"
)
"""Stands before a way home of all machines."""
_OPEN: Final = re.compile(
    r"\b(?:otherwise|if|else|unless|no|not|never|except|but|save|apart|either|neither|si|salvo|excepto|menos|pero|ni|nunca|"
    r"whoever|whichever|whatever|last|before|until|stays?|remains?|waits?|se\s+queda\w*|espera\w*)\b|n't\b"
)
"""What may leave somebody out."""


def homecoming(words: Words, flight: RehearsedFlight) -> Iterator[Shortfall]:
    """Find machines that come home although the request leaves them where they were sent last.

    Args:
        words: the request.
        flight: its dry run, which succeeded.
    """
    place = stays_at(words)
    homes = [agent for agent, where in flight.stands.items() if where == "home"]
    if place and len(flight.stands) == 2 and len(homes) == 2:
        text = f'the request sends one machine home and the other to "{words.places[place]}", and both come home'
        yield Shortfall("home_unasked", text, about=place)


def all_home(words: Words, flight: RehearsedFlight) -> Iterator[Shortfall]:
    """Find machines that do not come home although a request says that all of them do.

    Args:
        words: the request.
        flight: its dry run, which succeeded.
    """
    away = sorted(agent for agent, where in flight.stands.items() if where != "home")
    if away and len(away) < len(flight.stands) and _sends_all_home(unquoted(words.text).casefold()):
        do = "does" if len(away) == 1 else "do"
        text = f"the request wants all machines home at the end, and {' and '.join(away)} {do} not come home"
        yield Shortfall("not_home", text, about=" ".join(away))


def _sends_all_home(text: str) -> bool:
    if _OPEN.search(text) is not None:
        return False
    ways = re.finditer(INTENTS["home"], text)
    return any(_EVERYBODY.search(text[: one.start()]) for one in ways)


def stays_at(words: Words) -> str:
    """Return where the second of two machines is sent, of which only the first one is sent home; "" = that is not certain.

    `the first one returns to its port, the second one goes on to the lake shore and lands`: lake_shore.
    """
    text = unquoted(words.text).casefold()
    ways = list(re.finditer(INTENTS["home"], text))
    if not ways or any(b.start() - a.end() > len(" to ") for a, b in pairwise(ways)):
        return ""  # `goes home to its port` is one way home
    begin = max((one.end() for one in _END.finditer(text, 0, ways[0].start())), default=0)
    end = next((one.start() for one in _END.finditer(text, ways[-1].end())), len(text))
    before, after = text[begin : ways[0].start()], text[ways[-1].end() : end]
    other = re.search(_OTHER, after)
    if re.search(_ONE, before) is None or other is None or _ALL.search(text[begin:end]) is not None:
        return ""
    after = after[other.end() :]
    found = [
        name for name, said in words.places.items()
        if name != "base" and re.search(rf"(?<!\w){re.escape(said.casefold())}(?!\w)", words.alone(name, after))
    ]  # fmt: skip
    return found[0] if len(found) == 1 else ""
