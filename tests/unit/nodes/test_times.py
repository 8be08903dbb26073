"""Nodes that set deadlines or hold watches say so: only theirs are looked for when a node ends."""

import inspect

import pytest

from formiga_bt.nodes import cleanup, composites, decorators, extra, leaves, live, loops, parallel, request
from formiga_bt.nodes.base import Node

MODULES = (composites, decorators, extra, leaves, live, loops, parallel, request, cleanup)
KINDS = sorted(
    {one for module in MODULES for one in vars(module).values() if inspect.isclass(one) and issubclass(one, Node)},
    key=lambda one: one.__name__,
)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_kind_that_sets_deadlines_says_so(kind: type[Node]) -> None:
    own = "".join(inspect.getsource(one) for one in kind.__mro__ if one in KINDS)
    assert kind.times == ("run.set_deadline(" in own)
    assert kind.watches == any(f"run.watch{word}(" in own for word in ("", "_event", "_agents"))
