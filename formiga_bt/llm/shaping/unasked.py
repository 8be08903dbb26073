"""What a small model writes besides what was asked: a zigzag from beside its end, a round before the round.

Both can be seen from the request: it says no side to go to, and names each place of the round once.
"""

import re
from collections.abc import Mapping
from typing import Any, Final

from formiga_bt.base.units import parse_quantity
from formiga_bt.llm.shaping.lifting import bare, split_list
from formiga_bt.llm.shaping.teams import gap_of
from formiga_bt.llm.shaping.walking import INNER, all_steps
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

_SIDE: Final = re.compile(
    r"\b(?:(?:north|south|east|west)\w*|norte|sur|este|oeste|n[oe]r?[od]este|sureste|suroeste|offset|[NSEW])\b",
    re.IGNORECASE,
)
_BESIDE: Final = re.compile(
    r"\b(?:beside|next to|away from|off|aside of|al lado del?|junto al?)\s+(?:the |el |la )?·", re.IGNORECASE
)
_ASIDE: Final = re.compile(r"offset\(\s*([A-Za-z_]\w*)\s*,\s*(?:north|south|east|west)\s*=\s*-?\s*([\d.]+\s*k?m)\s*\)")
_SWING: Final = re.compile(r"\bzigzag\((?:[^()]|\([^()]*\))*?,\s*([\d.]+\s*k?m)\s*,\s*\d+\s*\)")
_RADIUS: Final = re.compile(r"\bcircle\((?:[^()]|\([^()]*\))*?,\s*([\d.]+\s*k?m)\s*(?:,[^()]*)?\)")
_AGAIN: Final = re.compile(
    r"\b(?:again|twice|once more|second (?:time|round|lap)|without (?:a |any )?(?:stop\w*|paus\w*|break)|first\b.*\bthen|laps?|"
    r"times|rounds|repeat\w*|otra vez|de nuevo|dos veces|vueltas|sin parar|primero\b.*\bluego|repit\w+)\b",
    re.IGNORECASE | re.DOTALL,
)
_WHERE: Final = ("to", "at", "way")
Step = Mapping[str, Any]


def left_out(tree: Mapping[str, Any], words: Words, world: RequestWorld, added: list[str]) -> Mapping[str, Any]:
    """Return a tree without what nobody asked for.

    Args:
        tree: in the short form; it is not changed.
        words: the request.
        world: its types tell machines from people.
        added: is told what was put right.
    """
    amounts = _taken(tree, words, world)
    changed: Mapping[str, Any] = _changed(tree, amounts, words, added)
    return changed


def _taken(tree: Mapping[str, Any], words: Words, world: RequestWorld) -> Mapping[float, str]:
    """Return the lengths in metres that are a swing or a radius, and nothing else: the request says each once, and no side."""
    roles = tree.get("agents")
    types = world.catalogue.types
    machines = [
        one for one in (roles if isinstance(roles, list) else ()) if isinstance(one, dict)
        and (type_ := types.get(str(one.get("type")))) is not None and not type_.human
    ]  # fmt: skip
    text = words.text
    for name in sorted({*words.places.values(), *words.agents.values()}, key=len, reverse=True):
        text = text.replace(name, "·")
    if len(machines) != 1 or machines[0].get("count") not in (None, 1) or gap_of(words):
        return {}
    if _SIDE.search(text) or _BESIDE.search(text):
        return {}
    found: dict[float, str] = {}
    for step in all_steps(tree):
        way = str(step.get("way") or "")
        for pattern, what in ((_SWING, "the swing of the zigzag"), (_RADIUS, "the radius of the circle")):
            for match in pattern.finditer(way):
                metres = _metres(match[1])
                said = [one for one in words.amounts if one.type == "distance" and abs(one.si - metres) < 1e-6]
                if len(said) == 1:
                    found[metres] = what
    return found


def _changed(node: Any, amounts: Mapping[float, str], words: Words, added: list[str]) -> Any:
    if not isinstance(node, dict):
        return node
    found = dict(node)
    for key, value in node.items():
        if key in _WHERE and isinstance(value, str) and amounts:
            found[key] = _ASIDE.sub(lambda match: _itself(match, amounts, added), value)
        elif key in INNER and isinstance(value, list):
            found[key] = [_changed(one, amounts, words, added) for one in _once(value, words, added)]
    return found


def _itself(match: re.Match[str], amounts: Mapping[float, str], added: list[str]) -> str:
    """Return a place instead of a spot beside it."""
    what = amounts.get(_metres(match[2]))
    if what is None:
        return match[0]
    told = f"{match[1]} itself and not {match[2]} beside it: {match[2]} is {what}, and the request says no side"
    if told not in added:
        added.append(told)
    return match[1]


def _once(steps: list[Any], words: Words, added: list[str]) -> list[Any]:
    """Return a list of steps without a flight along places that the same machine then visits one by one."""
    found = []
    for index, step in enumerate(steps):
        places = _listed(step)
        visits = _visits(steps[index + 1 :], step.get("agent")) if places and not _AGAIN.search(words.text) else []
        if visits and visits == places and all(one in words.places and len(words.spans(one)) == 1 for one in places):
            added.append(f"{step.get('agent')} flies the round once: the request names each of its places once")
            continue
        found.append(step)
    return found


def _listed(step: Any) -> list[str]:
    way = step.get("way") if isinstance(step, dict) and step.get("do") == "FlyAlong" else None
    text = bare(way) if isinstance(way, str) else ""
    return split_list(text[1:-1]) if text.startswith("[") and text.endswith("]") else []


def _visits(steps: list[Any], agent: Any) -> list[str]:
    """Return the places that a machine visits in the next steps, with a pause at each; [] = there is none somewhere."""
    found: list[str] = []
    pauses = 0
    for step in steps:
        if not isinstance(step, dict) or not (
            "wait" in step or (step.get("do") == "FlyTo" and step.get("agent") == agent)
        ):
            break
        if "wait" in step:
            pauses += 1
        else:
            found.append(str(step.get("to")))
    return found if pauses == len(found) else []


def _metres(text: str) -> float:
    amount = parse_quantity(text)
    return amount[1] if amount is not None else 0.0
