"""`formiga up`: what it says of a site before anything flies."""

from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.up import gaps, tell_others
from formiga_bt.errors import UnusableFile
from formiga_bt.geo import Place, Region
from formiga_bt.journal.store import Journal
from formiga_bt.lang.model import Site, SiteAgent


def test_a_real_site_is_told_what_it_leaves_open() -> None:
    found = gaps(Site(name="north", lat=66.5, lng=25.7, mode="real"), 1.0)

    assert [one.partition("\n")[0] for one in found] == [
        "north is in mode real without a fence: nothing keeps machines in",
        "north is in mode real without terrain: its ground counts as flat, as high as the base",
        "north is in mode real and has no approvers: no task can be approved, so none will fly",
        "north is in mode real and lists no machine: none is admitted",
    ]


def test_a_whole_site_and_a_simulation_are_told_nothing() -> None:
    fence = Region((Place(0, 0), Place(9, 0), Place(9, 9)))
    whole = Site(
        name="north", lat=66.5, lng=25.7, mode="real", fence=fence, relief_m=5.0, people={"approvers": ("ann",)},
        agents={"d": SiteAgent("d", "lwd", home="p1")},
    )  # fmt: skip

    assert gaps(whole, 1.0) == []
    assert gaps(Site(name="north", lat=66.5, lng=25.7), 10.0) == []


def test_no_clock_of_another_speed_on_a_real_site() -> None:
    with pytest.raises(UnusableFile, match="--speed is for simulations; north is in mode real"):
        gaps(Site(name="north", lat=66.5, lng=25.7, mode="real"), 2.0)


def test_up_keeps_one_journal_or_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    assert run(["up", "--no-journal", "--journal", "site.db"]) == 2
    assert "--no-journal and --journal URL: say one of them" in capsys.readouterr().err


def test_a_journal_that_is_none_is_told_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    capsys.readouterr()
    assert run(["up", "--journal", "site.yaml", "--http", "127.0.0.1:0", "--listen", "tcp/127.0.0.1:0"]) == 1
    assert "formiga: site.yaml is no journal: it is not a database\n  help: " in capsys.readouterr().err


def test_a_journal_of_other_sites_is_told_when_a_site_begins_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for site in ("north", "south"):
        tell_others("site.db", "north")
        assert capsys.readouterr().err == "", "it is not there, or its own"
        with Journal("site.db", site) as journal:
            journal.take()
    for address in ("site.db", "sqlite:///site.db"):
        tell_others(address, "hill")
        assert capsys.readouterr().err == (
            f"note: {address} also keeps the journal of north, south; that of hill begins in it\n"
        )
    for harmless in ("postgresql://nobody@nowhere/none", str(tmp_path), __file__):
        tell_others(harmless, "hill")
    Path("empty.db").touch()
    tell_others("empty.db", "hill")
    assert capsys.readouterr().err == ""


def test_up_refuses_another_speed_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    file = tmp_path / "site.yaml"
    text = file.read_text(encoding="utf-8").replace("mode: simulation", "mode: real")
    file.write_text(text + "\npilots: [{id: pia, max_airborne: 1}]\nenvelope: {max_height: 2000 m}\n", encoding="utf-8")

    assert run(["up", "--speed", "2"]) == 2

    said = capsys.readouterr().err
    assert "warning: " in said
    assert "W081" in said
    assert "--speed is for simulations" in said
