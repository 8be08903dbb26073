"""What goes into the journal comes back exactly: types, tuples, places."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.base.errors import JournalError
from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import EngineStep, Started, Submit
from formiga_bt.engine.kernel.state import EngineState, snapshot
from formiga_bt.journal.codec import FORMAT, KINDS, Codec, dictionary, learned
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes.run import Failure
from tests.golden import Wording
from tests.replay.missions import MISSIONS
from tests.unit.journal.conftest import folded, steps_of

PLAIN = Codec({}, 0)
PRESSED = Codec({1: dictionary()}, 1)
metres = st.floats(-1e6, 1e6)
places = st.builds(Place, metres, metres)
positions = st.builds(Position, metres, metres, metres)
regions = st.builds(Region, st.lists(places, min_size=3, max_size=6).map(tuple))
failures = st.builds(Failure, code=st.text(max_size=5), reason=st.text(max_size=5), retryable=st.booleans())
scalars = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | places | positions | regions
    | st.builds(AgentRef, st.text(min_size=1)) | failures
)  # fmt: skip
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner) | st.lists(inner).map(tuple) | st.dictionaries(st.text(), inner),
    max_leaves=12,
)


def same(left: Any, right: Any) -> bool:
    """Return whether two values are equal and of equal types all the way down: 1 is not 1.0, a list is no tuple."""
    return repr(left) == repr(right) and left == right


@pytest.mark.parametrize("name", MISSIONS)
def test_every_step_of_every_mission_comes_back_and_its_fold_is_the_same(name: str) -> None:
    steps = steps_of(name)
    for codec in (PLAIN, PRESSED, Codec({1: dictionary(), 7: learned(steps[:100])}, 7)):
        back = [codec.decode(codec.encode(step)) for step in steps]
        assert same(back, list(steps))
    assert snapshot(folded(back)) == snapshot(folded(steps))
    assert same(PRESSED.decode_state(PRESSED.encode_state(folded(steps))), folded(steps))


@given(values)
def test_any_value_of_a_tree_comes_back(value: Any) -> None:
    step = EngineStep(
        1, 2, Submit("T", {"x": value}),
        (ch.VarPut("T-1", "", "x", value), ch.ScopePut("T-1", "s", {"y": [value]}), ch.ScopePut("T-1", "s", None)), (),
    )  # fmt: skip
    state = EngineState(scopes={"T-1": {"": {"x": value}}})
    for codec in (PLAIN, PRESSED):
        assert same(codec.decode(codec.encode(step)), step)
        assert same(codec.decode_state(codec.encode_state(state)), state)


def test_a_value_that_is_no_value_of_a_tree_is_a_bug(wording: Wording) -> None:
    with pytest.raises(AssertionError) as refused:
        PLAIN.encode(EngineStep(1, 2, Submit("T", {"x": {1, 2}}), (), ()))
    wording(refused.value)


def test_kinds_keep_their_names() -> None:
    assert {name: kind.__name__ for name, kind in KINDS.items()} == {
        "place": "Place", "position": "Position", "region": "Region", "agent": "AgentRef", "failure": "Failure",
    }  # fmt: skip


def test_a_later_version_with_more_fields_reads_what_this_one_wrote() -> None:
    class Started2(msgspec.Struct, frozen=True, tag="Started"):
        epoch: int
        host: str = "here"

    data = msgspec.msgpack.encode(Started(3))
    assert msgspec.msgpack.decode(data, type=Started2) == Started2(3, "here")


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda b: b[:-3] + bytes([b[-3] ^ 1]) + b[-2:], "step 9 of the journal is damaged: its checksum is wrong"),
        (
            lambda b: bytes([FORMAT - 1]) + b[1:],
            f"step 9 of the journal is of format {FORMAT - 1}, this version reads {FORMAT}",
        ),
        (lambda b: b[:1] + bytes([9]) + b[2:], "step 9 of the journal cannot be read: 9"),
        (lambda _: b"", "step 9 of the journal is empty"),
    ],
)
def test_bytes_that_are_no_step_are_told(spoil: Any, text: str) -> None:
    blob = PRESSED.encode(steps_of("move_task")[40])
    with pytest.raises(JournalError) as told:
        PRESSED.decode(spoil(blob), "step 9")
    assert str(told.value).startswith(text)
    assert "\n  help: " in str(told.value)


def test_a_lesson_halves_what_steps_take() -> None:
    lesson, steps = steps_of("survey")[:256], steps_of("pick_up")
    taught = Codec({1: learned(lesson)}, 1)
    bare, small = (sum(len(codec.encode(step)) for step in steps) for codec in (PLAIN, taught))
    assert small < bare / 4
