"""Mistakes of people (`benchmarks/mistakes.py` measures them all): what the checker says of each is pinned."""

import pytest

from tests.mistakes.book import BASES, HERE, base_text, mistakes, played, said

SAID = HERE / "said.txt"


@pytest.mark.parametrize("base", BASES)
def test_the_task_without_a_mistake_is_good(base: str) -> None:
    assert said(base, base_text(base)) == []
    assert played(base, base_text(base)) == []


def test_each_mistake_can_be_made() -> None:
    assert len(mistakes()) >= 150
    for mistake in mistakes():
        assert mistake.text != base_text(mistake.base)


def test_what_is_said_of_each(wording) -> None:
    told = [f"{' '.join(said(one.base, one.text)) or '-'} | {one.base}: {one.wrong}" for one in mistakes()]
    wording.file(SAID, "\n".join(told) + "\n")
