"""`formiga show`, drawn from hand-made models."""

from typing import Any

import pytest

from formiga_bt.base.diagnostics import Mark
from formiga_bt.lang.model import (
    Ask,
    Call,
    Do,
    Expr,
    If,
    Param,
    Request,
    Retry,
    Role,
    Sequence,
    Some,
    Step,
    Subtree,
    Task,
    Wait,
    Who,
    WithAgents,
)
from formiga_bt.lang.types import ANY, DISTANCE, PLACE
from formiga_bt.show.facts import StepFact
from formiga_bt.show.tree.drawing import cut, drawing_of
from formiga_bt.show.tree.phrases import source
from formiga_bt.show.tree.terminal import draw
from tests.golden import Wording


def at(line: int, file: str = "trees/Fetch.yaml") -> Mark:
    return Mark(file, line, 1)


def expr(text: str) -> Expr:
    return Expr(text, ANY, at(1), lambda _env: None)


def block_with(role: Role) -> Task:
    wait = Wait(kind="wait", seg="steps[0]", mark=at(9), duration=expr("5 s"))
    block = WithAgents(kind="with_agents", seg="steps[0]", mark=at(7), roles={role.name: role}, steps=(wait,))
    return Task("Look", at(2), (block,))


@pytest.mark.parametrize(
    ("role", "shown"),
    [
        (Role("relief", ("lwd",), at(8)), "with_agents relief: lwd"),
        (Role("all_of", ("lwd",), at(8), open=Some()), "with_agents all_of: all x lwd"),
        (Role("few", ("hwd", "lwd"), at(8), open=Some(1, 4)), "with_agents few: 1 to 4 x hwd or lwd"),
        (Role("many", ("lwd",), at(8), open=Some(2)), "with_agents many: 2 or more x lwd"),
    ],
)
def test_a_block_with_agents_of_its_own_tells_whom_it_asks_for(role: Role, shown: str, wording: Wording) -> None:
    lines = [line.plain() for line in draw(drawing_of(block_with(role)), ascii_only=True)]

    assert lines[2].startswith(f"`- {shown} ")
    wording(lines[3].lstrip())


@pytest.mark.parametrize(
    ("options", "shown"),
    [
        ({}, "request Look(spot: camp)"),
        ({"priority": "high"}, "request Look(spot: camp)  [priority high]"),
        ({"wait": False}, "request Look(spot: camp)  [not waited for]"),
        ({"wait": False, "detached": True}, "request Look(spot: camp)  [not waited for; detached]"),
    ],
)
def test_a_request_tells_of_whom_with_what_and_whether_it_is_waited_for(options: dict[str, Any], shown: str) -> None:
    step = Request(kind="request", seg="steps[0]", mark=at(5), task="Look", args={"spot": expr("camp")}, **options)

    lines = [line.plain() for line in draw(drawing_of(Task("Tour", at(2), (step,))), ascii_only=True)]

    assert lines[2].split("`- ")[1].removesuffix("Fetch.yaml:5").rstrip() == shown


def who(name: str) -> Who:
    return Who(name, expr(name), False, at(1))


def do(line: int, action: str, file: str = "trees/Fetch.yaml") -> Do:
    return Do(kind="do", seg=f"steps[{line}]", mark=at(line, file), who=who("drone"), action=action, fields={})


@pytest.fixture
def task() -> Task:
    home = Subtree("ReturnHome", {}, (do(4, "LandIn", "trees/lib/flying.yaml"),), at(3, "trees/lib/flying.yaml"))
    go = Do(
        kind="do",
        seg="steps[0]",
        mark=at(12),
        who=who("drone"),
        action="GoTo",
        fields={"to": expr("${above(target, 60 m)}")},
        timeout=expr("5 min"),
        retry=Retry(expr("3"), None, None, None, "same", at(13)),
    )
    ask = Ask(
        kind="ask",
        seg="steps[1]",
        mark=at(16),
        question=expr("Loaded?"),
        of=(who("picker"),),
        options=("yes", "no"),
        save_as="reply",
    )
    branch = If(
        kind="if",
        seg="steps[2]",
        mark=at(20),
        cond=expr("reply.answer == 'yes'"),
        then=(Wait(kind="wait", seg="then[0]", mark=at(22), duration=expr("15 s")),),
        otherwise=(Call(kind="call", seg="else[0]", mark=at(24), subtree=home, args={"drone": expr("${drone}")}),),
    )
    return Task(
        "Fetch",
        at(2),
        (go, ask, branch),
        version="1.0.0",
        description="Fetch a full bucket.",
        params={
            "target": Param("target", PLACE, at(4)),
            "height": Param("height", DISTANCE, at(5), default=expr("60 m")),
        },
        roles={"drone": Role("drone", ("hwd",), at(8), near=expr("${target}"), battery_min=expr("40 %"))},
    )


def text(task: Task, **options: Any) -> str:
    return "\n".join(line.plain() for line in draw(drawing_of(task), **options))


def test_every_part_of_a_task_is_drawn(task: Task, wording: Wording) -> None:
    wording(text(task, width=80, ascii_only=True).splitlines())


FACTS = {
    "steps/steps[0]": StepFact(path="", status="success", succeeded=1),
    "steps/steps[1]": StepFact(path="", status="running", running=1, note="Q7 asks eve"),
    "steps/steps[2].else[0]": StepFact(path="", status="failure", failed=2, succeeded=1, code="lost"),
}


@pytest.mark.parametrize("width", [40, 60, 80, 200])
@pytest.mark.parametrize("ascii_only", [False, True])
@pytest.mark.parametrize("steps", [None, FACTS], ids=["file", "task"])
def test_no_line_is_wider_than_asked_for(
    task: Task, width: int, ascii_only: bool, steps: dict[str, StepFact] | None
) -> None:
    lines = [line.plain() for line in draw(drawing_of(task), steps, width=width, ascii_only=ascii_only)]
    assert max(map(len, lines)) <= width


def test_a_step_says_how_it_stands_before_its_name_and_what_it_does_now_behind(task: Task, wording: Wording) -> None:
    lines = draw(drawing_of(task), FACTS, width=70, head=False)
    wording([line.plain() for line in lines])
    assert lines[7].path == "steps/steps[2].else[0]"


def test_ascii_has_a_letter_for_every_status(task: Task, wording: Wording) -> None:
    lines = draw(drawing_of(task), FACTS, width=70, ascii_only=True, head=False)
    assert lines[1].plain().startswith("|- + drone.GoTo(")
    wording(lines[2].plain())
    assert lines[7].plain().startswith("      `- x call")


@pytest.mark.parametrize("width", [40, 52, 100])
def test_a_tree_as_deep_as_it_gets_keeps_the_names_of_its_actions(width: int) -> None:
    inner: Step = do(1, "TakePhotograph")
    for _ in range(30):
        inner = Sequence(kind="sequence", seg="sequence[0]", mark=at(3), steps=(inner,))
    lines = [line.plain() for line in draw(drawing_of(Task("Deep", at(1), (inner,))), width=width)]
    assert max(map(len, lines)) <= width
    assert "drone.TakePhotograph" in lines[-1]


def test_text_of_a_file_cannot_command_the_terminal(task: Task, wording: Wording) -> None:
    ask = Ask(
        kind="ask", seg="steps[0]", mark=at(3), question=expr("a\x1b[2Jb\u202ec"), of=(who("picker"),), options=("y",)
    )
    wording(draw(drawing_of(Task("T", at(1), (ask,))))[-1].plain())


def test_wide_characters_count_as_two_columns() -> None:
    from rich.cells import cell_len

    ask = Ask(
        kind="ask", seg="steps[0]", mark=at(3), question=expr("載せたか" * 9), of=(who("picker"),), options=("y",)
    )
    line = draw(drawing_of(Task("T", at(1), (ask,))), width=60)[-1].plain()
    assert cell_len(line) == 60
    assert line.endswith("…   :3")


def test_ascii_has_no_other_character(task: Task) -> None:
    assert text(task, ascii_only=True).isascii()
    assert not text(task).isascii()


def test_depth_says_how_much_it_hides(task: Task, wording: Wording) -> None:
    lines = [line.plain() for line in draw(cut(drawing_of(task), depth=1), width=60, ascii_only=True)]
    wording(lines[-1])


def test_colours_add_nothing_to_the_text(task: Task) -> None:
    import re

    for line in draw(drawing_of(task)):
        assert re.sub(r"\x1b\[\d+m", "", line.styled()).rstrip() == line.plain()


def test_a_kind_that_the_drawing_does_not_know_shows_its_children() -> None:
    steps: tuple[Step, ...] = (Sequence(kind="sequence", seg="steps[0]", mark=at(3), steps=(do(4, "TakeOff"),)),)
    assert "sequence" in text(Task("T", at(1), steps))
    assert "drone.TakeOff" in text(Task("T", at(1), steps))


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("${target}", "target"),
        ("${ a }", "a"),
        ("Go to ${a} and ${b}", "Go to ${a} and ${b}"),
        ("${a}${b}", "${a}${b}"),
        ("a\n  b", "a b"),
    ],
)
def test_source_is_what_the_author_wrote(written: str, shown: str) -> None:
    assert source(expr(written)) == shown
