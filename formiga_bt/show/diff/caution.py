"""Which changes a person must look at, because they can make a flight less safe. A hint for reviewers, no proof of anything."""

from collections.abc import Iterator, Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.lang import model
from formiga_bt.lang.model import ActionSpec, Step
from formiga_bt.lang.walk import orders
from formiga_bt.show.diff.changes import Difference, title
from formiga_bt.show.diff.outline import OutlineNode
from formiga_bt.show.diff.values import FieldValue
from formiga_bt.show.facts import FileSpot

BOUNDS: Final = ("timeout", "cleanup_timeout", "expires", "retry attempt_timeout")
CONDITIONS: Final = ("when", "guard", "check", "wait_until", "expect", "if", "while", "until", "break_if")
CLEANUP: Final = ("on_failure/", "on_abort/", "finally/")
_HEIGHTS: Final = ("height", "altitude", "alt")
_LIFTS: Final = ("above", "at_height")


class Caution(Struct, frozen=True, omit_defaults=True):
    """One thing to look at."""

    text: str
    spot: FileSpot | None = None


def cautions(difference: Difference, actions: Mapping[str, ActionSpec]) -> tuple[Caution, ...]:
    """Return what to look at, in the order of the changes.

    Args:
        difference: the tasks compared.
        actions: of the catalogue; they tell what lands.
    """
    found: list[Caution] = []
    for node, changes in difference.of.items():
        for change in changes:
            if change.what == "removed":
                texts = _removed(node, difference, actions)
            elif change.what == "added":
                texts = _added(node, difference, actions)
            elif change.what == "moved":
                texts = _moved(node, change.from_path, actions)
            elif change.what == "changed":
                texts = _changed(difference.matching.to_old[node], node)
            else:
                continue
            found += [Caution(text, change.after or change.before) for text in texts]
    return tuple(dict.fromkeys(found))


def _removed(node: OutlineNode, difference: Difference, actions: Mapping[str, ActionSpec]) -> Iterator[str]:
    for one in node.below():
        if one in difference.matching.to_new or not isinstance(one.thing, Step):
            continue
        if _lands(one.thing, actions):
            yield f"{title(one)} lands; it is removed"
        elif one.path.startswith(CLEANUP):
            yield f"removed from {one.path.partition('/')[0]}: {title(one)}"
        if isinstance(one.thing, model.Ask):
            what = "clearance" if one.thing.clears is not None else "question"
            yield f"a {what} is removed: {title(one)}"
        if isinstance(one.thing, model.Guard | model.Check | model.WaitUntil):
            yield f"a {one.kind} is removed: {title(one)}"
        if "timeout" in one.fields and one.children:
            yield f"timeout removed with {title(one)}: {one.fields['timeout'].words}"


def _added(node: OutlineNode, difference: Difference, actions: Mapping[str, ActionSpec]) -> Iterator[str]:
    for one in node.below():
        if one in difference.matching.to_old or not isinstance(one.thing, Step):
            continue
        if one.thing.ignore_failure:
            yield f"the failure of {title(one)} is ignored"
        if isinstance(one.thing, model.Do) and actions[one.thing.action].starts_rotors:
            yield f"{title(one)} starts rotors; it is added"


def _moved(node: OutlineNode, was: str, actions: Mapping[str, ActionSpec]) -> Iterator[str]:
    section, before = node.path.partition("/")[0], was.partition("/")[0]
    if isinstance(node.thing, Step) and _lands(node.thing, actions):
        yield f"{title(node)} lands; it moved"
    elif section != before:
        yield f"{title(node)} moved from {before} to {section}"


def _lands(step: Step, actions: Mapping[str, ActionSpec]) -> bool:
    """Return whether a leaf lands a machine."""
    if not isinstance(step, model.Do | model.Call):
        return False
    return any(actions[do.action].lands for _, do in orders(step) if do.action in actions)


def _changed(was: OutlineNode, node: OutlineNode) -> Iterator[str]:
    for key in dict.fromkeys([*was.fields, *node.fields]):
        before, after = was.fields.get(key), node.fields.get(key)
        if (before.atoms if before else None) != (after.atoms if after else None):
            yield from _field(key, before, after, node)


def _field(key: str, before: FieldValue | None, after: FieldValue | None, node: OutlineNode) -> Iterator[str]:
    where = title(node) if node.kind != "task" else "the task"
    arrow = f"{before.words if before else 'none'} -> {after.words if after else 'none'}"
    old, new = _most(before), _most(after)
    if key in BOUNDS and before is not None:
        if after is None:
            yield f"{key} of {where} is removed: {before.words}"
        elif new is None or old is None or new > old:
            yield f"{key} of {where} is longer: {arrow}" if new and old else f"{key} of {where}: {arrow}"
    elif key in CONDITIONS and before is not None:
        yield f"the condition '{key}' of {where}: {arrow}"
    elif key in ("clears", "clears_on", "if_no_answer") or (key in ("of", "policy") and "clears" in node.fields):
        yield f"{key} of {where}: {arrow}"
    elif (node.kind == "role" and key in ("type", "id", "capabilities")) or (node.kind == "do" and key == "agent"):
        yield f"other agents for {where}: {arrow}"
    elif key == "battery_min" and before is not None and (old is None or new is None or new < old):
        yield f"{where} needs less charge: {arrow}"
    elif key in ("ignore_failure", "critical") and (key == "critical") == (after is None):
        yield f"{key} of {where} {'removed' if after is None else 'added'}"
    elif key in ("priority", "preemptible", "preempt", "if_lost", "hand_over_at") or (
        key.startswith("envelope ") and before is not None
    ):
        yield f"{key} of {where}: {arrow}"
    elif _is_height(key, node, before, after) and (old is None or new is None or new > old):
        how = "flies higher" if old is not None and new is not None else "may fly at another height"
        yield f"{how}, {key.removeprefix('with ')} of {where}: {arrow}"


def _is_height(key: str, node: OutlineNode, before: FieldValue | None, after: FieldValue | None) -> bool:
    if before is None and node.kind not in ("param", "var"):
        return False
    name = (
        node.sub if node.kind in ("param", "var") and key in ("default", "max", "value") else key.removeprefix("with ")
    )
    if any(name == word or name.endswith(f"_{word}") or name.startswith(f"{word}_") for word in _HEIGHTS):
        return True
    atoms = [*(before.atoms if before else ()), *(after.atoms if after else ())]
    return any(sort == "sign" and text in _LIFTS for sort, text in atoms)


def _most(value: FieldValue | None) -> float | None:
    """Return the largest quantity in a value."""
    found = [float(t) for sort, t in value.atoms if sort in ("duration", "distance", "percent")] if value else []
    return max(found) if found else None
