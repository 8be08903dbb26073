"""`formiga init`: names of folders, and what it refuses."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording


@pytest.mark.parametrize(
    ("folder", "name", "cd"),
    [
        ("Hohe Wiese", "Hohe_Wiese", "cd 'Hohe Wiese' && "),
        ("Grünäcker", "Grunacker", "cd Grünäcker && "),
        ("-x", "x", "cd -- -x && "),
        ("a;b", "a_b", "cd 'a;b' && "),
        ("my-site", "my_site", "cd my-site && "),
        ("7", "site_7", "cd 7 && "),
    ],
)
def test_a_folder_of_any_name_becomes_a_site(
    folder: str, name: str, cd: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init", "--", folder]) == 0
    assert f"\nname: {name}\n" in (tmp_path / folder / "site.yaml").read_text(encoding="utf-8")
    assert f"next: {cd}formiga up --sim" in capsys.readouterr().err.replace("cd 'Grünäcker'", "cd Grünäcker")


def test_a_file_is_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    (tmp_path / "meadow").write_text("hay", encoding="utf-8")
    assert run(["init", str(tmp_path / "meadow")]) == 2
    wording(capsys.readouterr().err)
