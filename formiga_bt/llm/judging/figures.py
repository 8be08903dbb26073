"""Figures that a request names: circle, zigzag, triangle. Each has a helper; a ring is round where its machine is sent."""

import re
from collections.abc import Iterator, Mapping
from typing import Final

from formiga_bt.lang.model import Task
from formiga_bt.llm.judging.plain import code_of
from formiga_bt.llm.records import Shortfall
from formiga_bt.llm.shaping.tidying import wants_centre
from formiga_bt.llm.words import plain_words
from formiga_bt.llm.words.legs import legs_in, legs_of
from formiga_bt.llm.words.triangles import TRIANGLE
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

FIGURES: Final[Mapping[str, str]] = {
    rf"\b(?:circle[sd]?|circular|orbits?|c[ií]rculo)\b|{plain_words.pattern_of('circle')}": "circle",
    rf"\bzig-?zag\w*|{plain_words.pattern_of('zigzag')}": "zigzag",
    TRIANGLE: "triangle",
}
"""What a request calls a figure -> the helper that is it."""


def figures(words: Words, text: str) -> Iterator[Shortfall]:
    """Find figures that a request names and a task does not fly: each has a helper."""
    code, said = code_of(text), words.text.casefold()
    ways = re.sub(r"^ *near: .*$", "", code, flags=re.MULTILINE)
    for pattern, helper in FIGURES.items():  # who goes to the end of a way does not fly it
        is_flown = re.search(rf"(?<!\bfirst\()(?<!\blast\()\b{helper}\(", ways) is not None
        if re.search(pattern, said) and not is_flown and "Explore" not in code:
            yield Shortfall("figure_not_used", f"the request wants a {helper}, and the task flies none", about=helper)
    legs, flown = legs_of(words), legs_in(ways)
    if legs and flown and legs not in flown:
        text_ = f"the request wants a zigzag of {legs} legs, and the task flies one of {' and '.join(map(str, sorted(flown)))}"
        yield Shortfall("wrong_legs", text_, help=f"zigzag(FROM, TO, SIDE, {legs})", about="zigzag", wanted=legs)
    ring = re.search(r"circle\((?:above\()?(\w+)", code)
    if ring is not None and wants_centre(words.text):
        after = code[ring.end() :]
        if re.search(rf"(?:to|at): \$\{{(?:above\()?{ring[1]}\b", after) is None:
            text_ = f"the request wants the drone back at the centre after the circle, and it does not go to {ring[1]}"
            yield Shortfall("not_at_centre", text_, help=f"FlyTo {ring[1]} after the FlyAlong")


def rings(text: str, task: Task, world: RequestWorld) -> Iterator[Shortfall]:
    """Find rings round a machine that still stands at its port when they are begun."""
    steps = code_of(text).partition("\nsteps:")[2]
    machines = {name for name, role in task.roles.items() if not world.catalogue.types[role.types[0]].human}
    for ring in re.finditer(r"\bcircle\((?:(?:ground|above)\()?(\w+)\.position\b", steps):
        name = ring[1]
        if name in machines and re.search(rf"\b{name}\b(?!\.position)", steps[: ring.start()]) is None:
            yield Shortfall(
                "ring_elsewhere",
                f"the ring is round where {name} stands before it is sent anywhere",
                help="circle(PLACE, RADIUS) with the place that it is sent to",
            )
