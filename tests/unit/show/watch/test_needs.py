"""Which machines need a person, on the pane of what does."""

import pytest

from formiga_bt.show.facts import Now, Top
from formiga_bt.show.watch.needs import needs
from formiga_bt.show.watch.text import FULL
from tests.golden import Wording
from tests.unit.show.watch.fake import AT, agent


@pytest.mark.parametrize(
    ("liveness", "quarantine", "listed"),
    [
        ("LOST", "lost", True),
        ("LOST", "removed", False),  # a person has it already
        ("ALIVE", "removed", True),  # switched on again: only a person's word takes it back
    ],
)
def test_one_that_was_removed_needs_nobody_until_it_is_heard_of_again(
    liveness: str, quarantine: str, listed: bool
) -> None:
    machine = agent("hwd_1", liveness=liveness, quarantine=quarantine, pool="QUARANTINED", landed="grounded")
    now = Now(site="meadow", at=AT, top=Top(), counts={}, tasks=(), total=0, agents=(machine,), questions=())
    assert (needs(now, (), 80, FULL).ids == ["agent:hwd_1"]) is listed


def test_one_that_is_there_twice_waits_for_one_of_its_processes_to_end(wording: Wording) -> None:
    machine = agent("hwd_1", quarantine="double", pool="QUARANTINED", landed="grounded")
    now = Now(site="meadow", at=AT, top=Top(), counts={}, tasks=(), total=0, agents=(machine,), questions=())
    rows = needs(now, (), 120, FULL)
    text = "\n".join(str(one) for one in rows[0].lines)
    wording(text)
    assert "clear" not in text
