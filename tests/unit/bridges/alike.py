"""A task without places and ways of writing, so that two can be compared for what they say."""

from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import Expr, Room, Subtree, Task
from formiga_bt.lang.types import Type

LEFT_OUT = {"bundle", "covered", "files", "subtrees"}
"""Of a task: what says where it was read, and subtrees (compared where they are called)."""


def said(value: Any) -> Any:
    """Return what a part of a model says."""
    if isinstance(value, Expr):
        what = repr(value.const) if value.is_const else " ".join(value.source.split())
        return (str(value.type), what)
    if isinstance(value, Type):
        return str(value)
    if isinstance(value, Mark | Room):
        return None
    if isinstance(value, Struct):
        left = LEFT_OUT if isinstance(value, Task) else set()
        return {
            "": type(value).__name__,
            **{name: said(getattr(value, name)) for name in value.__struct_fields__ if name not in left},
        }
    if isinstance(value, Mapping):
        return {key: said(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [said(item) for item in value]
    return value


def differences(one: Any, two: Any, path: str = "") -> list[str]:
    """Return the paths at which two values differ."""
    if isinstance(one, dict) and isinstance(two, dict):
        keys = [*one, *(k for k in two if k not in one)]
        return [d for k in keys for d in differences(one.get(k), two.get(k), f"{path}.{k}")]
    if isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        return [d for i, (a, b) in enumerate(zip(one, two, strict=True)) for d in differences(a, b, f"{path}[{i}]")]
    return [] if one == two else [f"{path}: {one!r} != {two!r}"[:300]]


__all__ = ["Subtree", "differences", "said"]
