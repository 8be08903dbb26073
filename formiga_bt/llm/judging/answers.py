"""What a no changes: a task that flies the same whatever people answer does not do what hangs on their answer."""

import re
from collections.abc import Iterator
from typing import Final

from formiga_bt.llm.records import RehearsedFlight, Shortfall
from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import Words

_HANGS: Final = re.compile(
    r"\b(?:if|when|once|as soon as|provided|unless|until|only)\b[^.;]{0,40}\b(?:agrees?|approves?|confirms?|allows?|permits?|"
    r"says? (?:yes|so|ok|okay|it is safe|no)|nods?|yes)\b"
    r"|\b(?:on|after|with|upon) (?:an? |the |her |his |their )?(?:yes|ok|okay|approval|permission|go-ahead)\b|\bpermission\b"
    r"|\bif (?:yes|no|not|so)\b|\bon (?:a )?no\b|\b(?:times|both say) yes\b"
    r"|\b(?:si|cuando|en cuanto|hasta que)\b[^.;]{0,40}\b(?:dice|diga|acept[ae]\w*|aprueba\w*|confirm[ae]\w*|"
    r"est[áé] de acuerdo)\b"
    r"|\bpermiso\b|\bdeben? aceptar\b",
    re.IGNORECASE,
)
_TELLS: Final = re.compile(r"^\s*-?\s*notify:", re.MULTILINE)
_WHATEVER: Final = re.compile(
    r"\b(?:whatever|either way|in (?:any|either) case|regardless|no matter|anyway|diga lo que diga|en cualquier caso|"
    r"de todos modos)\b",
    re.IGNORECASE,
)


def hangs_on_answer(words: Words, yaml: str) -> bool:
    """Return whether a request lets something hang on what people answer; where messages are sent, it may be those."""
    text = unquoted(words.text)
    return (
        _TELLS.search(yaml) is None
        and words.means("ask")
        and _HANGS.search(text) is not None
        and _WHATEVER.search(text) is None
    )


def answers(yes: RehearsedFlight, no: RehearsedFlight) -> Iterator[Shortfall]:
    """Find questions whose answer changes nothing: the same flights, whatever people say.

    Args:
        yes: the dry run in which people agree; it succeeded and somebody was asked.
        no: the dry run in which they do not.
    """
    same = (yes.visited, yes.landed, yes.stands, yes.asked) == (no.visited, no.landed, no.stands, no.asked)
    if same and no.status == yes.status:
        yield Shortfall(
            "answer_ignored",
            "the request lets something hang on an answer, and the machines do the same after a yes and after a no",
            help='{"if": "NAME.answer == \'yes\'", "then": [...]} around what a yes allows, or the ask without "save_as"',
        )
