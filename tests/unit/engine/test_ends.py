"""What the engine tells of the ends of steps: once each, with how and why, and nothing else depends on it."""

from msgspec import json

from formiga_bt.engine.kernel import changes as ch
from tests.unit.engine.yard import CART, Yard

NUMBER = "params: {n: {type: number, default: 1}}\n"


def ends(bench: Yard) -> list[tuple[str, str, str]]:
    """Return every end told, in order."""
    return [
        end
        for step in bench.steps
        for change in step.changes
        if isinstance(change, ch.NodesEnded)
        for end in change.ended
    ]


def flown(steps: str, *ends_of_goals: str) -> Yard:
    bench = Yard(CART + NUMBER + f"steps: [{steps}]")
    bench.cart.auto.update(Move=1.0, Home=1.0)
    bench.cart.ends += ends_of_goals
    bench.start()
    assert bench.run_until_ended()
    bench.check()
    return bench


def test_a_step_and_its_section_tell_how_they_ended() -> None:
    bench = flown("{do: cart.Move}, {check: n > 0}, {check: n > 2}")

    assert ends(bench) == [
        ("steps/steps[0]", "S", ""),
        ("steps/steps[1]", "S", ""),
        ("steps/steps[2]", "F", "check"),
        ("steps", "F", "check"),
    ]


def test_a_false_when_is_skipped_and_each_attempt_ends() -> None:
    bench = flown("{do: cart.Move, when: n > 2}, {do: cart.Move, retry: {attempts: 3}, ignore_failure: true}", "stuck")

    told = [end for end in ends(bench) if end[0].startswith("steps")]
    assert told == [
        ("steps/steps[0]", "K", ""),
        ("steps/steps[1]@1", "F", "failed:stuck"),
        ("steps/steps[1]@2", "S", ""),
        ("steps", "S", ""),
    ]


def test_a_step_that_its_timeout_ends_is_stopped_then_failed() -> None:
    bench = flown("{sequence: [{wait: 10 s}], timeout: 2 s, ignore_failure: true}")

    told = [end for end in ends(bench) if end[0].startswith("steps")]
    assert told == [
        ("steps/steps[0].sequence[0]", "H", ""),
        ("steps/steps[0]", "H", ""),
        ("steps/steps[0]", "F", "timeout"),
        ("steps", "S", ""),
    ]


def test_a_sequence_ends_after_its_finally_and_an_item_tells_nothing() -> None:
    bench = flown(
        "{sequence: [{check: n > 0}], finally: [{do: cart.Move}]}, {for: {m: [1, 2]}, mode: parallel, steps: [{check: m > 0}]}"
    )

    assert [path for path, _, _ in ends(bench)] == [
        "steps/steps[0].sequence[0]",
        "steps/steps[0].finally[0]",
        "steps/steps[0]",
        "steps/steps[1].for#1.steps[0]",
        "steps/steps[1].for#2.steps[0]",
        "steps/steps[1]",
        "steps",
    ]


def test_an_aborted_task_tells_what_was_stopped() -> None:
    bench = Yard(CART + "steps: [{sequence: [{do: cart.Move}]}, {do: cart.Home}]")
    one = bench.start()
    bench.abort(one)
    bench.run_for(5)

    assert ends(bench) == [
        ("steps/steps[0].sequence[0]", "H", ""),
        ("steps/steps[0]", "H", ""),
        ("steps", "H", ""),
    ]


def test_a_step_that_ends_nothing_has_no_such_change() -> None:
    bench = Yard(CART + "steps: [{do: cart.Move}]")
    bench.start()

    assert ends(bench) == []


def test_an_end_can_be_written_and_read_again() -> None:
    told = ch.NodesEnded("T-1", (("steps/steps[0]@2", "F", "timeout"), ("steps", "F", "timeout")))

    assert json.decode(json.encode(told), type=ch.Change) == told
