"""Edits for amounts that no value has: a height that is one for certain, and how long a machine stays."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.edits.steps import EditCase, Edited, Found, Step, after, is_so, put, steps_of
from formiga_bt.llm.edits.who import who
from formiga_bt.llm.judging.heights import is_height
from formiga_bt.llm.words.amounts import Amount

_HEIGHTS: Final = ("height", "altitude")
_FOR: Final = re.compile(
    r"\b(?:for|during|durante|por|stays?|waits?|hovers?|remains?|pauses?|looks?|esperan?|permanecen?|"
    r"stay|wait|hover|pause)\s+(?:there\s+|all[ií]\s+|about\s+|unos\s+|another\s+)?$",
    re.IGNORECASE,
)
_STAYS: Final = re.compile(
    r"\b(?:hover\w*|stay\w*|wait\w*|remain\w*|pause\w*|looks?|watch\w*|espera\w*|permanec\w+|queda\w*|mira\w*|observ\w+|"
    r"film\w*|lands?|stops?|there)\b",
    re.IGNORECASE,
)
_EACH: Final = re.compile(r"\s*(?:\w+\s+){0,2}?(?:each|every|cada)\b|\s*at (?:both|all)\b", re.IGNORECASE)


def with_height(case: EditCase) -> Iterator[Edited]:
    """Flights of an assumed height have the one that the request says; of several, the flight to the place beside it."""
    amount = _amount(case, "distance")
    heights = [one for one in case.words.amounts if one.type == "distance" and is_height(case.words, one)]
    if amount is None or amount not in heights:
        return
    if len(heights) > 1:
        yield from _with_height_there(case, amount)
        return
    begin = amount.at
    subject = who(case, begin)
    if subject is None or (len(subject.names) > 1 and not subject.is_all):
        meant = {one.name for one in case.machines}
    else:
        meant = set(subject.names)
    flights = [one for one in steps_of(case.tree) if any(one[1].get(key) for key in _HEIGHTS)]
    own = [one for one in flights if one[1].get("agent") in meant]
    if not own or any(_is_said(case, step) for _, step in own):
        return
    tree, height = case.tree, f"{amount.si:g} m"
    for path, step in own:
        tree = put(tree, path, [{**step, **{key: height for key in _HEIGHTS if key in step}}])
    yield tree, f"the height is {height}, as the request says"


def _with_height_there(case: EditCase, amount: Amount) -> Iterator[Edited]:
    """Give the one flight to the place that stands beside a height this height: `to the camp at 20 m`."""
    words, high = re.escape(amount.words), r"(?:(?:a|an|una?)\s+(?:height|altitude|altura|altitud)\s+(?:of|de)\s+)?"
    beside = [
        name
        for name, said in case.words.places.items()
        if re.search(
            rf"{re.escape(said)}(?!\w),?\s+(?:at|from|a|desde)\s+{high}{words}"
            rf"|{words}\s+(?:high\s+)?(?:over|above|sobre)\s+(?:(?:the|el|la)\s+)?{re.escape(said)}(?!\w)",
            case.words.text,
            re.IGNORECASE,
        )
    ]
    flights = [(path, step) for path, step in steps_of(case.tree) if beside and step.get("to") == beside[0]]
    if len(beside) == 1 and len(flights) == 1 and flights[0][1].get("height"):
        path, step = flights[0]
        height = f"{amount.si:g} m"
        yield (
            put(case.tree, path, [{**step, "height": height}]),
            f"the height at {beside[0]} is {height}, as the request says",
        )


def with_stay(case: EditCase) -> Iterator[Edited]:
    """A pause of an assumed length is as long as the request says; the one flight without a pause gets it."""
    amount = _amount(case, "duration")
    if amount is None or not _is_stay(case, amount):
        return
    long = {"wait": f"{amount.si:g} s"}
    end = amount.at + len(amount.words)
    each = _EACH.match(case.words.text, end) is not None
    waits = [one for one in steps_of(case.tree) if "wait" in one[1]]
    if waits:
        assumed = not any(is_so(step["wait"], one) for _, step in waits for one in case.words.amounts)
        if assumed and (len(waits) == 1 or (each and len({str(step["wait"]) for _, step in waits}) == 1)):
            yield _all(case.tree, waits, long), f"the pause is {amount.words}, as the request says"
        return
    flights = [one for one in steps_of(case.tree) if one[1].get("do") in ("FlyTo", "FlyAndLand")]
    others = [one for one in steps_of(case.tree) if one[1].get("do") not in ("FlyTo", "FlyAndLand", "ReturnHome", None)]
    if not others and flights and case.is_plain and (len(flights) == 1 or each):
        tree = case.tree
        for path, _ in reversed(flights):
            tree = after(tree, path, long)
        yield tree, f"a pause of {amount.words}, as the request says"


def _all(tree: Mapping[str, Any], found: list[Found], step: Step) -> Mapping[str, Any]:
    for path, _ in found:
        tree = put(tree, path, [step])
    return tree


def _amount(case: EditCase, type_: str) -> Amount | None:
    """Return the amount that no value has, if the request says it once."""
    found = [one for one in case.words.amounts if one.words == case.wrong.about and one.type == type_]
    return found[0] if len(found) == 1 else None


def _is_stay(case: EditCase, amount: Amount) -> bool:
    """Return whether an amount says how long a machine stays at a place: `stays there for 30 s`."""
    text = case.words.text
    begin = amount.at
    since = max(text.rfind(mark, 0, begin) for mark in (". ", "; ")) + 1
    is_long = _FOR.search(text[:begin]) or _EACH.match(text, begin + len(amount.words))
    return is_long is not None and _STAYS.search(text, since, begin) is not None


def _is_said(case: EditCase, step: Step) -> bool:
    return any(is_so(step.get(key), one) for key in _HEIGHTS for one in case.words.amounts)
