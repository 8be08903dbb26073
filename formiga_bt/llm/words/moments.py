"""Where a machine is, and what a yes leads to, when a request has somebody asked.

    It hovers over the camp; if a watcher agrees, it lands.       over the camp; a landing
    It flies to the camp if a watcher agrees.                     nothing is certain

A sentence can turn its order round (`before`, `once allowed`). What may be turned round is not read.
"""

import re
from typing import Final, Literal

from formiga_bt.base.geo import Place
from formiga_bt.llm.words.question_words import AGREES, ASKED, CASE, DET, clause_of
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

Next = Literal["land", "leave", "go on", ""]
"""What a yes leads to: a landing, a way from where the machine is, a wait that ends; "" = that is not read."""
_CONDITION: Final = re.compile(
    r"\b(?P<only>only\s+|s[oó]lo\s+|solamente\s+)?(?P<word>if|when|once|as soon as|after|until|provided(?: that)?|si|cuando|"
    r"en cuanto|hasta que|después de que)\s+(?:[^,.;:]*?\s)?$",
    CASE,
)
_CONSEQUENT: Final = (
    r"\s*(?:then\s+|entonces\s+)?(?P<who>(?:it|the (?:\w+ )?drone|el dron(?: \w+)?|(?:lwd|hwd)_\d+)\s+)?"
    r"(?:may\s+|can\s+|is to\s+|shall\s+|puede\s+|debe\s+)?(?:then\s+)?"
)
_LAND: Final = r"(?:lands?|(?:goes|go|comes|come|sets|set) down|descends?|touch\w* down|aterri\w+|baja|desciend\w+)\b"
_LEAVE: Final = (
    r"(?:(?:comes?|fl(?:y|ies)|goes?|heads?|gets?) (?:(?:back|straight|right) )?home|(?:comes?|fl(?:y|ies)|goes?|heads?) back|"
    r"returns?|(?:takes?|lifts?) off again|(?:fl(?:y|ies)|goes?|carr(?:y|ies)) on|continues?|home|"
    r"vuelv\w+|regres\w+|despeg\w+ (?:de nuevo|otra vez)|sigu?e\w*|contin\w+)\b"
)
_WAITS: Final = re.compile(
    r"\b(?:waits?|hovers?|stays?|hangs?|holds?|stands?|espera|flota|se queda|permanece)\b[^,.;:]*$", CASE
)
_TURNED: Final = re.compile(
    r"\b(?:before(?:hand)?|prior|previously|in advance|ahead|antes|previamente|de antemano|once allowed|meanwhile|while|"
    r"mientras|permission|permiso|(?:first|primero),?\s+(?:it\s+)?(?:asks?|pregunta)|asks?\s+first|pregunta primero)\b",
    CASE,
)
"""What may turn the order of a sentence round."""
_BEFORE_LEAVING: Final = re.compile(rf"[^.;:]*?\b(?P<b>before|antes de(?: que)?)(?={_CONSEQUENT}{_LEAVE})", CASE)
_PLANNED: Final = re.compile(
    r"\b(?:is to|are to|shall|should|may|can|could|would|wants?|plan\w*|must|ready|about to|deb\w+|pued\w+|quier\w+|tiene que|"
    r"if|when|once|si|cuando|not|never|no|or|o)\b",
    CASE,
)
_ASIDE: Final = re.compile(
    r"\b(?:circ\w+|c[ií]rc\w+|orbit\w*|rings?|zig\w*|laps?|vueltas?|round|around|alrededor|between|entre|near|beside|next|"
    r"from|desde|(?:north|south|east|west) of|al (?:norte|sur|este|oeste)|line|triang\w*|every|each|repeat\w*|cada)\b",
    CASE,
)
_GOES_TO: Final = re.compile(
    r"\b(?:to|over|at|above|onto|on|in|al?|sobre|en|hasta|encima de)\s+(?:the\s+|el\s+|la\s+|los\s+|las\s+)?$", CASE
)
_PART: Final = re.compile(r"[.;:,](?!\d)|\b(?:and|then|y|luego|entonces)\b", CASE)


def moment_of(text: str, start: int, end: int, words: Words, world: RequestWorld) -> tuple[tuple[str, ...], Next]:
    """Return where the machine has been when people are asked, and what a yes leads to; ((), "") = that is not certain."""
    lead = text[:start]
    leaving = _BEFORE_LEAVING.match(text, end)
    rest = text[: leaving.start("b")] + text[leaving.end("b") :] if leaving is not None else text
    if _TURNED.search(rest) is not None:
        return (), ""
    condition = _CONDITION.search(lead[clause_of(text, start) :])
    waited = re.search(rf"\bfor\s+{DET}$", lead, CASE)
    until: int
    then: Next
    if leaving is not None and condition is None:
        until, then = clause_of(text, start), "leave"
        ask = ASKED.search(lead)
        if until == 0 and ask is not None and ask["ask"]:
            until = ask.start()
    elif waited is not None:  # waits there for her yes
        until, then = waited.start(), "go on" if _WAITS.search(lead[: waited.start()]) is not None else ""
    elif condition is not None:
        until, then = _by_condition(text, clause_of(text, start) + condition.start(), end, condition)
    else:
        until, then = _by_asking(text, start, end)
    if not then:
        return (), ""
    places = _reached(text[:until], words, world, to_land=then == "land")
    return (places, then) if places else ((), "")


def _by_condition(text: str, at: int, end: int, condition: re.Match[str]) -> tuple[int, Next]:
    """Return up to where a request says what comes before `if ... agrees`, and what follows a yes.

    Args:
        text: the request.
        at: where `if` begins.
        end: where the people end.
        condition: the match of it.
    """
    lead = text[:at].rstrip()
    word = condition["word"].casefold()
    if word in ("until", "hasta que"):
        return (at, "go on") if _WAITS.search(lead) is not None else (0, "")
    ends = re.search(r"(?P<mark>[.;:,])\s*(?:(?:and|but|then|y|pero|luego)\s*)?$", lead, CASE)
    comma = re.search(r"[,.;:]", text[end:])
    if ends is not None:  # hovers there; if she agrees, it lands
        agrees = AGREES.match(text, end)
        follows = re.compile(rf"{_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", CASE)
        match = follows.match(text, end + comma.end()) if comma is not None else None
        if match is None and agrees is not None:
            match = follows.match(text, agrees.end())
            match = match if match is not None and match["who"] else None
        if match is None or (ends["mark"] == "," and not match["who"]):
            return 0, ""
        return at, "land" if match["land"] else "leave"
    parts = list(_PART.finditer(lead))
    part = parts[-1].end() if parts else 0
    match = re.match(rf"{_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", lead[part:], CASE)
    if match is None:
        return 0, ""
    # lands there and takes off again only when she agrees: with `only` it is what stands beside it
    return (part if condition["only"] else clause_of(text, part)), "land" if match["land"] else "leave"


def _by_asking(text: str, start: int, end: int) -> tuple[int, Next]:
    """Return up to where a request says what comes before `asks her whether`, and what follows a yes."""
    ask = ASKED.search(text[:start])
    passive = re.match(r"[\s),]*(?:there\s+)?(?:is|are)\s+(?:then\s+)?asked\b", text[end:], CASE)
    if passive is None and (ask is None or not ask["ask"]):
        return 0, ""
    began = ask.start() if ask is not None and passive is None else clause_of(text, start)
    lead = text[:began]
    sequence = re.search(
        r"(?P<sure>\b(?:then|there|after that|afterwards|luego|después|allí|entonces)[\s,]+(?:it\s+)?)$"
        r"|[.;:,]\s*(?:it\s+)?$|\b(?:and|y)\s+$",
        lead,
        CASE,
    )
    clause = re.match(r"[^.;:]*", text[end:])
    asked = clause[0] if clause is not None else ""
    after = re.search(rf"(?:[,.;:]|\b(?:then|yes|and)\b){_CONSEQUENT}(?:(?P<land>{_LAND})|{_LEAVE})", text[end:], CASE)
    if sequence is None or after is None:
        return 0, ""
    if not sequence["sure"] and re.search(r"\b(?:may|allowed|can|puede|clear|safe)\b", asked, CASE):
        return 0, ""
    return began, "land" if after["land"] else "leave"


def _reached(text: str, words: Words, world: RequestWorld, *, to_land: bool) -> tuple[str, ...]:
    """Return the places that a machine goes to in this part of a request, in its order; () = not certain.

    Args:
        text: the part.
        words: the whole request, as read.
        world: the site.
        to_land: a landing is what is asked for, so that there was none.
    """
    if _PLANNED.search(text) is not None or _ASIDE.search(text) is not None:
        return ()
    if re.search(r"\b(?:home|base|ports?|casa|puerto|return\w*|vuelve|regres\w+)\b", text, CASE) is not None:
        return ()  # all of the flight is told
    if to_land and re.search(rf"\b{_LAND}", text, CASE) is not None:
        return ()
    found: list[tuple[int, str]] = []
    for name, said in words.places.items():
        at = text.casefold().find(said.casefold())
        if at >= 0 and isinstance(world.site.places.get(name), Place) and _GOES_TO.search(text[:at]) is not None:
            found.append((at, name))
    return tuple(name for _, name in sorted(found))
