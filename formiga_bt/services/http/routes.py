"""Routes that answer facts: their shapes are those of the functions' results, and stand so in the OpenAPI document."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, Final, TypeVar

import msgspec
from fastapi import Depends, FastAPI, Response
from msgspec import Struct

from formiga_bt.base.roles import Deed
from formiga_bt.services.http.speaking import require
from formiga_bt.services.http.urgent import in_lane, is_urgent

REF: Final = "#/components/schemas/{name}"
F = TypeVar("F", bound=Callable[..., Struct])


class FactRoutes:
    """Adds routes to an app.

    A function is called in a thread and its answer written there as JSON, so that nobody waits for a slow one. Requests that
    must get through (`urgent`) have threads of their own.
    """

    def __init__(self, app: FastAPI) -> None:
        self.app = app
        self.kinds: set[type[Struct]] = set()
        """Of the answers."""
        self.deeds: dict[tuple[str, str], Deed] = {}
        """What the caller of each route must be allowed, by method and path; some look further."""

    def get(self, path: str, tag: str, may: Deed = Deed.SEE) -> Callable[[F], F]:
        """Add a route that only looks."""
        return self._add("GET", path, tag, may)

    def post(self, path: str, tag: str, may: Deed, status: int = 200) -> Callable[[F], F]:
        """Add a route that changes something; `may` is what its caller must be allowed."""
        return self._add("POST", path, tag, may, status)

    def delete(self, path: str, tag: str, may: Deed) -> Callable[[F], F]:
        """Add a route that ends something."""
        return self._add("DELETE", path, tag, may)

    def guard(self, method: str, path: str, may: Deed) -> list[Any]:
        """Return the dependencies of a route that let in who may do this: before the body is looked at."""

        async def check() -> None:
            require(may)

        self.deeds[method, path] = may
        return [Depends(check)]

    def _add(self, method: str, path: str, tag: str, may: Deed, status: int = 200) -> Callable[[F], F]:
        def put(function: F) -> F:
            kind: type[Struct] = signature(function).return_annotation
            self.kinds.add(kind)

            @wraps(function)
            def answer(*args: Any, **given: Any) -> Response:
                return Response(msgspec.json.encode(function(*args, **given)), status, media_type="application/json")

            schema = {"$ref": REF.format(name=kind.__name__)}
            about = {"description": (kind.__doc__ or "").strip(), "content": {"application/json": {"schema": schema}}}
            self.app.add_api_route(
                path, in_lane(answer) if is_urgent(method, path) else answer, methods=[method], tags=[tag],
                dependencies=self.guard(method, path, may), status_code=status, response_model=None,
                response_class=Response, responses={status: about},
            )  # fmt: skip
            return function

        return put
