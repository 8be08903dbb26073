"""Words of an engine made fit for a terminal: machines, people and other clients choose names, reasons and answers.

Characters that steer a terminal, end a line in odd ways, or turn the direction of a text become `?`. Called on whatever comes
in from an engine, so that no verb has to think of it. Texts of several lines stay such.
"""

import json
import re
from typing import Any, Final

_STEERS: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b\u200e\u200f\u2028-\u202e\u2060\u2066-\u2069\ufeff]")
_MAY: Final = re.compile(
    rb"\\u00[0189]|\\u007[fF]|\\u20[026]|\\u[fF]|\\[bfr]|[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\x8b\x8e\x8f\xa8-\xae]|\xe2\x81[\xa0\xa6-\xa9]|\xef\xbb"
)
"""What may stand for one of these in JSON; quick to look for."""


def visible(value: Any) -> Any:
    """Return a text, or what JSON holds, with `?` for each character that is not to be seen."""
    if isinstance(value, str):
        return _STEERS.sub("?", value)
    if isinstance(value, list):
        return [visible(one) for one in value]
    if isinstance(value, dict):
        return {visible(key): visible(one) for key, one in value.items()}
    return value


def visible_json(data: bytes) -> bytes:
    """Return JSON whose texts are visible; as it is, if they are or if it is no JSON."""
    if _MAY.search(data) is None:
        return data
    try:
        return json.dumps(visible(json.loads(data)), ensure_ascii=False).encode("utf-8", "replace")
    except (ValueError, RecursionError):
        return data
