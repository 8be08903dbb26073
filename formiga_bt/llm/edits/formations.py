"""Edits for figures: three that a request wants as a right triangle stand so, and a zigzag has as many legs as it says."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.edits.steps import EditCase, Edited, put, steps_of
from formiga_bt.llm.shaping.formations import leg_of, legs_in
from formiga_bt.llm.words.legs import with_legs

_WHERE: Final = ("to", "at", "way")
_OF_CHECKER: Final = ("E026", "E048")
"""So many places for so many machines: a model counts the corners of a triangle badly."""


def as_triangle(case: EditCase) -> Iterator[Edited]:
    """The one team of three, which a request wants as a triangle over the one place that it names, stands as that."""
    leg, team = leg_of(case.words), case.machines[0] if len(case.machines) == 1 else None
    places = [name for name in case.words.places if name != "base"]
    wanted = case.wrong.about == "triangle" or case.wrong.code in _OF_CHECKER
    if not leg or not wanted or team is None or team.count != 3 or len(places) != 1:
        return
    figure = f"triangle({places[0]}, {leg})"
    tree: Mapping[str, Any] = case.tree
    for path, step in case.of(team.name):
        key = next((one for one in _WHERE if isinstance(step.get(one), str)), "")
        if key and not legs_in(step[key]):
            tree = put(tree, path, [{**step, key: figure}])
    if tree is not case.tree:
        roles = [{k: v for k, v in role.items() if k != "near"} for role in tree["agents"]]
        yield {**tree, "agents": roles}, f"{team.name} stand as {figure}, as the request says"


def of_legs(case: EditCase) -> Iterator[Edited]:
    """The one zigzag of a tree has as many legs as the request says."""
    found = [
        (path, step, key)
        for path, step in steps_of(case.tree)
        for key in _WHERE
        if isinstance(step.get(key), str) and with_legs(step[key], case.wrong.wanted) != step[key]
    ]
    if case.wrong.wanted and len(found) == 1:
        path, step, key = found[0]
        changed = {**step, key: with_legs(step[key], case.wrong.wanted)}
        yield put(case.tree, path, [changed]), f"the zigzag has {case.wrong.wanted} legs, as the request says"
