"""Rings and other ways of the short form that a model writes as something else, and round whom they are.

A ring has as many points as make it round; a machine flies along a way from point to point, not up and down at each of them;
a ring round a machine is round where that machine is sent. What is put right is told.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.shaping.teams import is_list
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.wording import Words

LEAST_POINTS: Final = 12
"""Fewer make a polygon rather than a ring."""
_POINTS: Final = re.compile(r"(circle\((?:[^()]|\([^()]*\))*?),\s*(?:points\s*=\s*)?(\d{1,2})\s*\)")
_WAY: Final = re.compile(r"\s*(circle|zigzag)\(", re.IGNORECASE)
_WANTED: Final[Mapping[str, str]] = {
    "circle": r"\b(?:circ\w+|orbit\w*|rings?|round|around|laps?|c[ií]rculos?|anillos?|vueltas?|rode\w+|alrededor)\b",
    "zigzag": r"\b(?:zig-?zag\w*|slalom\w*|serpentin\w*|weav\w+|saw)",
}
_WHERE_KEYS: Final = ("to", "at")
_OF: Final = re.compile(r"^(?:the_)?(?:cent(?:er|re)|middle|position|place|spot|location)_(?:of_)?(?:the_)?")
_AS: Final = re.compile(r"_(?:drone|machine|agent|lwd|hwd|one|position|place|spot|location|cent(?:er|re))$")
Step = Mapping[str, Any]


def round_(text: str, words: Words) -> str:
    """Return a value without the number of points of a ring, if they are few and the request does not say so many."""

    def turned(match: re.Match[str]) -> str:
        few = int(match[2]) < LEAST_POINTS and not words.number(float(match[2]))
        return f"{match[1]})" if few else match[0]

    return _POINTS.sub(turned, text)


def along_ways(tree: Step, words: Words, verbs: Mapping[str, AgentVerb], height: str, added: list[str]) -> Step:
    """Return a tree in which a machine flies along a ring or a zigzag that it was told to land on, or to hover over.

    Args:
        tree: in the short form; it is not changed.
        words: the request.
        verbs: the vocabulary.
        height: where none is given.
        added: is told what was put right.
    """
    if "FlyAlong" not in verbs or "FlyAndLand" not in verbs:
        return tree
    teams = {
        str(one.get("name")) for one in tree.get("agents") or () if isinstance(one, dict) and one.get("count", 1) != 1
    }
    flown = {(str(one.get("agent")), str(one.get(key))) for one in _all(tree) for key in ("way", "to") if one.get(key)}

    def mended(step: Any) -> Any:
        if not isinstance(step, dict):
            return step
        at, agent = str(step.get("at", "")), str(step.get("agent"))
        figure = _WAY.match(at)
        lands_on_it = step.get("do") in ("FlyAndLand", "LandIn") and agent not in teams and (agent, at) not in flown
        if figure and lands_on_it and re.search(_WANTED[figure[1].casefold()], words.text, re.IGNORECASE):
            added.append(f"{agent} flies along {at} at {height} and lands where it ends: nobody lands on all of it")
            along = {"do": "FlyAlong", "agent": agent, "way": at, "height": height}
            return {"sequence": [along, {**step, "at": f"last({at})"}]}
        way = _as_way(step)
        if way is not None and str(way["agent"]) not in teams:
            added.append(f"{way['agent']} flies along {way['way']}, not up and down at each of its points")
            return way
        return {
            key: [mended(one) for one in value] if isinstance(value, list) else value for key, value in step.items()
        }

    found: Step = mended(tree)
    return found


def _as_way(step: Step) -> Step | None:
    """Return the flight along a ring or a zigzag that a loop over its points means."""
    name, way, steps = step.get("for"), step.get("in"), step.get("steps")
    if (
        not isinstance(way, str)
        or _WAY.match(way) is None
        or step.get("mode") == "parallel"
        or not isinstance(steps, list)
    ):
        return None
    one = steps[0] if len(steps) == 1 and isinstance(steps[0], dict) else {}
    if one.get("do") not in ("FlyTo", "GoTo") or one.get("to") != name or not isinstance(one.get("height"), str):
        return None
    return {"do": "FlyAlong", "agent": one.get("agent"), "way": way, "height": one["height"]}


def goals(tree: Step) -> dict[str, str]:
    """Return by machine the one place that it is sent to in a tree; who goes to several, or to none, is missing."""
    agents = {str(one.get("name")) for one in tree.get("agents") or () if isinstance(one, dict)}
    found: dict[str, set[str]] = {}
    for step in _all(tree):
        for key in _WHERE_KEYS:
            text = step.get(key)
            if "do" in step and isinstance(text, str) and not is_list(text) and not agents & {*_names(text)}:
                found.setdefault(str(step.get("agent")), set()).add(text.strip())
    return {agent: places.pop() for agent, places in found.items() if len(places) == 1}


def landings(tree: Step) -> dict[str, frozenset[str]]:
    """Return by machine where it lands, unless that depends on something."""
    steps = list(_all(tree))
    if any("if" in one for one in steps):
        return {}
    lands = [one for one in steps if one.get("do") in ("FlyAndLand", "LandIn") and isinstance(one.get("at"), str)]
    agents = {str(one.get("agent")) for one in lands}
    return {
        agent: frozenset(str(one["at"]).strip() for one in lands if str(one.get("agent")) == agent) for agent in agents
    }


def meant(name: str, roles: Mapping[str, str], but: str) -> str:
    """Return the role that a name means which is none: `center_of_second`, `first_drone`; "" = it may be several, or none.

    Args:
        name: as a model wrote it.
        roles: what each role is called in the task.
        but: the role that is not meant: who does the step.
    """
    found = {called for role, called in roles.items() if called != but and _bare(role) == _bare(name)}
    return found.pop() if len(found) == 1 else ""


def _bare(name: str) -> str:
    return _AS.sub("", _AS.sub("", _OF.sub("", name.casefold())))


def _names(text: str) -> list[str]:
    return re.findall(r"[A-Za-z_]\w*", text)


def _all(node: Any) -> Iterator[Step]:
    if isinstance(node, dict):
        yield node
    for one in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _all(one)
