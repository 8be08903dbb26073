"""The OpenAPI document: what FastAPI makes of the routes and their bodies, the shapes of what they answer, and the token.

Simulations on the loopback ask for no token, but compare one that is sent; every other engine asks for it on each route
(`door`).
"""

import ast
import functools
import inspect
import json
import textwrap
import threading
from collections.abc import Iterable
from typing import Any, Final

import msgspec
from fastapi import FastAPI, Response
from msgspec import Struct

from formiga_bt.services.http.routes import REF

SCHEME: Final = "token"
_ABOUT: Final = (
    "The site's token: the file `token` of its runtime folder. At the engine's local socket, stops, aborts, lockdown, "
    "answers and events are taken without it."
)


def serve(app: FastAPI, kinds: Iterable[type[Struct]], *, needs_token: bool) -> None:
    """Serve the document, with the facts that are answered. It is written once: that takes long enough to hold up others."""
    app.openapi_url = "/v1/openapi.json"
    text = functools.cache(
        lambda: json.dumps(completed(app.openapi(), kinds, needs_token=needs_token), ensure_ascii=False).encode()
    )
    one = threading.Lock()  # a crowd that asks at once would have it written by each of its threads

    @app.get(app.openapi_url, include_in_schema=False)
    def openapi() -> Response:
        with one:
            written = text()
        return Response(written, media_type="application/json")


def completed(document: dict[str, Any], kinds: Iterable[type[Struct]], *, needs_token: bool) -> dict[str, Any]:
    """Return the document with the shapes of facts and its security scheme; in each route its summary, and if it wants it."""
    parts = document.setdefault("components", {})
    parts.setdefault("schemas", {}).update(shapes(kinds))
    parts["securitySchemes"] = {SCHEME: {"type": "http", "scheme": "bearer", "description": _ABOUT}}
    wants: list[dict[str, list[str]]] = [{SCHEME: []}] if needs_token else [{}, {SCHEME: []}]
    for path in document["paths"].values():
        for operation in path.values():
            operation["security"] = wants
            operation["summary"] = operation["description"].partition("\n")[0].partition(". ")[0].rstrip(".")
    return document


def shapes(kinds: Iterable[type[Struct]]) -> dict[str, Any]:
    """Return the schemas of facts by name, with what their classes say of each field."""
    _, found = msgspec.json.schema_components(sorted(kinds, key=lambda kind: kind.__name__), ref_template=REF)
    for kind in _reached(kinds):
        fields = found[kind.__name__].get("properties", {})
        for name, text in _field_words(kind).items():
            if "$ref" in fields[name]:
                fields[name] = {"allOf": [fields[name]]}
            fields[name]["description"] = text
    return found


def _reached(kinds: Iterable[type[Struct]]) -> Iterable[type[Struct]]:
    """Return kinds and those of their fields, each once."""
    left, seen = [msgspec.inspect.type_info(kind) for kind in kinds], set[type[Struct]]()
    while left:
        match left.pop():
            case msgspec.inspect.StructType(cls=kind, fields=fields) if kind not in seen:
                seen.add(kind)
                left += [field.type for field in fields]
            case msgspec.inspect.UnionType(types=types):
                left += types
            case msgspec.inspect.VarTupleType(item_type=item) | msgspec.inspect.DictType(value_type=item):
                left.append(item)
            case msgspec.inspect.TupleType(item_types=items):
                left += items
    return seen


def _field_words(kind: type[Struct]) -> dict[str, str]:
    """Return the texts that stand below the fields of a class."""
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(node, ast.ClassDef)
    found = {}
    for field, below in zip(node.body, node.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            found[field.target.id] = inspect.cleandoc(str(ast.literal_eval(below.value)))
    return found
