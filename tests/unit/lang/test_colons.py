"""Colons that are missing: named where they are missing, with a line that can be read."""

import pytest

from formiga_bt.base.diagnostics import Fix
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.text.document import parse
from tests.golden import Wording

HEAD = "formiga: 1\ntask: A\nagents:\n  d: {type: lwd}\nsteps:\n"


def mended(text: str, fix: Fix) -> str:
    lines = text.split("\n")
    line = lines[fix.mark.line - 1]
    lines[fix.mark.line - 1] = line[: fix.mark.col - 1] + fix.text + line[fix.mark.end_col - 1 :]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        (HEAD + "  - do d.GoTo\n    with: {to: camp}\n", 6, "do"),
        (HEAD + "  - do: d.GoTo\n    with\n      to: camp\n", 7, "with"),
        (HEAD + "  - do: d.GoTo\n    with {to: camp}\n", 7, "with"),
        (HEAD + "  - do: d.GoTo\n    # where to\n    with [camp: 3]\n", 8, "with"),
        (HEAD + "  - do: d.GoTo\n    with:\n      to ${d.home}\n      height: 3 m\n", 8, "to"),
        (HEAD + "  - TakeOff {agent: d}\n", 6, "TakeOff"),
        (HEAD + "  - sequence\n    - do: d.TakeOff\n", 6, "sequence"),
        (HEAD + "  - sequence   # one after another\n      - do: d.TakeOff\n", 6, "sequence"),
        (HEAD + "  - wait: 5 s\n\nfinally\n  - wait: 5 s\n", 8, "finally"),
        (HEAD + "  - wait: 5 s\n    timeout 5 min\n", 7, "timeout"),
        (HEAD + "  - if d.airborne\n    then:\n      - wait: 5 s\n", 6, "if"),
        (HEAD.replace("task:", "task") + "  - wait: 5 s\n", 2, "task"),
        (HEAD.replace("formiga:", "formiga") + "  - wait: 5 s\n", 1, "formiga"),
        (HEAD.replace("agents:", "agents") + "  - wait: 5 s\n", 3, "agents"),
        (HEAD.replace("d:", "d") + "  - wait: 5 s\n", 4, "d"),
        ("formiga: 1\ntask: A\nagents:\n  scout\n    type: lwd\nsteps:\n  - wait: 5 s\n", 4, "scout"),
    ],
)
def test_the_missing_colon_is_named_and_the_mend_can_be_read(text: str, line: int, word: str, wording: Wording) -> None:
    node, (found,) = parse(text, "a.yaml")

    assert node is None
    assert (found.code, found.mark.line) == ("E001", line)
    wording(found.message)
    assert text.split("\n")[line - 1][found.mark.col - 1 : found.mark.end_col - 1] == word
    assert found.fix is not None
    assert found.help == f"write: {found.fix.text.strip()}"
    again = parse(mended(text, found.fix), "a.yaml")
    assert again[0] is not None
    assert again[1] == []


def test_a_space_after_the_colon_is_missing(wording: Wording) -> None:
    _, (found,) = parse(HEAD + "  - do:d.TakeOff\n    timeout: 5 s\n", "a.yaml")

    assert found.mark.line == 6
    wording(found.message, found.help)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        # A text that goes on below: nobody knows which of both is meant.
        (
            HEAD + "  - notify: We fly\n    to the camp\n    wait: 3\n", 7,
            "a colon is missing after 'to'; or, if it goes on with the text above, indent it deeper",
        ),
        (
            HEAD + "  - notify: We fly\n    over the camp\n    wait: 3\n", 7,
            "a colon is missing after 'over'; or, if it goes on with the text above, indent it deeper",
        ),
        # Another slip, which a colon would not mend.
        (HEAD + "  - notify: We go:to: camp: now\n", 6, "': ' inside a text begins a new key"),
        (HEAD + "  - do: d.TakeOff\n   timeout: 5 s\n", 7, "this is not YAML: did not find expected '-' indicator"),
        (HEAD + "  - wait: [5 s\n", 7, "this is not YAML: did not find expected ',' or ']'"),
    ],
)  # fmt: skip
def test_what_is_not_sure_is_not_claimed(text: str, line: int, said: str) -> None:
    _, (found,) = parse(text, "a.yaml")

    assert (found.code, found.mark.line, found.message) == ("E001", line, said)
    assert found.fix is None or "or, if" not in said


@pytest.mark.parametrize(
    ("step", "code", "said", "help_"),
    [
        (
            "do d.TakeOff",
            "E005",
            "this is the text 'do d.TakeOff'; a colon is missing after 'do'",
            "write: do: d.TakeOff",
        ),
        ("wait 5 s", "E005", "; a colon is missing after 'wait'", "write: wait: 5 s"),
        ("wait:5 s", "E005", "; a space is missing after 'wait:'", "write: wait: 5 s"),
        ("TakeOff", "E005", "this is the text 'TakeOff'", "write: do: d.TakeOff"),
        ("d.TakeOff", "E005", "this is the text 'd.TakeOff'", "write: do: d.TakeOff"),
        ("Confirm", "E005", "this is the text 'Confirm'", "write: do: AGENT.Confirm"),
        ("'do d.TakeOff'", "E005", "this is the text 'do d.TakeOff'", ""),
        ("up and away", "E005", "this is the text 'up and away'", ""),
        ("TakeOff: {agent: d}", "E006", "'TakeOff' is not a step", "it is an action, write: do: d.TakeOff"),
        ("wait: 5 s\n    retry: {attempts 3}", "E004", "; a colon is missing after 'attempts'", "write: attempts: 3"),
        ("wait: 5 s\n    retry: attempts 3", "E008", "; a colon is missing after 'attempts'", "write: attempts: 3"),
        ("do: d.GoTo\n    with:\n      to camp", "E008", "; a colon is missing after 'to'", "write: to: camp"),
    ],
)
def test_what_can_be_read_without_its_colon(step: str, code: str, said: str, help_: str, catalogue: Catalogue) -> None:
    found = load_task_text(f"{HEAD}  - {step}\n", "a.yaml", catalogue=catalogue).diagnostics

    first = next(one for one in found if one.code == code)
    assert first.message.endswith(said)
    assert first.help == help_
