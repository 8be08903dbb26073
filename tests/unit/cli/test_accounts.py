"""`formiga access` about accounts: what it writes, what it shows, and what it refuses."""

import json
import os
import time
from pathlib import Path

import pytest

from formiga_bt.base.accounts import ACCOUNTS, MOST_TOKENS, find_account, read_register
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.services.http.audit import Audit, read_audit
from tests.golden import Wording

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "site.yaml").write_text(start("site").replace("@site", "meadow"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / ".formiga" / "meadow"


def said(*words: str) -> int:
    return run(["access", *words])


def test_an_account_gets_roles_and_a_token_which_is_shown_once(folder: Path, capsys: Capture) -> None:
    assert said("add", "ann", "--role", "operator", "--role", "pilot", "--agent", "watcher_1") == 0
    assert said("token", "ann", "--expires", "2 h") == 0
    text = capsys.readouterr().out.splitlines()[-1]
    register = read_register(folder)
    found = find_account(register, text, time.time())
    assert found is not None
    assert (found[0], found[1].agent, [*found[1].roles]) == ("ann", "watcher_1", ["operator", "pilot"])
    assert find_account(register, text, time.time() + 7201) is None
    assert (folder / ACCOUNTS).stat().st_mode & 0o777 == 0o600
    assert text not in (folder / ACCOUNTS).read_text()

    assert said("role", "ann", "viewer") == said("tasks", "ann", "Hello") == said("is", "ann") == 0
    assert said("limits", "ann", "60", "5") == 0
    assert said("disable", "ann") == 0
    assert find_account(read_register(folder), text, time.time()) is None
    assert said("enable", "ann") == 0
    capsys.readouterr()
    assert said("accounts", "--json") == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["roles"], row["tasks"], row["agent"], row["disabled"]) == (["viewer"], ["Hello"], "", False)
    assert (row["requests"], row["open_tasks"]) == (60, 5)
    assert said("revoke", row["tokens"][0]["id"]) == 0
    assert find_account(read_register(folder), text, time.time()) is None


@pytest.mark.parametrize(
    "words",
    [
        ["add", "ann", "--role", "boss"],
        ["add", "Ann", "--role", "viewer"],
        ["add", "local", "--role", "viewer"],
        ["add", "ann"],
        ["add"],
        ["role", "eve", "viewer"],
        ["token", "eve"],
        ["token", "ann", "--expires", "forever"],
        ["token", "ann", "--expires", "10000d"],
        ["limits", "known", "0"],
        ["limits", "known", "60", "5", "7"],
        ["limits", "known", "many"],
        ["revoke", "00000000"],
        ["add", "known", "--role", "viewer"],
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    words: list[str], folder: Path, capsys: Capture, wording: Wording
) -> None:
    said("add", "known", "--role", "admin")
    before = read_register(folder)
    capsys.readouterr()
    assert said(*words) in (1, 2)
    wording(capsys.readouterr().err)
    assert read_register(folder) == before


def test_tokens_of_an_account_are_bounded_and_a_broken_file_lets_nobody_change_it(
    folder: Path, capsys: Capture
) -> None:
    said("add", "ann", "--role", "viewer")
    for _ in range(MOST_TOKENS):
        assert said("token", "ann") == 0
    assert said("token", "ann") == 1
    (folder / ACCOUNTS).write_text('{"accounts": 7}')
    assert said("add", "bob", "--role", "viewer") in (1, 2)
    assert (folder / ACCOUNTS).read_text() == '{"accounts": 7}'
    (folder / ACCOUNTS).unlink()
    os.symlink(folder / "nowhere", folder / ACCOUNTS)
    assert said("accounts") in (1, 2)
    assert "Traceback" not in capsys.readouterr().err


def test_changes_of_accounts_and_secrets_are_in_the_audit_and_no_word_of_a_refused_one(folder: Path) -> None:
    said("add", "ann", "--role", "viewer")
    said("token", "ann")
    said("revoke", "a-whole-token-by-mistake")
    said("accounts")
    assert [(one["asked"], one["status"]) for one in read_audit(folder)] == [
        ("formiga access add ann viewer", 200),
        ("formiga access token ann", 200),
        ("formiga access revoke", 403),
    ]


def test_what_a_stranger_asked_for_steers_no_terminal(folder: Path, capsys: Capture) -> None:
    said("add", "ann", "--role", "viewer")
    audit = Audit(folder)
    audit.note("", "10.0.0.9", "GET", "/v1/\x1b]0;gone\x07", 401)
    audit.close()
    assert said("audit") == 0
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert "10.0.0.9" in shown


def test_without_accounts_it_says_who_may_do_everything(capsys: Capture, wording: Wording) -> None:
    assert said("accounts") == 0
    assert said("audit") == 0
    wording(capsys.readouterr().out)
