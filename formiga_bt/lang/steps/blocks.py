"""Steps made of steps: sequence, fallback, if, parallel, guard. They follow what is saved and certain along each path.

The loops are in `loops`. Both are handed the readers of steps by `step`, which knows every kind.
"""

from collections.abc import Callable
from contextlib import nullcontext
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.body import Body
from formiga_bt.lang.expressions import narrows, narrows_when_false
from formiga_bt.lang.flow import Flow, join
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Check, Notify, Set, Step, Wait
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.text.document import Entry, Node, Scalar
from formiga_bt.lang.text.reading import fix_word, what_is
from formiga_bt.lang.text.synonyms import nearest
from formiga_bt.lang.written import saves, sets, writes


class Readers(Struct, frozen=True):
    """The readers of steps: of a list, of one step, and of the items of a list."""

    steps: Callable[[Body, Node, str, str], tuple[Step, ...]]
    step: Callable[[Body, Node, str], Step | None]
    items: Callable[[Body, Node, str], tuple[Node, ...]]


def behind(body: Body, what: str, mark: Mark) -> None:
    """Put a barrier between the steps read from here on and the loop around; the caller puts `around` back."""
    if body.around is not None and not body.around.barrier:
        body.around = replace(body.around, barrier=f"this {what} ({mark.said})")


# --- sequence, fallback, if --------------------------------------------------------------------------------------


def read_sequence(read: Readers, body: Body, keys: Keys) -> Part:
    """Read steps one after another, and what follows them in any case."""
    node, entry = keys["sequence"].value, body.flow.copy()
    reactive = keys.flag("reactive")
    if reactive:
        steps = _read_reactive(read, body, node, "sequence")
        _check_reactive(body, steps, keys["sequence"].key.mark)
    else:
        steps = read.steps(body, node, "sequence", "sequence")
    last = _read_finally(read, body, keys["finally"], entry) if "finally" in keys else ()
    return {"steps": steps, "reactive": reactive, "finally_": last}


def _read_finally(read: Readers, body: Body, entry: Entry, before: Flow) -> tuple[Step, ...]:
    end, around = body.flow, body.around
    body.flow = Flow(dict(end.saved), before.sure, end.taken, released=dict(end.released))
    behind(body, "finally", entry.key.mark)
    with body.problems.within("finally"):
        steps = read.steps(body, entry.value, "finally", "finally")
    body.around = around
    after = body.flow
    body.flow = Flow(after.saved, after.sure | end.sure, after.taken, end.dead, after.released)
    return steps


def _read_reactive(read: Readers, body: Body, node: Node, key: str) -> tuple[Step, ...]:
    """Read the children of a reactive step, whose checks before the last child are watched."""
    found = []
    items = read.items(body, node, key)
    for index, item in enumerate(items):
        body.watched = writes(node) if index < len(items) - 1 else None
        step = read.step(body, item, f"{key}[{index}]")
        body.watched = None
        if step is not None:
            found.append(step)
    return tuple(found)


def _check_reactive(body: Body, steps: tuple[Step, ...], mark: Mark) -> None:
    """Report E045 for children before the last that are no plain checks."""
    for step in steps[:-1]:
        changed = step.when or step.retry or step.timeout or step.ignore_failure
        if isinstance(step, Check) and not changed:
            continue
        if isinstance(step, Check):
            what = "a check that is re-checked has no when, retry, timeout or ignore_failure"
            body.problems.add("E045", step.mark, what, "put it all into the one condition")
        else:
            what = f"reactive would restart {step.title}; use guard"
            body.problems.add("E045", step.mark, what, "only checks may stand before the last step of a reactive one")
    if len(steps) == 1:
        body.problems.add("E045", mark, "reactive has nothing to re-check here", "put checks before the last step")


def read_fallback(read: Readers, body: Body, keys: Keys) -> Part:
    """Read the children: each later one runs after all former ones failed, and sees `error`."""
    node = keys["fallback"].value
    reactive = keys.flag("reactive")
    items = read.items(body, node, "fallback")
    entry, around = body.flow.copy(), body.around
    behind(body, "fallback", keys["fallback"].key.mark)
    ends: list[Flow] = []
    found: list[Step] = []
    saved, released = dict(entry.saved), dict(entry.released)
    for index, item in enumerate(items):
        if ends and _never_fails(found[-1:]):
            body.problems.add("E043", item.mark, "this child never runs: the one before it cannot fail", "remove it")
        body.flow = Flow(dict(saved), entry.sure, entry.taken, released=dict(released))
        body.watched = writes(node) if reactive and index < len(items) - 1 else None
        with body.with_error(found) if index else nullcontext():
            step = read.step(body, item, f"fallback[{index}]")
        body.watched = None
        ends.append(body.flow)
        saved.update(body.flow.saved)
        released.update(body.flow.released)
        if step is not None:
            found.append(step)
    body.around = around
    if ends:
        body.flow = join(*ends)
    if reactive:
        _check_reactive(body, tuple(found), keys["fallback"].key.mark)
    return {"steps": tuple(found), "reactive": reactive}


def _never_fails(steps: list[Step]) -> bool:
    """Return whether the step before surely succeeds: its failure is passed over, or nothing in it can fail.

    A timeout fails a step that waits longer, and so does a field of an agent that is not known yet.
    """
    if not steps or steps[0].when is not None:
        return False
    step = steps[0]
    if step.ignore_failure:
        return True
    match step:
        case Notify():
            read = [step.text]
        case Set():
            read = list(step.assign.values())
        case Wait():
            read = [step.duration]
        case _:
            return False
    limited = step.timeout is not None or (step.retry is not None and step.retry.attempt_timeout is not None)
    return not limited and not any(one.field for expr in read for one in expr.reads)


def read_if(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read the two branches of a condition."""
    cond = body.cond(keys["if"].value, "if")
    entry = body.flow.copy()
    if cond is not None:
        body.flow.sure |= narrows(cond)
    then = read.steps(body, keys["then"].value, "then", "then") if "then" in keys else ()
    after_then = body.flow
    body.flow = entry.copy()
    if cond is not None:
        body.flow.sure |= narrows_when_false(cond)
    otherwise = read.steps(body, keys["else"].value, "else", "else") if "else" in keys else ()
    body.flow = join(after_then, body.flow)
    return {"cond": cond, "then": then, "otherwise": otherwise} if cond is not None else None


# --- guard, parallel ---------------------------------------------------------------------------------------------


def read_guard(read: Readers, body: Body, keys: Keys) -> Part | None:
    """Read steps that run only as long as a condition holds."""
    node = keys["steps"].value if "steps" in keys else None
    cond = body.cond(keys["guard"].value, "guard", live=writes(node) if node is not None else frozenset())
    if cond is not None:
        body.flow.sure |= narrows(cond)
    body.bounded += 1
    steps = read.steps(body, node, "steps", "steps") if node is not None else ()
    body.bounded -= 1
    return {"cond": cond, "steps": steps} if cond is not None else None


def read_parallel(read: Readers, body: Body, keys: Keys) -> Part:
    """Read branches that run at once: none sees what another one saves, until all have ended."""
    items = read.items(body, keys["parallel"].value, "parallel")
    need = read_need(body, keys, len(items), "branches")
    cancel = read_child_failure(keys)
    stopped = need != "all" or cancel == "cancel"
    found, entry, ends = _read_branches(read, body, keys["parallel"].key, items, stopped=stopped)
    if ends:
        body.flow = _together(entry, ends, all_of=need == "all")
    return {"steps": found, "need": need, "on_child_failure": cancel}


def read_race(read: Readers, body: Body, keys: Keys) -> Part:
    """Read branches of which the first to end decides: what each of them has made sure holds afterwards."""
    key = keys["race"].key
    items = read.items(body, keys["race"].value, "race")
    found, _, ends = _read_branches(read, body, key, items, stopped=True)
    if ends:
        body.flow = join(*ends)
    return {"steps": found, "need": "first"}


def _read_branches(
    read: Readers, body: Body, key: Scalar, items: tuple[Node, ...], *, stopped: bool
) -> tuple[tuple[Step, ...], Flow, list[Flow]]:
    """Return branches that run at once, what holds before them, and what holds at the end of each.

    Args:
        read: the readers of steps.
        body: read into.
        key: of the step.
        items: the branches.
        stopped: whether one branch may stop the others.
    """
    _check_shared_writes(body, items)
    entry, around, volatile = body.flow.copy(), body.around, body.volatile
    behind(body, key.text, key.mark)
    body.bounded += stopped
    ends: list[Flow] = []
    found: list[Step] = []
    for index, item in enumerate(items):
        body.flow = entry.copy()
        body.volatile = volatile.union(*(writes(other) for other in items if other is not item))
        step = read.step(body, item, f"{key.text}[{index}]")
        ends.append(body.flow)
        if step is not None:
            found.append(step)
    body.bounded -= stopped
    body.around, body.volatile = around, volatile
    return tuple(found), entry, ends


def _together(entry: Flow, ends: list[Flow], *, all_of: bool) -> Flow:
    """Return what holds after branches: with `need: all`, what each of them has made sure."""
    after = join(*(replace_dead(end) for end in ends))
    if all_of:
        after.sure = frozenset().union(*(end.sure for end in ends))
        after.dead = any(end.dead for end in ends)
    else:
        after.sure = entry.sure
        after.dead = all(end.dead for end in ends)
    return after


def replace_dead(flow: Flow) -> Flow:
    """Return a copy of a flow as if a path led to its end."""
    alive = flow.copy()
    alive.dead = False
    return alive


def _check_shared_writes(body: Body, items: tuple[Node, ...]) -> None:
    """Report E072 for a name that two branches write."""
    seen: dict[str, int] = {}
    for index, item in enumerate(items):
        for at in (*saves(item), *sets(item)):
            first = seen.setdefault(at.text, index)
            if first != index:
                what = f"'{at.text}' is written in two parallel branches"
                body.problems.add("E072", at.mark, what, "give each branch a name of its own")
                body.used.add(at.text)
                return


def read_need(body: Body, keys: Keys, most: int | None, what: str) -> int | Literal["all", "any"]:
    """Read how many must succeed; `most` is how many there are, if known."""
    if "need" not in keys:
        return "all"
    node = keys["need"].value
    words: tuple[Literal["all", "any"], ...] = ("all", "any") if what == "branches" else ("all",)
    text = node.text if isinstance(node, Scalar) else ""
    for word in words:
        if text == word:
            return word
    number = int(text) if text.isascii() and text.isdigit() and len(text) <= 6 else 0
    if number < 1:
        meant = nearest(text, words) if isinstance(node, Scalar) else ""
        guess = f"; did you mean '{meant}'?" if meant else ""
        fix = fix_word(node, meant) if isinstance(node, Scalar) else None
        shown = f"'need' must be {', '.join(words)} or a number, this is {what_is(node)}{guess}"
        body.problems.add("E008", node.mark, shown, f"such as: need: {words[-1]}", fix)
        return "all"
    if most is not None and number > most:
        body.problems.add("E008", node.mark, f"need is {number}, there are only {most} {what}", "write need: all")
    return number


def read_child_failure(keys: Keys) -> Literal["finish", "cancel"]:
    """Read what a failed child does to the others."""
    return "cancel" if keys.word("on_child_failure") == "cancel" else "finish"
