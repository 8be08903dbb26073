"""What a generated program may name: the paper's API, three modules, plain builtins. All else is refused before it runs."""

import ast
import builtins
import math
import symtable
from collections.abc import Iterator
from typing import Any, Final

MODULES: Final = {
    "math": tuple(name for name in dir(math) if not name.startswith("_")),
    "time": ("sleep", "time", "monotonic"),
    "threading": ("Thread", "Lock", "RLock", "Event", "Barrier", "Semaphore"),
}
"""Module -> what it has for generated programs."""
API: Final = (
    "select_robot", "action_client", "generic_interaction_client", "GpsToCartesian", "ConvertGotoToGoal", "ConvertGpsToGoal",
    "ConvertReturnGoal", "Cartesian_Coordinates", "find_landing_port", "get_base_station", "task",
)  # fmt: skip
PLAIN: Final = (
    "abs", "all", "any", "bool", "callable", "dict", "divmod", "enumerate", "filter", "float", "frozenset", "int",
    "isinstance", "issubclass", "iter", "len", "list", "map", "max", "min", "next", "object", "pow", "property", "range",
    "repr", "reversed", "round", "set", "slice", "sorted", "staticmethod", "classmethod", "str", "sum", "super", "tuple", "zip",
    "True", "False", "None", "Exception", "ValueError", "TypeError", "RuntimeError", "KeyError", "IndexError", "LookupError",
    "ZeroDivisionError", "ArithmeticError", "OverflowError", "AttributeError", "NameError", "StopIteration", "TimeoutError",
    "NotImplementedError", "AssertionError", "__build_class__",
)  # fmt: skip
GUARDED: Final = ("print", "getattr", "hasattr", "__import__")
_AT_HAND: Final = frozenset({*API, *MODULES, *PLAIN, *GUARDED, "__name__"})
_INNER: Final = (
    "gi_", "cr_", "ag_", "tb_", "f_globals", "f_locals", "f_builtins", "f_back", "f_code", "func_", "co_", "format_map",
)  # fmt: skip
MOST_CHARACTERS: Final = 20_000


def problems(code: str) -> list[str]:
    """Return why a program is not run, in the order of its lines; none: it may start."""
    if len(code) > MOST_CHARACTERS:
        return [f"the program has {len(code)} characters, more than {MOST_CHARACTERS}"]
    try:
        tree = ast.parse(code)
        table = symtable.symtable(code, "<task>", "exec")
        unknown = _unknown(table)
    except (SyntaxError, ValueError) as error:
        where = f"line {error.lineno}: " if isinstance(error, SyntaxError) and error.lineno else ""
        return [f"{where}{error.msg if isinstance(error, SyntaxError) else error}"]
    except (RecursionError, MemoryError):
        return ["the program is nested too deeply"]
    found: dict[tuple[int, str], None] = {}
    for node in ast.walk(tree):
        for text in _wrong(node, unknown):
            found[getattr(node, "lineno", 0), text] = None
    return [f"line {line}: {text}" for line, text in sorted(found)]


def _unknown(top: symtable.SymbolTable) -> set[str]:
    """Return the names that are used and defined nowhere."""
    defined = {
        one.get_name() for one in top.get_symbols() if one.is_assigned() or one.is_imported() or one.is_namespace()
    }
    used: set[str] = set()
    open_tables = [top]
    while open_tables:
        table = open_tables.pop()
        open_tables += table.get_children()
        for one in table.get_symbols():
            if one.is_declared_global() and one.is_assigned():
                defined.add(one.get_name())
            if one.is_referenced() and (one.is_global() or (table is top and not one.is_assigned())):
                used.add(one.get_name())
    return used - defined - _AT_HAND


def _wrong(node: ast.AST, unknown: set[str]) -> Iterator[str]:
    if isinstance(node, ast.Name):
        if node.id in unknown and isinstance(node.ctx, ast.Load):
            yield f"there is no {node.id}"
        elif node.id.startswith("__") and node.id != "__name__":
            yield f"{node.id} is not for tasks"
    elif isinstance(node, ast.Attribute):
        if (node.attr.startswith("__") and node.attr != "__init__") or node.attr.startswith(_INNER):
            yield f".{node.attr} is not for tasks"
        elif isinstance(node.value, ast.Name) and node.value.id in MODULES and node.attr not in MODULES[node.value.id]:
            yield f"there is no {node.value.id}.{node.attr}"
    elif isinstance(node, ast.Import):
        yield from (f"there is no module {one.name}" for one in node.names if one.name not in MODULES)
    elif isinstance(node, ast.ImportFrom):
        names = MODULES.get(node.module or "") if not node.level else None
        if names is None:
            yield f"there is no module {node.module}"
        else:
            yield from (f"there is no {node.module}.{one.name}" for one in node.names if one.name not in names)
    elif isinstance(node, ast.AsyncFunctionDef | ast.Await | ast.AsyncFor | ast.AsyncWith):
        yield "a task is not asynchronous; use threading.Thread"


class _Turned(ast.NodeTransformer):
    """Lets every `while` loop give way, so that one that waits for a variable does not stop the clock for ever."""

    def visit_While(self, node: ast.While) -> ast.While:
        self.generic_visit(node)
        turn = ast.Expr(ast.Call(ast.Name(TURN, ast.Load()), [], []))
        node.body.insert(0, ast.copy_location(turn, node))
        return node


TURN: Final = "__turn__"


def compiled(code: str) -> Any:
    """Return a checked program as code; if nothing is called in it, its last function is, where that needs no values."""
    tree = _Turned().visit(ast.parse(code))
    functions = [one for one in tree.body if isinstance(one, ast.FunctionDef)]
    acts = [
        one for one in tree.body if not isinstance(one, ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom)
    ]
    if functions and not any(isinstance(part, ast.Call) for one in acts for part in ast.walk(one)):
        needed = functions[-1].args.args[: len(functions[-1].args.args) - len(functions[-1].args.defaults)]
        nothing: list[ast.expr] = [ast.Constant(None) for _ in needed]
        if all("preference" in one.arg.lower() for one in needed):
            tree.body.append(ast.Expr(ast.Call(ast.Name(functions[-1].name, ast.Load()), nothing, [])))
    return compile(ast.fix_missing_locations(tree), "<task>", "exec")


def plain_builtins() -> dict[str, Any]:
    """Return the builtins that need no guard."""
    return {name: getattr(builtins, name) for name in PLAIN}
