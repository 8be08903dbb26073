"""What an engine says reaches the terminal without characters that steer it."""

import json
from typing import Any

import pytest

from formiga_bt.base.visible import visible, visible_json
from tests.golden import Wording
from tests.unit.services.conftest import Start
from tests.unit.services.conftest import start as start

EVIL = "\x1b]0;pwn\x07\x9b2J\r\u202egnirts\u2028\x08"


def test_what_steers_a_terminal_becomes_a_question_mark_and_words_stay(wording: Wording) -> None:
    wording(visible(f"a{EVIL}\nb\tä 🛩"))
    assert visible({EVIL: [EVIL, 3, None]}) == {visible(EVIL): [visible(EVIL), 3, None]}


@pytest.mark.parametrize("ascii_only", [True, False])
@pytest.mark.parametrize(
    "character",
    [*map(chr, (*range(9), *range(11, 32), *range(127, 160))), *"\u200b\u200f\u2028\u202e\u2060\u2067\ufeff"],
)
def test_however_json_writes_it(character: str, ascii_only: bool) -> None:
    data = json.dumps({"text": f"a{character}b"}, ensure_ascii=ascii_only).encode()
    assert json.loads(visible_json(data)) == {"text": "a?b"}


@pytest.mark.parametrize("data", [b'{"a": "b\\nc \xc3\xa4"}', b"no JSON \x1b", b"", b"[" * 99_999 + b"\x1b"])
def test_what_is_harmless_or_no_json_stays(data: bytes) -> None:
    assert visible_json(data) == data


@pytest.mark.network
def test_a_client_cannot_steer_the_terminals_of_others(
    start: Start, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    from formiga_bt.cli.app import run

    monkeypatch.chdir(tmp_path)
    with start() as service:
        service.post("/v1/tasks", {"task": "Ask", "params": {"word": EVIL}, "by": EVIL})
        task = service.post("/v1/tasks", {"task": "Stay", "by": EVIL})["id"]
        service.post(f"/v1/tasks/{task}/abort", {"by": EVIL})
        service.ends(task)
        for words in (
            ["tasks"],
            ["inbox"],
            ["why", task],
            ["why", "Ask-1"],
            ["show", task],
            ["tasks", "--json"],
            ["agents"],
        ):
            run(words)
        assert run(["abort", f"No{EVIL}"]) == 1
    out, err = capsys.readouterr()
    assert task in out
    assert all(c.isprintable() or c == "\n" for c in out + err)
