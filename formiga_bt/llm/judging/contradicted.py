"""Refusals and questions of a model that the site itself gainsays: `there is no hwd_1 here`, and there is.

A small model gives such a reason when it does not know what to do. It is asked anew.
"""

import re
from typing import Final

from formiga_bt.llm.envelope import ModelAnswer
from formiga_bt.llm.judging.needless import needless
from formiga_bt.llm.words.gainsaid import gainsaid
from formiga_bt.llm.words.only_question import only_question
from formiga_bt.llm.words.spoken import pattern_of
from formiga_bt.llm.words.wording import Words
from formiga_bt.llm.world import RequestWorld

_NO: Final = (
    r"\bno (?:such )?(?:(?:place|spot|region|agent|drone|machine|person|mention|sign|trace|record|entry) )?"
    r"(?:(?:called|named|of|as|like|for) )?(?:the |an? )?"
)


def contradicted(answer: ModelAnswer, world: RequestWorld, words: Words) -> str:
    """Return what is wrong with an answer that holds no tree, "" = nothing.

    Args:
        answer: a question, or why something is impossible.
        world: the site and its fleet.
        words: the request.
    """
    said = answer.question or answer.impossible
    site = world.site
    for name in (*site.places, *site.regions, *site.agents):
        if re.search(_NO + pattern_of(name), said, re.IGNORECASE) is not None:
            return f"the answer says that there is no {name} here, and there is"
    only = only_question(words, world)
    if only is not None:
        who = " and ".join(one.id or f"a {one.type}" for one in only.people)
        return f"the request only wants {who} to be asked, which a task does, and the answer is no task"
    if answer.impossible:
        return gainsaid(answer.impossible, words, world)
    return needless(answer.question, words, world)
