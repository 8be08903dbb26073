"""The person at the keyboard of `formiga demo --ask-me`: what is shown, and what a typed line means."""

from types import SimpleNamespace
from typing import Any

import pytest

from formiga_bt.cli.integrator.keyboard import Keyboard
from formiga_bt.transport.desk import ConfirmFields, OpenQuestion
from tests.golden import Wording


class Desk:
    """Records answers; says `bad_option` to words that are none."""

    def __init__(self) -> None:
        self.answered: list[tuple[str, str]] = []

    def answer(self, goal_id: str, option: str) -> str | None:
        if option not in ("clear", "wait"):
            return f"bad_option: '{option}' is none of clear, wait"
        self.answered.append((goal_id, option))
        return None


def question(number: str, asked_at: int) -> OpenQuestion:
    ask = ConfirmFields(question=f"May {number} go?", options=("clear", "wait"), number=number)
    return OpenQuestion(
        goal_id=f"goal-{number}", person="watcher_1", person_name="", task_id="T-1", asked_at=asked_at, ask=ask
    )


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def keyboard(desk: Desk, said: list[str]) -> Keyboard:
    """Without a terminal: pytest's standard input is none."""
    demo: Any = SimpleNamespace(
        open_questions=lambda: (question("Q2", 20), question("Q1", 10)), host=SimpleNamespace(desk=desk)
    )
    return Keyboard(demo, SimpleNamespace(say=said.append))  # type: ignore[arg-type]


def test_each_question_is_told_once_oldest_first_with_the_command_that_answers(
    keyboard: Keyboard, said: list[str], wording: Wording
) -> None:
    keyboard.look()
    keyboard.look()

    wording(said)


@pytest.mark.parametrize(
    ("line", "answered"),
    [("clear", ("goal-Q1", "clear")), ("Q2 wait", ("goal-Q2", "wait")), ("q2  clear", ("goal-Q2", "clear"))],
)
def test_a_line_answers_the_oldest_question_or_the_one_it_names(
    keyboard: Keyboard, desk: Desk, line: str, answered: tuple[str, str]
) -> None:
    keyboard._lines.put(line)
    keyboard.look()

    assert desk.answered == [answered]


def test_a_word_that_is_no_option_is_told(keyboard: Keyboard, desk: Desk, said: list[str], wording: Wording) -> None:
    keyboard._lines.put("go on")
    keyboard.look()

    assert desk.answered == []
    wording(said[-1])
