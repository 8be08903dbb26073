"""`formiga demo` without its processes: the command line, and what is done with signals. Flights are in tests/e2e."""

import signal
from collections.abc import Iterator

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.integrator import demo as verb
from tests.golden import Wording

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in verb.SIGNALS}
    yield
    assert {number: signal.getsignal(number) for number in verb.SIGNALS} == before


@pytest.mark.parametrize("speed", ["0", "21", "-3", "fast"])
def test_a_speed_out_of_range_is_a_usage_error(speed: str, capsys: Capture) -> None:
    assert run(["demo", "--headless", "--speed", speed]) == 2
    assert "--speed" in capsys.readouterr().err


def test_help_says_what_the_speed_means(capsys: Capture, wording: Wording) -> None:
    assert run(["demo", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    wording(text)


def test_an_endpoint_that_cannot_be_is_said_in_words(capsys: Capture, wording: Wording) -> None:
    assert run(["demo", "--headless", "--listen", "tcp/127.0.0.1:x"]) == 1
    wording(capsys.readouterr().err)


def test_a_scenario_that_is_not_there_is_named_with_the_nearest(capsys: Capture, wording: Wording) -> None:
    assert run(["demo", "--scenario", "nosense"]) == 2
    wording(capsys.readouterr().err)


def test_a_signal_is_held_back_while_processes_start() -> None:
    reached = []

    def start() -> None:
        with verb._held_back():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            reached.append("the end")

    with pytest.raises(KeyboardInterrupt):
        start()
    assert reached == ["the end"]


def test_sigterm_leaves_by_way_of_finally_and_nothing_interrupts_that() -> None:
    ended = []

    def live() -> None:
        with verb._signals():
            try:
                signal.raise_signal(signal.SIGTERM)
            finally:
                signal.raise_signal(signal.SIGINT)
                signal.raise_signal(signal.SIGHUP)
                ended.append("in order")

    with pytest.raises(SystemExit) as left:
        live()
    assert left.value.code == 143
    assert ended == ["in order"]
