"""Steps of the short form that a program puts as the language has them, before they are expanded.

Small models spell out `flies to its port and lands` as a flight to a place called `port`, and forget the way back to the
middle of a ring that they have flown. Both can be meant in one way only. What is put right is told.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.moves import HEIGHT
from formiga_bt.llm.vocabulary import Verb

_PORT: Final = re.compile(r"(?:(?:its|the|their|his|her|own|home|landing)[ _]*)*port|(?:its[ _]*)?home", re.IGNORECASE)
_TO_A_PLACE: Final = ("FlyTo", "GoTo", "LandIn", "FlyAndLand")
_OF_RING: Final = (
    r"(?!\s+(?:of|del?)\b"
    r"(?!\s+(?:the|that|its|la|el|l[ao]s)?\s*(?:circle|ring|lap|loop|orbit|c[ií]rculo|anillo|vuelta)\b))"
)
"""What may stand behind a centre that is the ring's: nothing, or `of the circle`; not `of the east field`."""
_CENTRE: Final = re.compile(
    rf"\b(?:back|returns?|then)\b[^.]{{0,25}}\b(?:centre|center|middle)\b{_OF_RING}"
    rf"|\b(?:vuelven?|regresan?|luego|después)\b[^.]{{0,25}}\bcentro\b{_OF_RING}",
    re.IGNORECASE,
)
_RING: Final = re.compile(r"\s*circle\((?:above\()?([A-Za-z_]\w*)")
_INNER: Final = ("steps", "then", "else", "parallel", "sequence")
Step = Mapping[str, Any]


def wants_centre(request: str) -> bool:
    """Return whether a request wants a machine back over the middle of the ring that it has flown."""
    return _CENTRE.search(request) is not None


def homeward(steps: list[Any], known: Collection[str], added: list[str]) -> list[Any]:
    """Return a list of steps in which a flight to `its port` is the way home, which ends there with a landing.

    Args:
        steps: of one list, in the short form.
        known: names that mean something else here: places, roles.
        added: is told what was put right.
    """
    found: list[Any] = []
    was_port = False
    for step in steps:
        is_port = isinstance(step, dict) and step.get("do") in _TO_A_PLACE and _is_port(step, known)
        meant = {"do": "ReturnHome", "agent": step.get("agent")} if is_port else step
        if is_port:
            added.append(f"{step.get('agent')} comes home: that is its port")
        if (is_port or was_port) and found and _is_way_home(meant) and found[-1] == meant:
            was_port = True
            continue
        found.append(meant)
        was_port = is_port
    return found


def back_at_centre(
    tree: Mapping[str, Any], request: str, verbs: Mapping[str, Verb], added: list[str]
) -> Mapping[str, Any]:
    """Return a tree whose one ring ends over its middle, if the request wants that and no step goes there.

    Args:
        tree: in the short form; it is not changed.
        request: in words.
        verbs: the vocabulary.
        added: is told what was put right.
    """
    if "FlyTo" not in verbs or not wants_centre(request):
        return tree
    order = list(_all_steps(tree))
    rings = [(i, step, ring[1]) for i, step in enumerate(order) if (ring := _ring_of(step)) is not None]
    if len(rings) != 1:
        return tree
    index, step, centre = rings[0]
    if any(centre in (one.get("to"), one.get("at")) for one in order[index + 1 :]):
        return tree
    back = {"do": "FlyTo", "agent": step.get("agent"), "to": centre, "height": step.get("height", HEIGHT)}
    added.append(f"{step.get('agent')} goes back to the centre, {centre}, after the circle, as the request says")
    changed: dict[str, Any] = _with_after(tree, step, back, is_branch=False)
    return changed


def _is_port(step: Step, known: Collection[str]) -> bool:
    where = next((step[key] for key in ("to", "at") if isinstance(step.get(key), str)), "")
    return where not in known and _PORT.fullmatch(where.strip()) is not None


def _is_way_home(step: Any) -> bool:
    return isinstance(step, dict) and step.get("do") == "ReturnHome"


def _ring_of(step: Step) -> re.Match[str] | None:
    way = step.get("way")
    return _RING.match(way) if step.get("do") == "FlyAlong" and isinstance(way, str) else None


def _all_steps(tree: Step) -> Iterator[Step]:
    """Yield the steps below a node in the order in which they are written."""
    for key in _INNER:
        listed = tree.get(key)
        for one in listed if isinstance(listed, list) else ():
            if isinstance(one, dict):
                yield one
                yield from _all_steps(one)


def _with_after(node: Any, mark: Step, new: Step, *, is_branch: bool) -> Any:
    """Return a copy of a tree with a step behind the one that is meant; in a branch of its own, both are a sequence."""
    if node is mark and is_branch:
        return {"sequence": [mark, new]}
    if not isinstance(node, dict):
        return node
    found = dict(node)
    for key in _INNER:
        listed = node.get(key)
        if not isinstance(listed, list):
            continue
        below = [_with_after(one, mark, new, is_branch=key == "parallel") for one in listed]
        at = next((i for i, one in enumerate(listed) if one is mark), None)
        if at is not None and key != "parallel":
            below.insert(at + 1, new)
        found[key] = below
    return found
