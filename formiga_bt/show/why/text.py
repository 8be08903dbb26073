"""An explanation as text. It needs the facts only, so that `formiga why` prints one without loading the rest."""

from collections.abc import Iterable

from formiga_bt.show.facts import Because


def in_words(headline: str, lines: Iterable[Because]) -> str:
    """Return an explanation as people read it: what explains a line stands indented below it, and what helps once."""
    told = [headline]
    hinted: set[str] = set()
    for line in lines:
        indent = "  " * (line.depth + 1)
        told.append(f"{indent}{line.text}")
        if line.hint and line.hint not in hinted:
            hinted.add(line.hint)
            told.append(f"{indent}    -> {line.hint}")
    return "\n".join(told)
