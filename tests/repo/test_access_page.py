"""The table of docs/access.md is the table by which the engine lets in, and its commands work.

`pytest tests/repo/test_access_page.py --update-golden` rewrites it; read the difference.
"""

import re
import shlex
from pathlib import Path

import pytest

from formiga_bt.base.accounts import read_register
from formiga_bt.base.authority import read_holders
from formiga_bt.base.roles import MAY, Deed, Role, roles_that_may
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from tests.golden import Wording

PAGE = Path(__file__).parents[2] / "docs" / "access.md"


COMMAND = re.compile(r"^formiga (access .*?)(?:\s+#.*)?$", re.MULTILINE)


def test_the_commands_of_the_page_do_as_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.yaml").write_text(start("site").replace("@site", "meadow"), encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8")
    first = COMMAND.findall(text)
    assert len(first) == 8
    rows = re.findall(r"^\| `formiga (access [^`]*)`", text, re.MULTILINE)
    assert len(rows) == 11
    for command in [*first, *(row for row in rows if "revoke 3f" not in row)]:
        assert run(shlex.split(command)) == 0, command
    folder = tmp_path / ".formiga" / "meadow"
    (token,) = read_register(folder).tokens
    assert run(["access", "revoke", token.id]) == 0
    holders = read_holders(folder / "keys")
    assert [(one.name, bool(one.revoked)) for one in holders.holders] == [
        ("hwd_1", True),
        ("lwd_1", False),
        ("shop", False),
    ]
    assert holders.hosts == ("engine.example",)
    assert {name: [*one.roles] for name, one in read_register(folder).accounts.items()} == {
        "ann": ["operator", "pilot"], "shop": ["requester"], "pat": ["picker"],
    }  # fmt: skip


def table() -> str:
    rows = ["| | " + " | ".join(f"`{role}`" for role in Role) + " |", "|---" * (len(Role) + 1) + "|"]
    rows += [f"| {deed} | " + " | ".join("yes" if deed in MAY[role] else "" for role in Role) + " |" for deed in Deed]
    return "\n".join(rows)


def test_the_table_is_what_the_engine_does(wording: Wording) -> None:
    text = PAGE.read_text(encoding="utf-8")
    block = re.compile(r"(<!-- table: roles -->\n).*?(<!-- end -->)", re.DOTALL)
    assert block.search(text)
    wording.file(PAGE, block.sub(lambda m: f"{m[1]}\n{table()}\n\n{m[2]}", text))


def test_everything_may_be_done_by_somebody() -> None:
    assert [deed for deed in Deed if not roles_that_may(deed)] == []
