"""Steps of the short form that a program puts as the language has them, before they are expanded.

Small models spell out `flies to its port and lands` as a flight to a place called `port`, and forget the way back to the
middle of a ring that they have flown. They put a pause where a period was asked for.
Each can be meant in one way only. What is put right is told.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from formiga_bt.base.units import parse_quantity
from formiga_bt.llm.shaping.lifting import bare
from formiga_bt.llm.shaping.moves import HEIGHT
from formiga_bt.llm.shaping.walking import INNER, all_steps
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.amounts import Amount
from formiga_bt.llm.words.endings import stations
from formiga_bt.llm.words.wording import Words

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
_EVERY: Final = re.compile(r"\b(?:every|each|cada)\s+$", re.IGNORECASE)
_FROM_START: Final = re.compile(r"\s*(?:from|de) (?:one |un )?(?:start|inicio|comienzo) (?:to|al?) ", re.IGNORECASE)
_DECIDES: Final = re.compile(
    r"(?:yes|no|ok(?:ay)?|go|stop|wait|stay|abort|cancel|leave|clear|agree\w*|refuse\w*|den(?:y|ied)|allow\w*|approve\w*|accept\w*|"
    r"reject\w*|ready|safe|unsafe|land|continue|start|confirm\w*|true|false|s[ií]|seguir|parar|esperar|kyllä|ei|jatka|seis)"
    r"(?:\b.*)?|(?:not|do not|don't|all (?:clear|good|ok)|keep|come|fly|try)\b.*",
    re.IGNORECASE,
)
"""An option by which a machine may go on or not."""
ANYWAY: Final = "*"
"""The answer on which a question goes on, if any will do."""
_WHATEVER: Final = re.compile(
    r"(?<!do )(?<!does )(?<!follow )(?<!follows )(?<!obeys )"
    r"\b(?:what(?:ever| ?so ?ever)|no matter (?:what|how)|regardless of (?:what|how)|independent(?:ly)? of)\s+"
    r"(?:(?:the|his|her|their|its)\s+)?(?:\w+\s+)?(?:says?|said|answers?|answered|repl(?:y|ies)|decides?|thinks?)\b"
    r"|\b(?:diga|conteste|responda) lo que (?:diga|conteste|responda)\b|\bsea cual sea (?:la|su) respuesta\b",
    re.IGNORECASE,
)
"""Who is asked decides nothing."""
_WHETHER: Final = re.compile(r"\b(?:ask\w*|pregunt\w+)\s+(?:[\w-]+\s+){0,3}?(?:if|si)\b", re.IGNORECASE)
_CONDITION: Final = re.compile(
    r"\b(?:if|unless|only|once|until|otherwise|solo|sólo|salvo|hasta)\b|\bsi\b(?!\s+está)", re.IGNORECASE
)
"""Words by which an answer may decide something all the same."""
Step = Mapping[str, Any]


def wants_centre(request: str) -> bool:
    """Return whether a request wants a machine back over the middle of the ring that it has flown."""
    return _CENTRE.search(request) is not None or "centre" in stations(request)


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
    tree: Mapping[str, Any], request: str, verbs: Mapping[str, AgentVerb], added: list[str]
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
    order = list(all_steps(tree))
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


def branched(branches: Any, added: list[str]) -> Any:
    """Return the branches of a `parallel` whose one branch has the steps of several machines: one branch for each of them.

    A `parallel` of one branch has no other meaning. A pause belongs to the machine before it.

    Args:
        branches: in the short form.
        added: is told what was put right.
    """
    if not isinstance(branches, list) or len(branches) != 1 or not isinstance(branches[0], dict):
        return branches
    steps = branches[0].get("sequence")
    if set(branches[0]) != {"sequence"} or not isinstance(steps, list):
        return branches
    by_agent: dict[str, list[Step]] = {}
    last = ""
    for one in steps:
        if not isinstance(one, dict) or not ("do" in one or ("wait" in one and last)):
            return branches
        last = str(one.get("agent")) if "do" in one else last
        by_agent.setdefault(last, []).append(one)
    if len(by_agent) < 2:
        return branches
    added.append(f"{' and '.join(by_agent)} fly at the same time: each has a branch of its own")
    return [{"sequence": own} for own in by_agent.values()]


def only_on_yes(tree: Mapping[str, Any], request: str, added: list[str]) -> Mapping[str, Any]:
    """Return a tree in which a question whose answer nobody looks at goes on after a yes only, or after any answer.

    Args:
        tree: in the short form; it is not changed.
        request: in words; `whatever she says` wants to go on after any answer.
        added: is told what was put right.
    """
    changes: dict[int, Step] = {}
    asks = [step for step in all_steps(tree) if "ask" in step]
    if _WHATEVER.search(request) and not _CONDITION.search(_WHETHER.sub(" ", request)):
        name = re.compile(rf"\b{re.escape(str(asks[0].get('save_as') or '·'))}\b") if len(asks) == 1 else None
        if name is not None and not any(name.search(text) for one in all_steps(tree) for text in _looks(one)):
            changes[id(asks[0])] = {**{k: v for k, v in asks[0].items() if k != "save_as"}, "go_on": ANYWAY}
            added.append("it goes on whatever the answer is, as the request says")
        kept: Mapping[str, Any] = _replaced(tree, changes)
        return kept
    for step in asks:
        plain = step.get("options") in (None, [], ["yes", "no"])
        if not plain or not isinstance(step.get("save_as"), str):
            continue
        name = re.compile(rf"\b{re.escape(step['save_as'])}\b")
        if not any(name.search(text) for one in all_steps(tree) for text in _looks(one)):
            changes[id(step)] = {key: value for key, value in step.items() if key != "save_as"}
            added.append("it goes on after a yes only, for no step looks at the answer")
    changed: Mapping[str, Any] = _replaced(tree, changes)
    return changed


def goes_on_with(step: Step, options: Sequence[str]) -> str:
    """Return the answer of a question, whose answer no step looks at, with which a task goes on; "" = with any.

    Args:
        step: the question, in the short form.
        options: the answers that can be given; none = yes and no.
    """
    told = str(step.get("go_on") or "")
    if told == ANYWAY or (not told and options and not any(_DECIDES.fullmatch(one.strip()) for one in options)):
        return ""  # `none`, `few`, `many`: no one of them is a yes
    return told or (options[0] if options else "yes")


def _looks(step: Step) -> Iterator[str]:
    """Yield the texts of a step in which a saved answer can be looked at."""
    for key, value in step.items():
        if key not in ("save_as", "do", "agent") and isinstance(value, str):
            yield value


def every_so_often(tree: Mapping[str, Any], words: Words, added: list[str]) -> Mapping[str, Any]:
    """Return a tree whose one repetition has the period that the request gives it: `every 5 minutes`.

    A model writes a pause of that length inside, or a second repetition of that length; both take longer.

    Args:
        tree: in the short form; it is not changed.
        words: the request.
        added: is told what was put right.
    """
    periods = [one for one in words.amounts if one.type == "duration" and _is_period(one, words.text)]
    rounds = [step for step in all_steps(tree) if step.get("repeat") is not None]
    if len(periods) != 1 or not rounds or any(one.get("every") for one in rounds):
        return tree
    period, outer = periods[0], rounds[0]
    body = outer.get("steps")
    if not isinstance(body, list) or _lasts(outer.get("repeat"), period):
        return tree
    if len(rounds) == 2 and len(body) == 1 and body[0] is rounds[1] and _lasts(body[0].get("repeat"), period):
        body = body[0].get("steps")
    elif len(rounds) > 1:
        return tree
    kept = [one for one in body or () if not (isinstance(one, dict) and _lasts(one.get("wait"), period))]
    added.append(f"it begins every {period.words}, as the request says")
    changed: Mapping[str, Any] = _replaced(tree, {id(outer): {**outer, "every": f"{period.si:g} s", "steps": kept}})
    return changed


def _is_period(amount: Amount, request: str) -> bool:
    before, after = request[: amount.at], request[amount.at + len(amount.words) :]
    return _EVERY.search(before) is not None or _FROM_START.match(after) is not None


def _lasts(value: Any, amount: Amount) -> bool:
    """Return whether a value of the short form is so long."""
    found = parse_quantity(bare(value)) if isinstance(value, str) else None
    return found is not None and found[0] == "duration" and abs(found[1] - amount.si) < 1e-6


def _replaced(node: Any, changes: Mapping[int, Step]) -> Any:
    """Return a copy of a tree with other steps in place of some; these are known by `id`."""
    if id(node) in changes:
        return changes[id(node)]
    if not isinstance(node, dict) or not changes:
        return node
    return {
        key: [_replaced(one, changes) for one in value] if key in INNER and isinstance(value, list) else value
        for key, value in node.items()
    }


def _is_port(step: Step, known: Collection[str]) -> bool:
    where = next((step[key] for key in ("to", "at") if isinstance(step.get(key), str)), "")
    return where not in known and _PORT.fullmatch(where.strip()) is not None


def _is_way_home(step: Any) -> bool:
    return isinstance(step, dict) and step.get("do") == "ReturnHome"


def _ring_of(step: Step) -> re.Match[str] | None:
    way = step.get("way")
    return _RING.match(way) if step.get("do") == "FlyAlong" and isinstance(way, str) else None


def _with_after(node: Any, mark: Step, new: Step, *, is_branch: bool) -> Any:
    """Return a copy of a tree with a step behind the one that is meant; in a branch of its own, both are a sequence."""
    if node is mark and is_branch:
        return {"sequence": [mark, new]}
    if not isinstance(node, dict):
        return node
    found = dict(node)
    for key in INNER:
        listed = node.get(key)
        if not isinstance(listed, list):
            continue
        below = [_with_after(one, mark, new, is_branch=key == "parallel") for one in listed]
        at = next((i for i, one in enumerate(listed) if one is mark), None)
        if at is not None and key != "parallel":
            below.insert(at + 1, new)
        found[key] = below
    return found
