"""`formiga mcp` where it cannot serve; with a client it is tested in tests/e2e/test_mcp.py."""

from pathlib import Path

import pytest

from formiga_bt.base.extras import install
from formiga_bt.cli import main
from formiga_bt.cli.integrator import mcp
from tests.golden import Wording


def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: str) -> str:
    monkeypatch.setattr("sys.argv", ["formiga", "mcp", *words])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    return capsys.readouterr().err


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mcp, "find_spec", lambda name: None)
    assert refused(monkeypatch, capsys).endswith(f"help: {install('mcp')}\n")


def test_a_site_that_cannot_be_used_is_told_before_it_serves(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, wording: Wording
) -> None:
    assert "cannot read nowhere.yaml" in refused(monkeypatch, capsys, "--site", "nowhere.yaml")
    (tmp_path / "site.yaml").write_text("formiga_site: 1\n")
    monkeypatch.chdir(tmp_path)
    wording(refused(monkeypatch, capsys))
