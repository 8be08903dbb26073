"""Requests that must get through whatever else is asked: stops, lockdown, aborts, answers, and what people tell of themselves.

They have threads of their own, and their part of the places at each door (`crowd`).
"""

import asyncio
import re
from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, Final

THREADS: Final = 16
"""So many urgent requests of one door are worked on at once."""
_PATHS: Final = (
    ("POST", re.compile(r"/v1/(?:orders|lockdown)")),
    ("POST", re.compile(r"/v1/agents/[^/]+/(?:orders|events)")),
    ("POST", re.compile(r"/v1/tasks/[^/]+/(?:orders|abort)")),
    ("DELETE", re.compile(r"/v1/tasks/[^/]+")),
    ("POST", re.compile(r"/v1/inbox/[^/]+/answer")),
    ("POST", re.compile(r"/v1/alarms/[^/]+/ack")),
)


def is_urgent(method: str, path: str) -> bool:
    """Return whether a request must get through."""
    return any(method == verb and pattern.fullmatch(path) for verb, pattern in _PATHS)


def in_lane(route: Callable[..., Any]) -> Callable[..., Any]:
    """Return a route that runs in the event loop's default threads, which are kept for urgent requests (`server`).

    Plain routes run in other threads, those of FastAPI.
    """

    @wraps(route)
    async def run(**given: Any) -> Any:
        return await asyncio.to_thread(route, **given)

    run.__signature__ = signature(route)  # type: ignore[attr-defined]
    del run.__wrapped__  # FastAPI would take it for a function without `await`
    return run
