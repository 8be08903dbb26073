"""The OpenAPI document: what FastAPI makes of the routes, how each refuses, and whether it wants the site's token.

Simulations on the loopback ask for none, but compare one that is sent; every other engine asks for it on each route (`door`).
"""

import functools
import json
from typing import Any, Final

from fastapi import FastAPI, Response

from formiga_bt.services.replies.models import Problem

SCHEME: Final = "token"
_REFUSALS: Final = {"4XX": "Client Error", "5XX": "Server Error"}
_ABOUT: Final = (
    "The site's token: the file `token` of its runtime folder. At the engine's local socket, stops, aborts, lockdown, "
    "answers and events are taken without it."
)


def serve(app: FastAPI, *, needs_token: bool) -> None:
    """Serve the document. It is written once: writing it takes long enough to hold up others."""
    app.openapi_url = "/v1/openapi.json"
    text = functools.cache(
        lambda: json.dumps(secured(refusing(app.openapi()), needs_token=needs_token), ensure_ascii=False).encode()
    )

    @app.get(app.openapi_url, include_in_schema=False)
    def openapi() -> Response:
        return Response(text(), media_type="application/json")


def refusing(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with the answers of each route that refuses.

    Added here, because FastAPI would build a model of them for each route, at each start of an engine.
    """
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    schemas["Problem"] = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    content = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
    for path in document["paths"].values():
        for operation in path.values():
            for status, description in _REFUSALS.items():
                operation["responses"][status] = {"description": description, "content": content}
    return document


def secured(document: dict[str, Any], *, needs_token: bool) -> dict[str, Any]:
    """Return the document with its security scheme, and in each route whether it wants it."""
    scheme = {"type": "http", "scheme": "bearer", "description": _ABOUT}
    document.setdefault("components", {})["securitySchemes"] = {SCHEME: scheme}
    wants: list[dict[str, list[str]]] = [{SCHEME: []}] if needs_token else [{}, {SCHEME: []}]
    for path in document["paths"].values():
        for operation in path.values():
            operation["security"] = wants
    return document
