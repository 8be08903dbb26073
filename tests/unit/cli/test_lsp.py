"""`formiga lsp` where it cannot serve; with a client it is tested in tests/e2e/test_language_server.py."""

import pytest

from formiga_bt.base.extras import install
from formiga_bt.cli import main
from formiga_bt.cli.integrator import lsp


def test_without_the_extra_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lsp, "find_spec", lambda name: None)
    monkeypatch.setattr("sys.argv", ["formiga", "lsp"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err.endswith(f"help: {install('lsp')}\n")
