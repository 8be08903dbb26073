"""Requests that want a question put to somebody, and nothing else: `just ask picker_2 whether the gate is shut`.

A small model takes such a request for one that it is to answer itself, and asks back. The task is one step for each person, so
that it can be written without a model.
"""

import re
from dataclasses import dataclass
from typing import Any, Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.questions import Person, in_one_line, questions
from formiga_bt.llm.words.wording import DRONES, Words, types_said
from formiga_bt.llm.world import RequestWorld

_I: Final = re.IGNORECASE
_FLY: Final = (
    r"(?:fl(?:y|ies|own|ying)|flights?|takes? off|moves?|starts?|lands?|hovers?|circles?|comes?|returns?|sends?|goes|go|"
    r"brings?|vuel[aeo]\w*|volar|despeg\w+|mueve\w*|aterri\w+|regres\w+|env[ií]\w+)\b"
)
_NO_FLIGHT: Final = re.compile(
    r"(?:^|[.;,:]|(?<=·)|\b(?:and|but|y|pero)\b)\s*(?:(?:and|but|y|pero)\s+)?(?:"
    rf"(?:no|not|nobody|nothing|none|ning[uú]n|nadie|nada)\b(?:\s+\w+){{0,3}}?\s+{_FLY}[^.;]*"
    r"|no flights?\b[^.;]*|(?:do |haz |hacer )?(?:nothing|nada|no) (?:else|more|m[aá]s)\b[^.;]*"
    r"|(?:that|eso)(?:'s| is| es) (?:all|todo)\b"
    r"|(?:without|sin) (?:(?:any|a|ning[uú]n) )?(?:flights?|flying|drones?|volar|vuelos?)\b)",
    _I,
)
"""What says that no machine is to do anything."""
_LEAD: Final = re.compile(
    r"\W*(?:(?:please|just|only|simply|i only want to|por favor|s[oó]lo|solamente|simplemente|únicamente)[\s,:]+)*"
    r"(?:ask|question|preg[uú]nta(?:r|d)?(?:le|les)?|consulta(?:r)?|(?:put|pose) (?:the|a|this) question|"
    r"ha(?:z|ga)(?:le)? una pregunta)\s+(?:to\s+)?(?:both\s+)?(?:(?:the|an?|al?|el|la|un|una|los|las)\s+)*",
    _I,
)
_ASKED: Final = re.compile(
    r"[\s,:)]*(?P<clause>(?P<if>whether|if|si)\s.+|(?:how|what|when|where|which|who|why|qué|cómo|cuándo|dónde|cuál|quién)\b.+)",
    _I,
)
_MORE: Final = re.compile(
    r"[.;](?!\d)|\b(?:then|after that|afterwards|luego|después|entonces|otherwise|unless|once|until|when|cuando|hasta)\b"
    r"|\b(?:and|y)\s+(?:tell|notify|inform|report|wait|di|dile|avisa|informa|espera)\b",
    _I,
)
_INVERTED: Final = re.compile(
    r"(?P<who>everything|everybody|everyone|it|they|he|she|all|(?:the|an?|his|her|their) (?:\w+ )??\w+)\s+"
    r"(?P<verb>is|are|was|were|can|has|have|will|may|must|should)\s+(?P<rest>.+)",
    _I,
)
_DOES: Final = re.compile(r"(?:they|he|she)\s+(?P<verb>need|see|want|hear|know|feel|like)s?\s+(?P<rest>.+)", _I)


@dataclass(frozen=True, slots=True)
class OnlyQuestion:
    """What is asked, and whom."""

    people: tuple[Person, ...]
    text: str


def only_question(words: Words, world: RequestWorld) -> OnlyQuestion | None:
    """Return the question of a request that wants nothing but it; None = it wants more, or that is not certain.

    Args:
        words: the request, as read.
        world: its people and machines.
    """
    found = questions(words, world)
    plain = in_one_line(words)
    text = unquoted(plain)
    if len(found) != 1 or _LEAD.fullmatch(text[: found[0].start]) is None:
        return None
    question = found[0]
    rest = _NO_FLIGHT.sub(lambda match: " " * len(match[0]), text[question.end :])
    is_still = rest != text[question.end :]
    said = rest.rstrip(" .!?,;")
    quoted = re.fullmatch(r"[\s,:)]*·+", said)
    asked = _ASKED.fullmatch(said)
    if quoted is not None:
        return OnlyQuestion(question.people, plain[question.end :].lstrip(" ,:)")[1 : said.count("·") - 1].strip())
    if (
        asked is None
        or _MORE.search(asked["clause"]) is not None
        or (not is_still and _has_machines(said, words, world))
    ):
        return None
    return OnlyQuestion(question.people, _as_question(asked["clause"], asked["if"] or "", question.people))


def tree_of(asked: OnlyQuestion) -> dict[str, Any]:
    """Return the task of a question, in the short form."""
    people = [
        {"name": one.id or one.type, "type": one.type, **({"id": one.id} if one.id else {})} for one in asked.people
    ]
    steps = [{"ask": asked.text, "of": [one["name"]]} for one in people]
    return {"task": "AskOnly", "agents": people, "steps": steps}


def _has_machines(said: str, words: Words, world: RequestWorld) -> bool:
    types = world.catalogue.types
    named = any(not types[world.site.agents[one].type].human for one in words.agents)
    typed = any(not types[one].human for one in types_said(words, world.catalogue))
    return named or typed or re.search(rf"\b(?:{'|'.join(DRONES)})\b|\b{_FLY}", said, _I) is not None


def _as_question(clause: str, word: str, people: tuple[Person, ...]) -> str:
    """Return a clause as one asks it: `whether everything is all right` as `Is everything all right?`."""
    plain = clause[len(word) :].strip() if word else clause
    turned = _INVERTED.fullmatch(plain) if word and word.casefold() != "si" else None
    if turned is not None:
        who, verb = turned["who"], turned["verb"].casefold()
        if who.casefold() in ("they", "he", "she") and len(people) == 1:
            who, verb = "you", {"is": "are", "was": "were", "has": "have"}.get(verb, verb)
        plain = f"{verb} {who[:1].lower()}{who[1:]} {turned['rest']}"
    does = _DOES.fullmatch(plain) if word and len(people) == 1 else None
    if does is not None:
        plain = f"do you {does['verb'].lower()} {does['rest']}"
    is_spanish = word.casefold() == "si" or re.match(r"(?:qué|cómo|cuándo|dónde|cuál|quién)\b", plain, _I) is not None
    return f"{'¿' if is_spanish else ''}{plain[:1].upper()}{plain[1:]}?"
