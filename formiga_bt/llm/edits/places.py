"""Edits for places: a machine lands where it was only flown to, goes on to one that was left out, comes home at the end."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.edits.steps import (
    EditCase,
    Edited,
    Found,
    Machine,
    Step,
    after,
    at_end,
    is_so,
    next_to,
    put,
    steps_of,
)
from formiga_bt.llm.edits.who import Subject, homes, who
from formiga_bt.llm.shaping.moves import HEIGHT
from formiga_bt.llm.words.amounts import Amount

_LANDS: Final = r"\b(?:lands?|landing|aterri\w+)\b"
_AT: Final = (
    r"(?:\s+(?:down|together|both|juntos))?\s+(?:at|in|on|by|near|beside|en|sobre|junto a)\s+(?:(?:the|el|la)\s+)?"
)
_AND_LANDS: Final = re.compile(rf"(?:[\s,]|\b(?:and|then|to|y|luego|para)\b)*{_LANDS}", re.IGNORECASE)
_STAYS: Final = re.compile(
    r"\b(?:hovers?|hovering|stays?|staying|waits?|waiting|remains?|looks?|films?|watch\w*|espera\w*|permanec\w+|"
    r"se queda\w*|mira\w*|observ\w+|filma\w*|graba\w*)\b"
)
_GOES: Final = (
    r"\b(?:then|luego|despu[eé]s|go|goes|going|continues?|proceeds?|moves?|flies|fly|heads?|advances?|carry|carries|va|van|vuelan?|"
    r"contin[uú]an?|prosiguen?|proceden?|pasan?|siguen?|avanzan?|se dirigen?)"
    r"(?:,?\s+(?:then|on|onwards?|further|now|directly|straight|luego|despu[eé]s|ahora))*"
    r"\s+(?:to|towards?|al?|hacia|hasta)\s+(?:the\s+|el\s+|la\s+|l[ao]s\s+)?"
)
_DOUBT: Final = re.compile(
    r"\b(?:not|never|no|n't|without|if|unless|otherwise|else|whether|may|might|could|sin|nunca|si no|si|salvo|quiz[aá]s?)\b"
    r"|n't\b"
)
"""What makes a way that is spoken of no order, or one that depends on something."""
_REFUSED: Final = re.compile(r"\b(?:not|never|no|without|unless|otherwise|sin|nunca|salvo)\b|n't\b")
_NOTHING_MORE: Final = re.compile(
    r"(?:[\s,.;:()]|\b(?:and|then|y|e|luego|finally|lastly|afterwards|after|that|this|before|while|mientras|whereas|"
    r"lands?|to|landing|aterri\w+|there|all[ií]|ah[ií]|the|a|an|one|first|second|third|other|another|drones?|dron|uavs?|"
    r"light|heavy|lwds?|hwds?|ligeros?|pesados?|both|all|they|each|it|its|their|own|home|ports?|base|station|back|"
    r"comes?|coming|returns?|returning|go|goes|flies|fly|at|in|on|of|el|la|los|las|su|sus|primero|segundo|otro|ambos|todos|"
    r"finalmente|despu[eé]s|vuelven?|regresan?|retornan?|casa|puertos?|estaci[oó]n|a|al|en|de|desde)\b)*",
    re.IGNORECASE,
)
"""Words of a landing and a way home, behind the last place that a machine goes to."""


def landed(case: EditCase) -> Iterator[Edited]:
    """A machine that flies to a place and should land there lands there."""
    place, text = case.wrong.about, case.words.text.casefold()
    flights = [one for one in steps_of(case.tree) if one[1].get("do") == "FlyTo" and _is_at(one[1].get("to"), place)]
    agents = [str(step.get("agent")) for _, step in flights]
    verb = _landing_verb(case, place)
    if not flights or len(set(agents)) < len(agents) or verb is None or "FlyAndLand" not in case.verbs:
        return
    subject = who(case, verb)
    names = _who_of(subject, set(agents))
    tree, lands = case.tree, [one for one in flights if one[1].get("agent") in names]
    if len(case.words.spans(place)) > 1 and not all(_is_last(case, one) for one in lands):
        return  # it is spoken of twice: which time it lands there is not certain
    is_later = _STAYS.search(text[:verb]) is not None
    for path, step in reversed(lands):
        made = _with_landing(case, tree, (path, step), is_later=is_later)
        if made is None:
            return
        tree = made
    if lands:
        told = " and ".join(str(step["agent"]) for _, step in lands)
        are_many = len(lands) > 1 or any(one.count > 1 for one in case.machines if one.name in names)
        yield tree, f"{told} {'land' if are_many else 'lands'} at {place}, as the request says"


def _with_landing(
    case: EditCase, tree: Mapping[str, Any], flight: Found, *, is_later: bool
) -> Mapping[str, Any] | None:
    """Return a tree with a landing in place of a flight, or behind it, if its height or a stay was asked for."""
    path, step = flight
    land = {"do": "FlyAndLand", "agent": step["agent"], "at": step["to"]}
    follows = next_to(tree, path)
    waits = follows is not None and "wait" in follows
    if is_later and waits:
        return after(tree, (*path[:-1], int(path[-1]) + 1), land)
    if is_later and any("wait" in one for _, one in steps_of(tree)):
        return None  # a pause of another list
    is_said = any(one.type == "distance" and is_so(step.get("height"), one) for one in case.words.amounts)
    return after(tree, path, land) if is_said or is_later else put(tree, path, [land])


def gone_on(case: EditCase) -> Iterator[Edited]:
    """The one machine that is said to go on to a place that no step names goes there, before its way home or instead."""
    place = case.wrong.about
    said, text = case.words.places.get(place, place), case.words.text
    ways = [*re.finditer(rf"(?:{_GOES}|({_LANDS}){_AT}){re.escape(said)}(?!\w)", text, re.IGNORECASE)]
    if len(ways) != 1 or not case.is_plain or _is_named(case, place):
        return
    way, tail = ways[0], text[ways[0].end() :]
    amount = next((one for one in case.words.amounts if one.type == "distance" and one.words in tail), None)
    plain = re.sub(rf"\b(?:at|from|a)\s+{re.escape(amount.words)}", " ", tail) if amount is not None else tail
    begins = max(text.rfind(mark, 0, way.start()) for mark in (". ", "; "))
    if _NOTHING_MORE.fullmatch(plain) is None or _DOUBT.search(text[begins + 1 : way.end()].casefold()):
        return
    machine = _goes_on(case, way.start())
    if machine is None:
        return
    lands = way[1] is not None or _AND_LANDS.match(tail) is not None
    comes_home = _comes_home(case, machine, way.end())
    if comes_home is None or ("FlyAndLand" if lands else "FlyTo") not in case.verbs:
        return
    go = {"do": "FlyAndLand", "agent": machine.name, "at": place} if lands else _flight(case, machine, place, amount)
    own = case.of(machine.name)
    ways_home = [one for one in own if one[1].get("do") == "ReturnHome"]
    told = f"{machine.name} goes on to {place}{' and lands there' if lands else ''}, as the request says"
    if not ways_home:
        yield at_end(case.tree, go, *([_home(machine.name)] if comes_home else [])), told
    elif len(ways_home) == 1 and own[-1] is ways_home[0] and not _asks_after(case, ways_home[0]):
        path, step = ways_home[0]
        yield put(case.tree, path, [go, step] if comes_home or not lands else [go]), told


def _is_last(case: EditCase, flight: Found) -> bool:
    """Return whether a machine goes nowhere after a flight, but home."""
    own = [path for path, step in case.of(str(flight[1].get("agent"))) if step.get("do") != "ReturnHome"]
    return own[-1] == flight[0]


def _asks_after(case: EditCase, found: Found) -> bool:
    """Return whether somebody is asked after a step: who goes on in its stead would not wait for the answer."""
    order = list(steps_of(case.tree))
    return any("ask" in step for _, step in order[order.index(found) :])


def _is_named(case: EditCase, place: str) -> bool:
    name = re.compile(rf"\b{re.escape(place)}\b")
    return any(name.search(str(value)) for _, step in steps_of(case.tree) for value in step.values())


def _goes_on(case: EditCase, verb: int) -> Machine | None:
    """Return the machine that goes on; None = it is not certain."""
    machines, subject = case.machines, who(case, verb)
    if subject is None or not subject.names:
        return None
    meant = [one for one in machines if one.name in subject.names]
    if len(machines) == 1:
        return meant[0] if meant[0].count == 1 or subject.is_all else None
    at_home = {one.name for one in machines if any(s.get("do") == "ReturnHome" for _, s in case.of(one.name))}
    idle = [one for one in machines if one.name not in at_home and case.of(one.name)]
    alike = len({(one.type, one.count) for one in machines}) == 1
    if 0 < len(idle) < len(machines):
        one = idle[0]
        return one if len(idle) == 1 and one in meant and (len(meant) == 1 or (alike and not subject.is_all)) else None
    return meant[0] if len(meant) == 1 else None


def _comes_home(case: EditCase, machine: Machine, since: int) -> bool | None:
    """Return whether a machine is sent home after it went on; None = it is not certain."""
    found = False
    for begin, _ in homes(case):
        subject = who(case, begin, since if begin >= since else 0)
        if subject is None and begin < since:
            return None
        if subject is None or subject.names == {machine.name} or (subject.is_all and machine.name in subject.names):
            found = True
        elif begin >= since and machine.name in subject.names:
            return None
    return found


def _flight(case: EditCase, machine: Machine, place: str, amount: Amount | None) -> Step:
    own = [step for _, step in case.of(machine.name) if step.get("height")]
    every = own or [step for _, step in steps_of(case.tree) if step.get("height")]
    height = every[-1]["height"] if every else HEIGHT
    return {"do": "FlyTo", "agent": machine.name, "to": place, "height": f"{amount.si:g} m" if amount else height}


def sent_home(case: EditCase) -> Iterator[Edited]:
    """The machine that is to come home comes home at the end."""
    spans = list(homes(case))
    if not spans or not case.is_plain or "ReturnHome" not in case.verbs:
        return
    meant: set[str] = set()
    for begin, _ in spans:
        subject = who(case, begin)
        sentence = case.words.text[:begin].casefold().rsplit(". ", 1)[-1]
        if subject is None or (len(subject.names) > 1 and not subject.is_all) or _REFUSED.search(sentence):
            return
        meant |= subject.names
    tree, names = case.tree, []
    for machine in (one for one in case.machines if one.name in meant):
        own = case.of(machine.name)
        if not own or own[-1][1].get("do") == "ReturnHome":
            continue
        names.append(machine.name)
        path, step = own[-1]
        if step.get("at", step.get("to")) == "base":
            tree = put(tree, path, [_home(machine.name)])
        else:
            tree = at_end(tree, _home(machine.name))
    if names:
        yield tree, f"{' and '.join(names)} {'come' if len(names) > 1 else 'comes'} home, as the request says"


def _home(agent: str) -> Step:
    return {"do": "ReturnHome", "agent": agent}


def _who_of(subject: Subject | None, agents: set[str]) -> set[str]:
    """Return those of some machines that are certainly spoken of."""
    if subject is None:
        return set()
    meant = set(subject.names & agents)
    if subject.is_all:
        return meant if subject.names <= agents else set()
    return meant if len(subject.names) == 1 or len(agents) == 1 else set()


def _landing_verb(case: EditCase, place: str) -> int | None:
    """Return where a request says that a machine lands at a place: the word that is next to it."""
    text, said = case.words.text.casefold(), case.words.places.get(place, place).casefold()
    there = rf"{re.escape(said)}(?!\w)"
    found = re.search(rf"{_LANDS}{_AT}{there}|{there}([^.;]*?)({_LANDS})", text)
    if found is None or any(one.casefold() in (found[1] or "") for one in case.words.places.values()):
        return None
    return found.start(2) if found[2] else found.start()


def _is_at(value: Any, place: str) -> bool:
    """Return whether a value is a place or one beside it."""
    beside = rf"\s*(?:offset\(\s*)?{re.escape(place)}\s*(?:,.*\))?\s*"
    return isinstance(value, str) and re.fullmatch(beside, value) is not None
