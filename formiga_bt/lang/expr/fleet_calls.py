"""The call of `fleet('picker')`: its argument is the name of an agent type, written out, so that a type is known to it.

Called by the checker.
"""

import ast

from formiga_bt.lang.expr.scope import Scope
from formiga_bt.lang.expr.typed import Mismatch, closest, sure_of
from formiga_bt.lang.types import Type, list_of


def type_of(agent_type: str, scope: Scope) -> Type:
    """Return the type of `fleet(agent_type)`."""
    return list_of(Type("agent", of=_with_extensions(agent_type, scope) or (agent_type,), foreign=True))


def why_no_type(node: ast.expr | None, written: str, text: str | None, scope: Scope) -> Mismatch | None:
    """Return why an argument names no agent type, or None.

    Args:
        node: the only argument, None if there is none or more than one.
        written: its source.
        text: what it says, if it is a text in quotes.
        scope: knows the agent types.
    """
    types = tuple(scope.agent_types)
    listed = f"types: {', '.join(types)}" if types else ""
    if node is None:
        return Mismatch(
            "E012", "fleet takes the name of one agent type", f"such as: fleet('{types[0]}')" if types else ""
        )
    if text is None:
        mended = f"'{written}'" if written in types else None
        said = "fleet takes the name of an agent type in quotes"
        return Mismatch("E012", said, f"write fleet('{written}')" if mended else listed, mended)
    if types and text not in types:
        near, sure = closest(text, types), sure_of(text, types)
        said = f"no agent type is called '{text}'" + (f"; did you mean '{near}'?" if near else "")
        return Mismatch("E020", said, listed, f"'{sure}'" if sure else None)
    return None


def _with_extensions(agent_type: str, scope: Scope) -> tuple[str, ...]:
    return tuple(name for name, spec in scope.agent_types.items() if name == agent_type or agent_type in spec.extends)
