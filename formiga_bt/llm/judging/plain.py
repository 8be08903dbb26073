"""A task's file and a request as the comparison reads them."""

import re
from typing import Final

_NOT: Final = re.compile(
    r"\b(?:not|never|avoid|avoids|without|except|don't|instead of|rather than|ei|älä)\b", re.IGNORECASE
)


def code_of(text: str) -> str:
    """Return a file without its comments and its texts for people."""
    lines = (line.split("  #")[0] for line in text.splitlines() if not line.lstrip().startswith("#"))
    return "\n".join(line for line in lines if not re.match(r"\s*-?\s*(?:ask|notify|description|note|name):", line))


def is_refused(request: str, said: str) -> bool:
    """Return whether something may be named because it is not wanted."""
    at = request.find(said)
    return _NOT.search(request[max(0, at - 40) : at]) is not None
