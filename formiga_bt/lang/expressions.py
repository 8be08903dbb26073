"""Expressions and values of the task language: text in, typed and compiled `Expr` with diagnostics out.

The loader's door to the expression compiler; see `expression_text`, `checker` and `values` for the parts.
"""

from collections.abc import Mapping

from formiga_bt.diagnostics import Diagnostic
from formiga_bt.lang.document import Node, Scalar
from formiga_bt.lang.model import AgentType, Expr, Site
from formiga_bt.lang.types import Type


class Scope:
    """The names that are visible at a place of a task, with their types."""

    def __init__(
        self,
        names: Mapping[str, Type],
        *,
        agent_types: Mapping[str, AgentType] | None = None,
        roles: frozenset[str] = frozenset(),
        maybe_unset: Mapping[str, str] | frozenset[str] = frozenset(),
        site: Site | None = None,
    ) -> None:
        raise NotImplementedError

    def with_names(self, more: Mapping[str, Type]) -> "Scope":
        """Return a child scope with more names."""
        raise NotImplementedError

    def narrowed(self, set_names: frozenset[str]) -> "Scope":
        """Return this scope where these names are known to be set."""
        raise NotImplementedError


def compile_expr(
    source: str, at: Scalar, offset: int, scope: Scope, expected: Type | None
) -> tuple[Expr, list[Diagnostic]]:
    """Compile the expression `source`, found at `at.text[offset:]`; on an error the Expr has the type ANY."""
    raise NotImplementedError


def compile_cond(at: Scalar, scope: Scope) -> tuple[Expr, list[Diagnostic]]:
    """Compile a condition key: one bare expression of type bool."""
    raise NotImplementedError


def compile_value(
    node: Node, scope: Scope, expected: Type, *, what: str = "", optional: bool = False
) -> tuple[Expr, list[Diagnostic]]:
    """Compile a value of an expected type. `what` names the key in messages; `optional`: it may be absent."""
    raise NotImplementedError


def narrows(expr: Expr) -> frozenset[str]:
    """Return the names that are certainly set when the condition is true."""
    raise NotImplementedError


def narrows_when_false(expr: Expr) -> frozenset[str]:
    """Return the names that are certainly set when the condition is false."""
    raise NotImplementedError


def fits(have: Type, want: Type) -> bool:
    """Return whether a value of type `have` may stand where `want` is due."""
    raise NotImplementedError
