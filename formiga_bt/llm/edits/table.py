"""The edits by which a tree comes nearer to its request: for each kind of what is wrong, what could be put right by a program.

An edit is a function: from a tree and what is wrong with it to trees, each with what was done, in words. It speaks only where
the request can be meant in one way; whether the new tree is better, the ordinary judgement says (`nearby`).
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.edits.amounts import with_height, with_stay
from formiga_bt.llm.edits.formations import as_triangle, of_legs
from formiga_bt.llm.edits.often import repeated
from formiga_bt.llm.edits.places import gone_on, landed, sent_home
from formiga_bt.llm.edits.stays import stays
from formiga_bt.llm.edits.steps import EditCase, Edited, Found, put, steps_of

Edit = Callable[[EditCase], Iterator[Edited]]
_WHERE: Final = ("to", "at", "way", "region")


def known_agents(case: EditCase) -> Iterator[Edited]:
    """Steps of somebody who has no role are those of the one role that they can mean, or are done by others already."""
    roles = {str(one.get("name")) for one in case.tree.get("agents") or () if isinstance(one, dict)}
    agents = [str(step["agent"]) for _, step in steps_of(case.tree) if "do" in step and step.get("agent")]
    loops = {name.strip() for _, step in steps_of(case.tree) for name in str(step.get("for", "")).split(",")}
    strangers = list(dict.fromkeys(one for one in agents if one not in roles | loops))
    if len(strangers) != 1:
        return
    own, machines = case.of(strangers[0]), case.machines
    idle = [one for one in machines if one.name not in agents]
    alike = [one for one in machines if _is_called(case, strangers[0], one.type)]
    if len(idle) == 1 and (not alike or idle[0] in alike):
        yield _given(case.tree, own, idle[0].name), f"{strangers[0]} is {idle[0].name}, which had nothing to do"
    elif len(alike) == 1 and not any(_where(step) in _goals(case, alike[0].name) for _, step in own):
        yield _given(case.tree, own, alike[0].name), f"{strangers[0]} is {alike[0].name}, the one of that type"
    elif not idle and all(_is_done(case, step) for _, step in own):
        tree: Mapping[str, Any] = case.tree
        for path, _ in reversed(own):
            tree = put(tree, path, [])
        yield tree, f"steps of {strangers[0]} are left out: it has no role, and others do the same"


def _given(tree: Mapping[str, Any], found: list[Found], name: str) -> Mapping[str, Any]:
    for path, step in found:
        tree = put(tree, path, [{**step, "agent": name}])
    return tree


def _is_called(case: EditCase, word: str, type_: str) -> bool:
    type_of = case.world.catalogue.types[type_]
    return word.casefold() in {type_, type_of.label.casefold(), *type_of.label.casefold().split()[:1]} - {""}


def _where(step: Mapping[str, Any]) -> tuple[Any, ...]:
    return (step.get("do"), *(step.get(key) for key in _WHERE))


def _goals(case: EditCase, agent: str) -> set[tuple[Any, ...]]:
    return {_where(step) for _, step in case.of(agent)}


def _is_done(case: EditCase, step: Mapping[str, Any]) -> bool:
    return any(_where(step) in _goals(case, one.name) for one in case.machines)


EDITS: Final[Mapping[str, tuple[Edit, ...]]] = {
    "E010": (known_agents,),
    "E026": (as_triangle,),
    "E048": (as_triangle,),
    "figure_not_used": (as_triangle,),
    "wrong_legs": (of_legs,),
    "place_not_used": (gone_on,),
    "not_landed_there": (landed, gone_on),
    "not_so_often": (repeated,),
    "amount_not_used": (with_height, with_stay),
    "not_home": (sent_home,),
    "home_unasked": (stays,),
}
"""Code of what is wrong -> the edits for it, in the order in which they are tried."""
