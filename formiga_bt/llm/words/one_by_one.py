"""Whether a request wants no two machines in the air at one time: `never both in the air`, `only one flies at a time`.

What is said of one place only (`never both in the air over the camp`) is another matter.
"""

import re
from typing import Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import Words

_UP: Final = (
    r"(?:in\s+the\s+air|airborne|aloft|flying|up\s+there)\b"
    r"(?!\s+(?:over|above|at\s+(?!once|a\s+time|one\s+time|the\s+same)|near|within)\b)"
)
_UP_ES: Final = r"(?:en\s+el\s+aire|en\s+vuelo|volando)\b(?!\s+(?:sobre|encima|cerca|junto|en)\b)"
_SEVERAL: Final = r"(?:both|two|three|all|together|more\s+than\s+one)"
_SEVERAL_ES: Final = r"(?:(?:los|las)\s+)?(?:dos|tres|ambos|ambas|m[aá]s\s+de\s+un[oa])"
_NEVER: Final = re.compile(
    rf"\b(?:never|not|no|nor|without|cannot)\b(?:\s+(?!if\b|when\b|until\b)[\w']+){{0,3}}?\s+{_SEVERAL}\b(?:\s+[\w']+){{0,4}}?\s+{_UP}"
    rf"|\bno\s+two\b(?:\s+[\w']+){{0,5}}?\s+{_UP}"
    rf"|\bonly\s+(?:ever\s+)?one\b(?:\s+(?!of\s+the\s+people)[\w']+){{0,4}}?\s+{_UP}"
    r"|\bonly\s+(?:ever\s+)?one(?:\s+(?:drone|machine|of\s+them))?\s+(?:flies|may\s+fly|is\s+to\s+fly)\s+at\s+(?:a|any)\s+(?:one\s+)?time\b"
    rf"|\b(?:nunca|jam[aá]s|no|sin\s+que)\b(?:\s+\w+){{0,3}}?\s+{_SEVERAL_ES}\b(?:\s+\w+){{0,4}}?\s+{_UP_ES}"
    rf"|\bs[oó]lo\s+un[oa]\b(?:\s+\w+){{0,4}}?\s+{_UP_ES}",
    re.IGNORECASE,
)


def certainly_one_by_one(words: Words) -> bool:
    """Return whether a request says that no two machines are in the air at one time."""
    return _NEVER.search(unquoted(words.text)) is not None
