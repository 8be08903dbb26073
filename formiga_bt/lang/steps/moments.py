"""Steps that address nobody: wait, wait_until, check, set, fail, break_if; and release.

Each function reads the keys of one step and returns its own part of the model; `step` adds the modifiers.
"""

import re
from typing import Final

from msgspec.structs import replace

from formiga_bt.lang.body import Body
from formiga_bt.lang.expressions import narrows, narrows_when_false
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr
from formiga_bt.lang.steps.parts import Part
from formiga_bt.lang.steps.who import read_held
from formiga_bt.lang.text.document import Node
from formiga_bt.lang.text.reading import did_you_mean, read_mapping, read_name, read_text, shorten
from formiga_bt.lang.types import ANY, agent_type
from formiga_bt.lang.written import is_null

_CODE: Final = re.compile(r"[a-z][a-z0-9_]*")


def read_wait(body: Body, keys: Keys) -> Part:
    """Read a pause."""
    return {"duration": body.span(keys["wait"].value, "wait")}


def read_check(body: Body, keys: Keys) -> Part | None:
    """Read a check; what it tests holds in the steps after it."""
    cond = body.cond(keys["check"].value, "check", live=body.watched)
    message = body.text(keys["message"].value, "message") if "message" in keys else None
    if cond is None:
        return None
    body.flow.sure |= narrows(cond)
    return {"cond": cond, "message": message}


def read_set(body: Body, keys: Keys) -> Part | None:
    """Read assignments to vars."""
    mapping = read_mapping(keys["set"].value, body.problems, "set")
    assign: dict[str, Expr] = {}
    for entry in mapping.entries if mapping is not None else ():
        name = entry.key.text
        if name in body.vars and is_null(entry.value):
            of = body.names[name].type
            assign[name] = Expr("null", of, entry.value.mark, lambda _env: None, const=None)
            if name not in body.optional:
                what = f"'{name}' has a value from the beginning, which null cannot take"
                help_ = f"declare it by its type: {name}: {{type: {of.name}}}"
                body.problems.add("E013", entry.value.mark, what, help_)
            continue
        if name in body.vars:
            body.flow.sure |= {name}
            assign[name] = body.value(entry.value, body.names[name].type, name)
            if assign[name].type.is_foreign:
                body.names[name] = replace(body.names[name], type=assign[name].type)
            continue
        kind = body.names[name].origin if name in body.names else "saved name" if name in body.flow.saved else ""
        what = f"'{name}' is a {kind}, only vars can be set" if kind else f"no var is called '{name}'"
        guess = "" if kind else did_you_mean(name, sorted(body.vars))
        body.problems.add("E010", entry.key.mark, what + guess, "declare it under vars:")
        body.used.add(name)
        body.value(entry.value, ANY, name)
    if mapping is not None and not mapping.entries:
        body.problems.add("E044", mapping.mark, "'set' assigns nothing", "set: {name: value}")
    return {"assign": assign} if mapping is not None else None


def read_fail(body: Body, keys: Keys) -> Part:
    """Read a failure; nothing after it runs."""
    part: Part = {"message": body.text(keys["fail"].value, "fail")}
    if "code" in keys:
        at = read_text(keys["code"].value, body.problems, "code")
        if at is not None and not _CODE.fullmatch(at.text):
            body.problems.add(
                "E008", at.mark, f"a code is a snake_case word, this is '{shorten(at.text)}'", "such as: no_buckets"
            )
        elif at is not None:
            part["code"] = at.text
    if "with" in keys:
        part["data"] = _read_data(body, keys["with"].value)
    body.flow.dead = True
    return part


def _read_data(body: Body, node: Node) -> dict[str, Expr]:
    """Read what a failure carries. No agents: who catches it may hold others."""
    data: dict[str, Expr] = {}
    mapping = read_mapping(node, body.problems, "with")
    for entry in mapping.entries if mapping is not None else ():
        name = read_name(entry.key, body.problems, "with")
        value = body.value(entry.value, ANY, entry.key.text)
        if agent_type(value.type).name == "agent":
            help_ = f"carry what is known of it, for example its id: ${{{value.source}.id}}"
            body.problems.add("E008", entry.value.mark, "a failure carries no agents", help_)
        elif name is not None:
            data[name.text] = value
    if mapping is not None and not mapping.entries:
        body.problems.add("E044", mapping.mark, "'with' carries nothing", "with: {spot: ${hit.at}}")
    return data


def read_wait_until(body: Body, keys: Keys) -> Part | None:
    """Read a wait for a live condition, which holds in the steps after it."""
    cond = body.cond(keys["wait_until"].value, "wait_until", live=frozenset())
    if cond is None:
        return None
    body.flow.sure |= narrows(cond)
    return {"cond": cond}


def read_break_if(body: Body, keys: Keys) -> Part | None:
    """Read the way out of the nearest loop."""
    cond = body.cond(keys["break_if"].value, "break_if")
    around, mark = body.around, keys["break_if"].key.mark
    if around is None:
        what = "break_if leaves the nearest loop; there is none here"
        body.problems.add("E040", mark, what, "put it among the steps of a while, repeat or for")
    elif around.barrier:
        what = f"break_if cannot leave the loop at {around.mark.said} from inside {around.barrier}"
        body.problems.add("E040", mark, what, f"save what decides it, and put break_if after {around.barrier}")
    if cond is None:
        return None
    if around is not None:
        left = body.flow.copy()
        left.sure |= narrows(cond)
        around.exits.append(left)
    body.flow.sure |= narrows_when_false(cond)
    return {"cond": cond}


def read_release(body: Body, keys: Keys) -> Part | None:
    """Read the release of an agent, which nothing may use after it."""
    at = read_text(keys["release"].value, body.problems, "release")
    who = read_held(body, at.text, at, at.mark, people=False) if at is not None else None
    if at is None or who is None:
        return None
    body.flow.released.setdefault(at.text, at.mark)
    return {"who": who}
