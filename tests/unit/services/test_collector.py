"""Garbage collection of a long-running engine: what is set aside, what it costs, and that it ends."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from formiga_bt.services import collector as module
from formiga_bt.services.collector import THRESHOLDS, Collector, uncollected

pytestmark = pytest.mark.usefixtures("set_aside_again")


class Thing:
    """Something that can be in a circle."""

    def __init__(self) -> None:
        self.other: Thing | None = None


@pytest.fixture
def collector() -> Iterator[Collector]:
    with Collector() as one:
        yield one


def test_what_a_full_look_found_alive_is_not_looked_at_again(collector: Collector) -> None:
    kept = [Thing() for _ in range(1000)]
    gc.collect()
    assert sum(type(one) is Thing for one in gc.get_objects()) == 0
    assert gc.get_freeze_count() > len(kept)
    assert collector.statistics().looks == 1
    assert collector.statistics().longest_s > 0.0


def test_what_is_set_aside_is_freed_when_nobody_refers_to_it(collector: Collector) -> None:
    thing = Thing()
    gc.collect()
    gone = weakref.ref(thing)
    del thing
    assert gone() is None
    assert collector.statistics().looks == 1


def test_a_circle_that_was_set_aside_is_found_once_everything_is_looked_at(
    collector: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    a, b = Thing(), Thing()
    a.other, b.other = b, a
    gc.collect()
    gone = weakref.ref(a)
    del a, b
    gc.collect()
    assert gone() is not None
    assert not collector.is_due
    monkeypatch.setattr(module, "THAW_EVERY_S", 0.0)
    assert collector.is_due
    collector.thaw()
    assert gone() is None


def test_afterwards_all_is_as_before() -> None:
    before, callbacks = gc.get_threshold(), list(gc.callbacks)
    with Collector():
        assert gc.get_threshold() == THRESHOLDS
    assert gc.get_threshold() == before
    assert gc.callbacks == callbacks
    assert gc.get_freeze_count() == 0


def test_nothing_is_collected_while_all_that_is_made_stays() -> None:
    with uncollected():
        assert not gc.isenabled()
        with uncollected():
            pass
        assert not gc.isenabled(), "as it was before"
    assert gc.isenabled()
