"""Reason codes that a case may expect: those of the closed tables of `docs/reasons.md`, and their open forms.

`failed:<word>` is an agent's own word or that of a `fail` step, which may stand alone too; `request:<code>` is the end of a
task that was requested. Whoever reads a case, and whoever writes one of what happened (`formiga_bt.show.replay.case`), asks
here.
"""

import re
from collections.abc import Collection
from functools import cache
from typing import Final

from formiga_bt.base.diagnostics import Fix
from formiga_bt.lang.pages import reasons
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import IDENTIFIER, Problems, did_you_mean, fix_word, shorten
from formiga_bt.lang.text.synonyms import nearest, surely

FAILED: Final = "failed:"
REQUEST: Final = "request:"
_TABLES: Final = ("Why a step failed", "Why a task ended", "Limits of the safety envelope")
_LIMIT: Final = "envelope."
_ADMISSION: Final = ("lockdown", "not_approved", "busy", "unknown_task", "missing_param", "bad_var", "too_deep", "too_many",
                     "canceled")  # fmt: skip
"""After `request:`, besides the codes of a task's end."""
_WRITABLE: Final = re.compile(r"(?:[a-z_]+:)*[A-Za-z][A-Za-z0-9_]*|envelope\.[a-z_]+")


@cache
def known_codes() -> tuple[str, ...]:
    """Return the codes of the closed tables, open forms left out."""
    codes = (code for reason in reasons() if reason.group in _TABLES for code in reason.codes)
    return tuple(dict.fromkeys(code for code in codes if "<" not in code))


def read_code(at: Scalar, own: Collection[str], problems: Problems) -> str:
    """Return the code that a case expects, or "" if it was reported.

    Args:
        at: what is written.
        own: the words that the task's `fail` steps and the case's own failures say.
        problems: where to report.
    """
    start, text = "", at.text
    while text.startswith(REQUEST):
        start, text = start + REQUEST, text.removeprefix(REQUEST)
    known = (*known_codes(), *(_ADMISSION if start else ()))
    if text in known or text in own or (text.startswith(FAILED) and text != FAILED):
        return at.text
    limits = [code for code in known if code.startswith(_LIMIT)]
    if text in (_LIMIT, _LIMIT[:-1]):
        problems.add("E008", at.mark, f"'{at.text}' does not say which limit", f"one of {', '.join(limits)}")
    elif text in (REQUEST[:-1], ""):
        what = f"'{shorten(at.text) or 'code'}' does not say how the requested task ended"
        problems.add("E008", at.mark, what, "for example request:timeout, or request:failed:blocked")
    elif not (IDENTIFIER.match(text) or text.startswith(_LIMIT)):
        what = f"'{shorten(at.text)}' is no reason code{did_you_mean(text, known)}"
        problems.add(
            "E008", at.mark, what, "a code of docs/reasons.md, or a word", _fix(at, start, surely(text, known))
        )
    else:
        meant = _LIMIT + text if _LIMIT + text in known else nearest(text, known)
        if not meant and not text.startswith(_LIMIT):
            return at.text  # an agent's own word
        guess = f"; did you mean '{start}{meant}'?" if meant else ""
        help_ = (
            f"limits: {', '.join(limits)}"
            if text.startswith(_LIMIT)
            else f"an agent's own word is {start}{FAILED}{text}"
        )
        sure = meant if meant == _LIMIT + text else surely(text, known)
        problems.add(
            "E010", at.mark, f"no reason code is called '{shorten(at.text)}'{guess}", help_, _fix(at, start, sure)
        )
    return ""


def is_code(expected: str, came: str) -> bool:
    """Return whether a task's code is the expected one; an agent's own word may stand without `failed:`."""
    start, colon, word = expected.rpartition(":")
    return came in (expected, f"{start}{colon}{FAILED}{word}")


def written_code(code: str) -> str:
    """Return a task's code as a case expects it, or "" for one that a case cannot say."""
    if not _WRITABLE.fullmatch(code):
        return ""
    word = code.removeprefix(FAILED)
    if word == code or not IDENTIFIER.match(word):
        return code
    return code if nearest(word, known_codes()) or word in (REQUEST[:-1], _LIMIT[:-1]) else word


def _fix(at: Scalar, start: str, meant: str) -> Fix | None:
    return fix_word(at, start + meant if meant else "")
