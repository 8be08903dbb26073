"""`formiga export` and `formiga import`."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
PICK_UP = str(ROOT / "trees" / "pick_up.yaml")


def test_a_task_goes_out_and_comes_back_clean(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    xml, task = tmp_path / "out.xml", tmp_path / "back.yaml"
    assert run(["export", PICK_UP, "--to", "btcpp", "-o", str(xml)]) == 0
    said = capsys.readouterr().err
    wording(said)
    assert run(["import", str(xml), "-o", str(task)]) == 0
    wording(capsys.readouterr().err)
    assert run(["check", "--strict", str(task)]) == 0


def test_strict_refuses_what_would_be_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    out = tmp_path / "out.xml"
    assert run(["export", PICK_UP, "--to", "btcpp", "--strict", "-o", str(out)]) == 1
    wording(capsys.readouterr().err)
    assert not out.exists()


def test_a_file_that_exists_is_not_replaced_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    out = tmp_path / "out.xml"
    out.write_text("mine", encoding="utf-8")
    assert run(["export", PICK_UP, "--to", "btcpp", "-o", str(out)]) == 2
    wording(capsys.readouterr().err)
    assert out.read_text(encoding="utf-8") == "mine"
    assert run(["export", PICK_UP, "--to", "btcpp", "-o", str(out), "--force"]) == 0


def test_the_file_tells_what_is_lost_and_where_each_node_is_from(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", PICK_UP, "--to", "btcpp"]) == 0
    xml = capsys.readouterr().out
    assert "     L03 pick_up.yaml:35: in BT.CPP the pause also follows the last attempt" in xml
    assert '<LandIn agent="{drone}" at="{target}" _description="[pick_up.yaml:26]"/>' in xml
    assert '<input_port name="height" type="distance" default="60"' in xml


def test_xml_that_is_refused_names_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    bad = tmp_path / "bad.xml"
    bad.write_text("<!DOCTYPE r []>\n<root/>", encoding="utf-8")
    assert run(["import", str(bad)]) == 1
    wording(capsys.readouterr().err)


def test_a_task_with_errors_is_not_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("formiga: 1\ntask: Bad\nsteps:\n  - sleep: 1 s\n", encoding="utf-8")
    assert run(["export", str(bad), "--to", "btcpp"]) == 1
    assert "E006" in capsys.readouterr().err
