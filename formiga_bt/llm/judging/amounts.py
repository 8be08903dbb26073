"""Amounts and numbers of times: what a request says is used, and used for what it says."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from formiga_bt.base.units import NUMBER, UNIT, parse_quantity
from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.plain import code_of
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.shaping.teams import gap_of
from formiga_bt.llm.words.amounts import IN_FULL, NUMBER_WORDS, NUMBERS, Amount
from formiga_bt.llm.words.triangles import TRIANGLE
from formiga_bt.llm.words.wording import Words

_QUANTITY: Final = re.compile(rf"(?<![\w.])({NUMBER})\s*({UNIT})(?![\w%])", re.ASCII)
_TIMES: Final = re.compile(
    rf"(?<![\w.])(\d{{1,3}}|{'|'.join(NUMBERS)})\s+(?:full |complete |whole )?(?:laps|rounds|times|vueltas|veces)\b"
    r"(?!\s+(?:yes|no|s[ií]|the|as|that|higher|faster|más|que)\b)",
    re.IGNORECASE,
)
_STEP: Final = re.compile(r"\b(?:call|do): *(?:\w+\.)?(\w+)((?:\n(?! *- ).*)*)")
"""A verb, and what is given to it."""
_ROUNDS: Final = re.compile(r"(?:laps|rounds)$", re.IGNORECASE)
_UNREAD: Final = re.compile(
    rf"(?<![\w.,])(\d+(?:\.\d+)?|{NUMBER_WORDS})(?:\s*-\s*|\s+)(?:fathoms?|furlongs?|paces?|strides?|rods?|chains?|leagues?|cubits?|"
    r"store?ys?|stories|floors?|body lengths?|brazas?|codos?|pasos|varas?|leguas?|syltä|kyynärää)(?!\w)",
    re.IGNORECASE,
)
_ONCE_MORE: Final = re.compile(r"\b(?:repeat\w*|again|more|repit\w+|otra|más|and then)\b", re.IGNORECASE)
"""What may stand beside a number of times that does not count the first one."""
_LEGS: Final = re.compile(r"\b(?:legs|catetos)\W*(?:(?:of|are|is|both|each|de|:)\s*)*$")


def amounts(words: Words, text: str) -> Iterator[Shortfall]:
    """Find amounts of a request that no value of a task is."""
    values = [a for match in _QUANTITY.finditer(code_of(text)) if (a := parse_quantity(match[0])) is not None]
    for amount in words.amounts:
        if not _is_a_value(amount, values):
            apart = gap_of(words) == f"{amount.si:g} m"
            metres = f", which is {amount.si:.4g} {'m/s' if amount.type == 'speed' else 'm'}" if amount.rounded else ""
            yield Shortfall(
                "amount_not_used",
                f'the request says "{amount.words}"{metres}, and no value of the task is {"so" if metres else amount.words}',
                help=f"one at PLACE, the other at offset(PLACE, east={amount.si:g} m)" if apart else "",
                about=amount.words,
            )


def unread(words: Words, text: str) -> Iterator[Shortfall]:
    """Find values of a task whose number a request says of a unit that nobody here knows: `50 m` for `50 fathoms`."""
    said = {one.words for one in words.amounts}
    for match in _UNREAD.finditer(words.text):
        number = float(match[1]) if match[1][0].isdigit() else float(IN_FULL[match[1].casefold()])
        for value in _QUANTITY.finditer(code_of(text)):
            amount = parse_quantity(value[0])
            if (
                amount is not None
                and float(value[1]) == number
                and not any(words.amount(*amount) == one for one in said)
            ):
                yield Shortfall(
                    "unit_unknown",
                    f'the request says "{match[0]}", which is no unit that is known here, and the task has {value[0]}',
                    help="say it in metres",
                )
                break


def _is_a_value(amount: Amount, values: Sequence[tuple[str, float]]) -> bool:
    """Return whether an amount is a value of a task; a time in two parts may be two values."""

    def is_there(si: float) -> bool:
        return any(replace(amount, si=si).means(type_, value) for type_, value in values)

    return is_there(amount.si) or (bool(amount.parts) and all(map(is_there, amount.parts)))


def misused(words: Words, task: Task) -> Iterator[Shortfall]:
    """Find amounts that the request says are a radius, a leg or a gap, and that the task uses as something else only."""
    for amount in words.amounts:
        if amount.type != "distance":
            continue
        before, after = words.text[: amount.at].casefold(), words.text[amount.at + len(amount.words) :].casefold()
        uses = [name for name, si in _params(task) if amount.means("distance", si)]
        if not uses:
            continue
        if re.match(r"\W*(?:apart|from each other|from one another)\b", after) and all(map(_is_height, uses)):
            yield Shortfall(
                "amount_misused",
                f'the request says "{amount.words} apart", and the task uses {amount.words} as a height only',
            )
        is_radius = (
            re.search(r"\bradius(?:\s+of)?\s*$", before) is not None or re.match(r"\W*radius\b", after) is not None
        )
        if is_radius and not any(name.startswith("radius") for name in uses):
            yield Shortfall(
                "amount_misused",
                f"the request wants a radius of {amount.words}, and the task uses it as {', '.join(uses)}",
            )
        is_leg = _LEGS.search(before) is not None or re.match(r"\W*(?:long )?(?:legs|catetos)\b", after) is not None
        if is_leg and re.search(TRIANGLE, words.text.casefold()) and not any(name.startswith("leg") for name in uses):
            yield Shortfall(
                "amount_misused",
                f"the request wants legs of {amount.words}, and the task uses it as {', '.join(uses)}",
                help=f"triangle(CORNER, {amount.words})",
            )


def _is_height(name: str) -> bool:
    return name.startswith(("height", "altitude"))


def _params(task: Task) -> Iterator[tuple[str, float]]:
    for param in task.params.values():
        if param.type.name == "distance" and param.default is not None and param.default.is_const:
            yield param.name, float(param.default.const)


def often(words: Words, text: str) -> Iterator[Shortfall]:
    """Find laps and times that a task does not fly: it repeats nothing, and has no verb so often."""
    code = code_of(text)
    if re.search(r"\b(?:repeat|for):", code):
        yield from _too_often(words, code)
        return
    steps = _STEP.findall(code)
    verbs = [verb for verb, _ in steps]
    of_verb = max((verbs.count(one) for one in verbs), default=0)
    of_step = max((steps.count(one) for one in steps), default=0)
    for match in _TIMES.finditer(words.text):
        most = of_step if _ROUNDS.search(match[0]) else of_verb  # a round leads to the same places again
        word = match[1].casefold()
        wanted = int(word) if word.isdigit() else NUMBERS.get(word, 0)
        if 2 <= wanted <= 1000 and most < wanted:
            yield Shortfall(
                "not_so_often",
                f'the request says "{match[0]}", and the task does nothing {wanted} times',
                help=f'{{"repeat": "{wanted}", "steps": [...]}}',
                about=match[0],
                wanted=wanted,
            )


def _too_often(words: Words, code: str) -> Iterator[Shortfall]:
    """Find the one repetition of a task that has more rounds than the one number of times that the request says."""
    said, rounds = list(_TIMES.finditer(words.text)), re.findall(r"\brepeat: *(\S+)", code)
    if len(said) != 1 or len(rounds) != 1 or not rounds[0].isdigit():
        return
    word = said[0][1].casefold()
    wanted = int(word) if word.isdigit() else NUMBERS.get(word, 0)
    if int(rounds[0]) > max(1, wanted) + (_ONCE_MORE.search(words.text) is not None):
        yield Shortfall(
            "too_often",
            f'the request says "{said[0][0]}", and the task repeats its steps {rounds[0]} times',
            help=f'{{"repeat": "{wanted}", "steps": [...]}}',
            about=said[0][0],
            wanted=wanted,
        )
