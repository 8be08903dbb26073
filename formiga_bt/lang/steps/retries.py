"""The `retry` of a step, and bounds in time."""

from formiga_bt.base.diagnostics import Fix
from formiga_bt.lang.body import Body
from formiga_bt.lang.codes import read_code
from formiga_bt.lang.keyed import Keys, read_keys
from formiga_bt.lang.kinds import RETRY
from formiga_bt.lang.model import Expr, Retry
from formiga_bt.lang.text.colons import in_text
from formiga_bt.lang.text.document import Entry, Node, Scalar
from formiga_bt.lang.text.reading import read_mapping, read_text, what_is
from formiga_bt.lang.types import DURATION, INT, NUMBER


def read_bound(body: Body, node: Node, key: str) -> Expr:
    """Read a duration that must be longer than nothing."""
    expr = body.value(node, DURATION, key)
    if expr.is_const and isinstance(expr.const, int | float) and expr.const <= 0:
        body.problems.add("E008", expr.mark, f"'{key}' must be longer than 0 s")
    return expr


def read_retry(body: Body, entry: Entry) -> Retry | None:
    """Read `retry`, or return None if it says nothing that can be used."""
    node = entry.value
    if isinstance(node, Scalar) and not any(in_text(node.text)):
        is_number = node.text.isdecimal() or "${" in node.text
        mend = f"{{attempts: {node.text if is_number else 3}}}"
        what = f"'retry' must be a mapping, this is {what_is(node)}"
        fix = Fix(node.mark, mend) if is_number and entry.key.text == "retry" else None
        body.problems.add("E008", node.mark, what, f"write {mend}", fix)
        return None
    mapping = read_mapping(node, body.problems, "retry")
    if mapping is None:
        return None
    keys = read_keys(mapping, RETRY, body.problems, "'retry'")
    if "attempts" not in keys:
        return None
    attempts = body.value(keys["attempts"].value, INT, "attempts")
    if attempts.is_const and isinstance(attempts.const, int) and attempts.const < 1:
        body.problems.add("E008", attempts.mark, "'attempts' counts the first one, so it is at least 1")
    on, unless = _codes(body, keys, "on"), _codes(body, keys, "unless")
    for code in on:
        if code in unless:
            keys.wrong("unless", "E008", f"'{code}' stands in 'on' and in 'unless'", "one of them")
    return Retry(
        attempts,
        body.span(keys["delay"].value, "delay") if "delay" in keys else None,
        body.value(keys["backoff"].value, NUMBER, "backoff") if "backoff" in keys else None,
        read_bound(body, keys["attempt_timeout"].value, "attempt_timeout") if "attempt_timeout" in keys else None,
        "another" if keys.word("agent") == "another" else "same",
        entry.key.mark,
        on,
        unless,
    )


def _codes(body: Body, keys: Keys, key: str) -> tuple[str, ...]:
    """Return the reason codes of a list; what no failure can be called is reported."""
    items = keys.listed(key, such_as="[timeout]")
    return tuple(
        code
        for at in (read_text(item, body.problems, key) for item in items)
        if at is not None and (code := read_code(at, (), body.problems))
    )
