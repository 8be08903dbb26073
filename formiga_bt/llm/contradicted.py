"""Refusals and questions of a model that the site itself gainsays: `there is no hwd_1 here`, and there is.

A small model gives such a reason when it does not know what to do. It is asked anew.
"""

import re
from typing import Final

from formiga_bt.llm.envelope import Answer
from formiga_bt.llm.spoken import pattern_of
from formiga_bt.llm.world import World

_NO: Final = r"\bno (?:(?:place|spot|region|agent|drone|machine|person) )?(?:(?:called|named) )?(?:the )?"

_CANNOT: Final = re.compile(
    r"\bno verb here can (fly|look|hover|land|take off|go)(?:\s+there)?\s*(?:[.;]|$)", re.IGNORECASE
)


def contradicted(answer: Answer, world: World) -> str:
    """Return what is wrong with an answer that holds no tree, "" = nothing.

    Args:
        answer: a question, or why something is impossible.
        world: the site and its fleet.
    """
    said = answer.question or answer.impossible
    site = world.site
    for name in (*site.places, *site.regions, *site.agents):
        if re.search(_NO + pattern_of(name), said, re.IGNORECASE) is not None:
            return f"the answer says that there is no {name} here, and there is"
    flying = _CANNOT.search(said)
    return f"the answer says that nothing here can {flying[1]}, and drones can" if flying is not None else ""
