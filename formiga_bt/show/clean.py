"""Words from outside made fit for a terminal or a picture: no control characters, nothing wider than one column."""

from rich.cells import cell_len


def cleaned(text: str, *, ascii_only: bool = False) -> str:
    """Return a text in which each character that is not printable, or not one column wide, is a `?`.

    Args:
        text: a name, a reason, an answer.
        ascii_only: nothing beyond ASCII either.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if _is_fit(c) and (c.isascii() or not ascii_only) else "?" for c in text)


def cut(text: str, width: int, mark: str) -> str:
    """Return a text in at most `width` columns, with `mark` at its end if something is missing."""
    if len(text) <= width:
        return text
    return (text[: max(0, width - len(mark))] + mark)[: max(0, width)]


def _is_fit(character: str) -> bool:
    return character.isprintable() and cell_len(character) == 1
