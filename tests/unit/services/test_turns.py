"""Turns of threads: short ones while an engine runs, as before afterwards."""

import sys
from contextlib import suppress

import pytest

from formiga_bt.services.thread_switching import SWITCH_S, short_turns


def test_turns_are_short_inside_and_as_before_after_it_whatever_happens() -> None:
    before = sys.getswitchinterval()
    with short_turns():
        assert sys.getswitchinterval() == pytest.approx(SWITCH_S)
    assert sys.getswitchinterval() == before
    with suppress(KeyError), short_turns():
        raise KeyError("an engine that fails")
    assert sys.getswitchinterval() == before
