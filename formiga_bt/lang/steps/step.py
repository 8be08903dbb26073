"""Steps: the kind of each, and its modifiers. Each kind is read in a module beside this one.

`read_steps` is called for each section, branch and subtree body. It walks the steps in the order in which they run,
because what is saved and certain at a step depends on the steps before it.
"""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any, Final

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Fix, Mark
from formiga_bt.lang.body import Body
from formiga_bt.lang.expressions import narrows, narrows_when_false
from formiga_bt.lang.flow import Flow, join
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import KINDS, MODIFIERS, Option, StepKind
from formiga_bt.lang.model import (
    Ask,
    BreakIf,
    Call,
    Check,
    Do,
    Fail,
    Fallback,
    For,
    Guard,
    If,
    Loop,
    Notify,
    Parallel,
    Release,
    Request,
    Sequence,
    Set,
    Step,
    Switch,
    Wait,
    WaitFor,
    WaitUntil,
    WithAgents,
    WithResource,
)
from formiga_bt.lang.naming import an_order
from formiga_bt.lang.steps import ask, blocks, call, do, extra, loops, moments, over_lists, resources, switches
from formiga_bt.lang.steps.blocks import Readers
from formiga_bt.lang.steps.do import as_order
from formiga_bt.lang.steps.requests import read_request
from formiga_bt.lang.steps.retries import read_bound, read_retry
from formiga_bt.lang.text.colons import in_text
from formiga_bt.lang.text.document import Entry, Listing, Mapping_, Node, Scalar
from formiga_bt.lang.text.reading import (
    is_empty,
    read_listing,
    shorten,
    what_is,
)
from formiga_bt.lang.text.synonyms import ADVICE, BY_HAND, KIND_SYNONYMS, is_sure, kind_for
from formiga_bt.lang.walk import begins_anew, roles_inside
from formiga_bt.lang.written import empties, saves

_LOOPS: Final = ("while", "repeat", "for")
_TOGETHER: Final = "mode: parallel"

_CLASSES: Final[Mapping[str, type[Step]]] = MappingProxyType(
    {
        "do": Do,
        "ask": Ask,
        "call": Call,
        "request": Request,
        "wait": Wait,
        "wait_until": WaitUntil,
        "wait_for": WaitFor,
        "check": Check,
        "set": Set,
        "notify": Notify,
        "fail": Fail,
        "release": Release,
        "sequence": Sequence,
        "fallback": Fallback,
        "parallel": Parallel,
        "race": Parallel,
        "if": If,
        "switch": Switch,
        "while": Loop,
        "repeat": Loop,
        "for": For,
        "break_if": BreakIf,
        "guard": Guard,
        "with_agents": WithAgents,
        "with_resource": WithResource,
    }
)


def read_steps(body: Body, node: Node, label: str, key: str) -> tuple[Step, ...]:
    """Read a list of steps that run one after another.

    Args:
        body: the task or subtree.
        node: the list.
        label: prefix of each step's `seg`, for example `then`.
        key: how a message calls the list.
    """
    items = _items(body, node, key)
    found: list[Step] = []
    reported = False
    for index, item in enumerate(items):
        if body.flow.dead and not reported:
            body.problems.add("E043", item.mark, "this step never runs: the step before it always fails", "remove it")
            reported = True
        step = read_step(body, item, f"{label}[{index}]")
        if step is not None:
            found.append(step)
    body.tell(Mark(node.mark.file, node.mark.end_line + 1, node.mark.col))
    return tuple(found)


def _items(body: Body, node: Node, key: str) -> tuple[Node, ...]:
    if is_empty(node) or (isinstance(node, Listing) and not node.items):
        body.problems.add("E044", node.mark, f"'{key}' has no steps", "add a step or remove the key")
        return ()
    items = read_listing(node, body.problems, key)
    if items is None:
        body.drop(node)
    return tuple(items or ())


def read_step(body: Body, node: Node, seg: str) -> Step | None:
    """Read one step; None (reported) if its kind or its main value cannot be read.

    Names in a step with an error count as used: nobody knows what it will be when it is mended.
    """
    before = len(body.problems.found)
    step = _read_step(body, node, seg)
    if body.problems.has_errors(before):
        body.count(node, {at.mark for at in saves(node)})
    return step


def _read_step(body: Body, node: Node, seg: str) -> Step | None:
    body.tell(node.mark)
    if not isinstance(node, Mapping_):
        _report_no_mapping(body, node)
        body.drop(node)
        return None
    node = _steps_under_do(body, node)
    if not any(entry.key.text in KINDS for entry in node.entries):
        node = _mended(body, node)
    kind = _find_kind(body, node)
    if kind is None:
        body.drop(node)
        return None
    if body.optional & body.vars:
        body.flow.sure -= empties(Listing((node,), node.mark))  # from its beginning: it may be done again, or stopped
    known = (Option(kind.name, kind.form, kind.doc), *kind.options, *MODIFIERS)
    with body.problems.within(_label(node, kind)):
        keys = read_keys(node, known, body.problems, f"'{kind.name}'")
        step = _read_modified(body, keys, kind, seg)
    if step is None:
        body.drop(node)
    return step


def _report_no_mapping(body: Body, node: Node) -> None:
    """Report what is no mapping; of a text how it was meant, if a colon would make a step of it or it is an action."""
    what, mended, fix = f"a step is a mapping such as '{an_order(body)}', this is {what_is(node)}", "", None
    if isinstance(node, Scalar) and node.exact and not node.quoted:
        missing, mended = in_text(node.text)
        if missing:
            what = f"{what}; {missing}"
        mended = mended or as_order(body, node.text)
        fix = Fix(node.mark, mended) if mended and "AGENT" not in mended else None
    body.problems.add("E005", node.mark, what, f"write: {mended}" if mended else "", fix)


def _label(node: Mapping_, kind: StepKind) -> str:
    entry = node.get("name") or (node.get(kind.name) if kind.name in ("do", "call") else None)
    value = entry.value if entry is not None else None
    return shorten(value.text) if isinstance(value, Scalar) and value.text else kind.name


def _find_kind(body: Body, node: Mapping_) -> StepKind | None:
    """Return the step's one kind; None if it has none, or (reported) several."""
    present = [entry for entry in node.entries if entry.key.text in KINDS]
    options = {option.name for entry in present for option in KINDS[entry.key.text].options}
    kinds = [entry for entry in present if entry.key.text not in options] or present
    if not kinds:
        return None
    kind = KINDS[kinds[0].key.text]
    if len(kinds) > 1:
        names = " and ".join(entry.key.text for entry in kinds)
        help_ = "begin a new step with '- ' before the second"
        body.problems.add("E005", kinds[1].key.mark, f"a step has one kind, this has {names}", help_)
        return None
    return kind


def _steps_under_do(body: Body, node: Mapping_) -> Mapping_:
    """Report a loop whose steps stand under `do`, and one that says `parallel: true`; return it as it was meant."""
    words = [entry.key.text for entry in node.entries]
    loop = next((word for word in words if word in _LOOPS or KIND_SYNONYMS.get(word) in _LOOPS), "")
    if not loop:
        return node
    entries = []
    for entry in node.entries:
        key, value = entry.key, entry.value
        if key.text == "do" and isinstance(value, Listing) and "steps" not in words:
            what = f"'{loop}' has no option 'do'; did you mean 'steps'?"
            body.problems.add("E004", key.mark, what, "", Fix(key.mark, "steps"))
            entry = Entry(replace(key, text="steps"), value)
        elif key.text == "parallel" and isinstance(value, Scalar):
            fix = Fix(
                Mark(key.mark.file, key.mark.line, key.mark.col, value.mark.end_line, value.mark.end_col), _TOGETHER
            )
            fix_ = fix if value.text == "true" else None
            body.problems.add("E004", key.mark, f"'{loop}' has no option 'parallel'", f"write {_TOGETHER}", fix_)
            continue
        entries.append(entry)
    return Mapping_(tuple(entries), node.mark)


def _mended(body: Body, node: Mapping_) -> Mapping_:
    """Report a step without a known kind; return it with the kind that was meant, if that is known."""
    modifiers = {option.name for option in MODIFIERS}
    unknown = [entry.key for entry in node.entries if entry.key.text not in modifiers]
    if not unknown:
        body.problems.add("E005", node.mark, "a step has one kind, this has none", f"such as: {an_order(body)}")
        return node
    options = {option.name for kind in KINDS.values() for option in kind.options}
    key = next((key for key in unknown if key.text not in options), unknown[0])
    meant = kind_for(key.text, KINDS)
    guess = f"; did you mean '{meant}'?" if meant else ""
    order = "" if meant else as_order(body, key.text)
    known = f"steps: {', '.join(KINDS)}"
    help_ = ADVICE.get(key.text, "" if meant else f"it is an action, write: {order}" if order else known)
    what = f"'{shorten(key.text)}' is not a step{guess}"
    body.problems.add("E006", key.mark, what, help_, _fix_kind(node, key, meant))
    if not meant:
        return node
    mended = (Entry(replace(key, text=meant), e.value) if e.key is key else e for e in node.entries)
    return Mapping_(tuple(mended), node.mark)


def _fix_kind(node: Mapping_, key: Scalar, meant: str) -> Fix | None:
    """Return the fix of a word of another tool; None where another word in its place would mean something else."""
    if not meant:
        return None
    value = next(entry.value for entry in node.entries if entry.key is key)
    if key.text == "wait_while" and isinstance(value, Scalar) and value.exact and not value.quoted and value.text:
        span = Mark(key.mark.file, key.mark.line, key.mark.col, value.mark.end_line, value.mark.end_col)
        return Fix(span, f"wait_until: not ({value.text})")
    if key.text in BY_HAND:
        return None
    return Fix(key.mark, meant) if KIND_SYNONYMS.get(key.text) == meant or is_sure(key.text, meant, KINDS) else None


# --- modifiers ---------------------------------------------------------------------------------------------------


def _read_modified(body: Body, keys: Keys, kind: StepKind, seg: str) -> Step | None:
    """Read when( ignore_failure( timeout( retry( step)))), and follow the names through it."""
    entry = body.flow.copy()
    entry.dead = False
    body.flow = entry.copy()
    common: dict[str, Any] = {"kind": kind.name, "seg": seg, "mark": keys[kind.name].key.mark}
    when = body.cond(keys["when"].value, "when") if "when" in keys else None
    if when is not None:
        body.flow.sure |= narrows(when)
        common["when"] = when
    _read_common(body, keys, common)
    limits = ("timeout" in keys) + (common.get("retry") is not None and common["retry"].attempt_timeout is not None)
    body.bounded += limits
    part = _READERS[kind.name](body, keys)
    body.bounded -= limits
    if part is None:
        return None
    if "ignore_failure" in keys and common["ignore_failure"]:
        failed = body.flow.copy()
        failed.sure, failed.dead = entry.sure, False
        body.flow = join(body.flow, failed)
    if when is not None:
        skipped = body.flow.copy()
        skipped.sure, skipped.dead = entry.sure | narrows_when_false(when), False
        body.flow = join(body.flow, skipped)
    if common.get("retry") is not None:
        common["retry"] = replace(common["retry"], fresh=body.flow.first_saved(entry))
    step = _CLASSES[kind.name](**common, **part)
    if begins_anew(step):
        _check_held(body, entry, step, step.mark if step.retry is None else keys["retry"].key.mark)
    if step.retry is not None and step.retry.agent == "another" and not any(roles_inside((step,))):
        what = "'agent: another' needs a with_agents inside: the agents of the task stay the same"
        body.problems.add("E008", step.retry.mark, what, "put with_agents into the step that is retried")
    return step


def _check_held(body: Body, entry: Flow, step: Step, mark: Mark) -> None:
    """Report E023 for a role that a step gives back which may begin anew, and then no longer has it."""
    again, why = ("a second attempt", "is retried") if step.retry is not None else ("the next turn", "hands over")
    for name in body.flow.released:
        if name not in entry.released:
            what = f"{again} no longer holds '{name}': released at {body.flow.released[name].said}"
            body.problems.add("E023", mark, what, f"release it after the step that {why}")


def _read_common(body: Body, keys: Keys, common: dict[str, Any]) -> None:
    if "name" in keys:
        common["name"] = keys.word("name")
    if "note" in keys:
        common["note"] = body.text(keys["note"].value, "note")
    if "timeout" in keys:
        common["timeout"] = read_bound(body, keys["timeout"].value, "timeout")
    if "retry" in keys:
        common["retry"] = read_retry(body, keys["retry"])
    for flag in ("ignore_failure", "critical"):
        if flag in keys:
            common[flag] = keys.flag(flag)


_INSIDE: Final = Readers(read_steps, read_step, _items)

_READERS: Final[Mapping[str, Callable[[Body, Keys], dict[str, Any] | None]]] = MappingProxyType(
    {
        "do": do.read_do,
        "ask": ask.read_ask,
        "call": call.read_call,
        "request": read_request,
        "wait": moments.read_wait,
        "wait_until": moments.read_wait_until,
        "wait_for": do.read_wait_for,
        "check": moments.read_check,
        "set": moments.read_set,
        "notify": ask.read_notify,
        "fail": moments.read_fail,
        "release": moments.read_release,
        "sequence": partial(blocks.read_sequence, _INSIDE),
        "fallback": partial(blocks.read_fallback, _INSIDE),
        "parallel": partial(blocks.read_parallel, _INSIDE),
        "race": partial(blocks.read_race, _INSIDE),
        "if": partial(blocks.read_if, _INSIDE),
        "switch": partial(switches.read_switch, _INSIDE),
        "while": partial(loops.read_while, _INSIDE),
        "repeat": partial(loops.read_repeat, _INSIDE),
        "for": partial(over_lists.read_for, _INSIDE),
        "break_if": moments.read_break_if,
        "guard": partial(blocks.read_guard, _INSIDE),
        "with_agents": partial(extra.read_with_agents, _INSIDE),
        "with_resource": partial(resources.read_with_resource, _INSIDE),
    }
)
