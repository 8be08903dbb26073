"""What several kinds of steps share: the keys of one step, its part of the model, the name that it saves."""

from collections.abc import Mapping
from typing import Any

from formiga_bt.lang.body import Body
from formiga_bt.lang.keyed import Keys
from formiga_bt.lang.model import Expr
from formiga_bt.lang.own_names import is_free
from formiga_bt.lang.text.document import Node, Scalar
from formiga_bt.lang.text.reading import did_you_mean, fix_word, quoted_list, read_name, shorten
from formiga_bt.lang.text.synonyms import surely
from formiga_bt.lang.types import Type

Part = dict[str, Any]
"""Keyword arguments of the step's class."""


def unknown_argument(body: Body, code: str, key: Scalar, known: Mapping[str, Any], owner: str, noun: str) -> None:
    """Report a field or param that the owner does not have."""
    meant = surely(key.text, known)
    help_ = f"{noun}s: {quoted_list(known)}" if known else f"it has no {noun}s"
    what = f"{owner} has no {noun} '{shorten(key.text)}'{did_you_mean(key.text, known)}"
    body.problems.add(code, key.mark, what, help_, fix_word(key, meant))


def read_save(body: Body, node: Node, of: Type) -> str:
    """Read `save_as` and define the name from here on."""
    at = read_name(node, body.problems, "save_as")
    if at is None:
        return ""
    return body.save(at, of) if is_free(at, body.problems) else ""


def read_expect(body: Body, keys: Keys, result: Type) -> Expr | None:
    """Read `expect`, which sees `result`."""
    if "expect" not in keys:
        return None
    with body.with_names({"result": result}):
        return body.cond(keys["expect"].value, "expect")
