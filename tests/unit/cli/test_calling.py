"""What verbs say before they call an engine, and how its answers are headed."""

import inspect

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.cli.author.show_out import title_of
from formiga_bt.cli.operator import agents, inbox, tasks, why
from formiga_bt.show.facts import Drawing, FileSpot, TaskFact, TaskPicture
from tests.golden import Wording


def test_an_empty_id_is_told_as_one(wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        why.command("")
    wording(refused.value)


def test_a_task_that_is_held_is_headed_so_until_it_is_over(wording: Wording) -> None:
    drawing = Drawing(task="PickUp", spot=FileSpot("", 0, 0))

    def head(status: str) -> str:
        ended = 9 if status == "FAILED" else None
        task = TaskFact(id="PickUp-3", name="PickUp", status=status, held=("operator",), ended_at=ended)
        return title_of(TaskPicture(at=0, task=task, drawing=drawing, steps=()))

    wording(head("ACTIVE"))
    assert head("FAILED") == "PickUp-3 FAILED  operator"


@pytest.mark.parametrize("verb", [agents, inbox, tasks])
def test_verbs_that_read_ask_an_engine_elsewhere_too(verb: object) -> None:
    options = inspect.signature(verb.command).parameters  # type: ignore[attr-defined]
    assert {"site", "url", "token_file"} <= set(options)
