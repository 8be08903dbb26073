"""`formiga up`: what it says of a site before anything flies."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.geo import Place, Region
from formiga_bt.cli.app import run
from formiga_bt.cli.inputs import read_world
from formiga_bt.cli.operator.library import check_options, read_library
from formiga_bt.cli.operator.up import SHOWN, _banner, gaps, report_others
from formiga_bt.journal.store import Journal
from formiga_bt.lang.model import Site, SiteAgent
from formiga_bt.services.not_served import NotServed
from tests.golden import Wording


def test_a_real_site_is_told_what_it_leaves_open(wording: Wording) -> None:
    found = gaps(Site(name="north", lat=66.5, lng=25.7, mode="real"), 1.0)

    wording([one.partition("\n")[0] for one in found])


def test_a_whole_site_and_a_simulation_are_told_nothing() -> None:
    fence = Region((Place(0, 0), Place(9, 0), Place(9, 9)))
    whole = Site(
        name="north", lat=66.5, lng=25.7, mode="real", fence=fence, relief_m=5.0, people={"approvers": ("ann",)},
        agents={"d": SiteAgent("d", "lwd", home="p1")},
    )  # fmt: skip

    assert gaps(whole, 1.0) == []
    assert gaps(Site(name="north", lat=66.5, lng=25.7), 10.0) == []


def test_no_clock_of_another_speed_on_a_real_site(wording: Wording) -> None:
    with pytest.raises(UnusableFile) as refused:
        gaps(Site(name="north", lat=66.5, lng=25.7, mode="real"), 2.0)
    wording(refused.value)


def test_up_keeps_one_journal_or_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    assert run(["up", "--no-journal", "--journal", "site.db"]) == 2
    wording(capsys.readouterr().err)


def test_a_journal_that_is_none_is_told_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    capsys.readouterr()
    assert run(["up", "--journal", "site.yaml", "--http", "127.0.0.1:0", "--listen", "tcp/127.0.0.1:0"]) == 1
    wording(capsys.readouterr().err)


def test_a_journal_of_other_sites_is_told_when_a_site_begins_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    for site in ("north", "south"):
        report_others("site.db", "north")
        assert capsys.readouterr().err == "", "it is not there, or its own"
        with Journal("site.db", site) as journal:
            journal.take()
    for address in ("site.db", "sqlite:///site.db"):
        report_others(address, "hill")
        wording(capsys.readouterr().err)
    for harmless in ("postgresql://nobody@nowhere/none", str(tmp_path), __file__):
        report_others(harmless, "hill")
    Path("empty.db").touch()
    report_others("empty.db", "hill")
    assert capsys.readouterr().err == ""


def test_up_refuses_another_speed_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
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
    wording(said)


def test_a_file_that_is_not_served_is_named_with_its_error_and_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    hello = (tmp_path / "trees/hello.yaml").read_text(encoding="utf-8")
    (tmp_path / "trees/more").mkdir()
    (tmp_path / "trees/more/twin.yaml").write_text(hello, encoding="utf-8")
    (tmp_path / "trees/a bad.yaml").write_text(
        "formiga: 1\ntask: Bad\naliases: [Poor]\nagents: {d: {type: lwd}}\nsteps:\n  - do: d.TakeOff\n  - do: d.GoTo\n",
        encoding="utf-8",
    )
    site = Path("site.yaml")
    capsys.readouterr()

    served, refused = read_library(None, Path(), read_world([], site), {}, check_options(site))

    assert "Hello" in served
    wording([one.text for one in refused[:2]])
    assert refused[0].names == ("Bad", "Poor")
    wording(refused[0].load)
    assert refused[1].names == ()
    (triangle,) = refused[2:]
    assert triangle.text.startswith("/")
    wording(triangle.text.replace(tmp_path.name, "meadow"))
    assert triangle.names[0] == "Triangle"
    assert (triangle.load, triangle.shipped) == ("", True)
    said = capsys.readouterr().err
    wording(said)
    assert "triangle" not in said


def banner_of(
    refused: Sequence[NotServed],
    served: Iterable[str],
    capsys: pytest.CaptureFixture[str],
    *,
    mode: str = "simulation",
    endpoint: str = "tcp/127.0.0.1:1",
    silent: Sequence[str] = (),
) -> list[str]:
    """Return the lines that a start prints."""
    host = SimpleNamespace(
        served=list(served), refused=tuple(refused), endpoint=endpoint, epoch=3, needs_token=mode == "real",
        runtime_folder=Path("run"), proofs=SimpleNamespace(without=lambda: list(silent)),
        site=SimpleNamespace(name="north", mode=mode), address=SimpleNamespace(url="http://here"),
        journaling=SimpleNamespace(text="none", aside=[]), resumed=[], restored=[], set_aside=[], clock_text="",
    )  # fmt: skip
    capsys.readouterr()
    _banner(host, {}, False)  # type: ignore[arg-type]
    return capsys.readouterr().out.splitlines()


def test_the_first_start_of_a_fresh_site_refuses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    site = Path("site.yaml")
    served, refused = read_library(None, Path(), read_world([], site), {}, check_options(site))
    assert "Triangle" in [name for one in refused for name in one.names]  # it can be listed
    assert [row for row in banner_of(refused, served, capsys) if "refused" in row] == []


def test_the_banner_names_what_is_not_served(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    rows = banner_of([NotServed(f"f{n}.yaml: bad") for n in range(SHOWN + 2)], ["Hello"], capsys)
    wording(rows[0])
    assert rows[1:3] == ["  tasks   Hello", "  refused f0.yaml: bad"]
    wording(rows[2 + SHOWN])


@pytest.mark.parametrize(
    ("mode", "endpoint", "says"),
    [
        ("simulation", "tcp/127.0.0.1:1", []),
        ("simulation", "tcp/0.0.0.0:1", ["the wire is not checked: other machines that reach tcp/0.0.0.0:1"]),
        ("real", "tcp/127.0.0.1:1", ["site's token (run/token)", "processes of this machine that reach"]),
        ("real", "tls/0.0.0.0:1", ["site's token (run/token)", "to the router at tls/0.0.0.0:1"]),
        ("real", "", ["site's token (run/token)"]),
    ],
)
def test_the_banner_says_who_is_not_asked(
    capsys: pytest.CaptureFixture[str], mode: str, endpoint: str, says: list[str]
) -> None:
    rows = [row for row in banner_of([], ["Hello"], capsys, mode=mode, endpoint=endpoint) if row.startswith("  open ")]
    assert len(rows) == len(says)
    assert all(part in row for part, row in zip(says, rows, strict=True))


def test_the_banner_names_who_cannot_approve_yet(capsys: pytest.CaptureFixture[str], wording: Wording) -> None:
    rows = banner_of([], ["Hello"], capsys, mode="real", silent=["ann", "pia"])
    wording(rows)


@pytest.mark.parametrize("mode", ["real", "simulation"])
def test_no_start_where_others_reach_the_wire_without_tls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], mode: str, wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["init"]) == 0
    site = Path("site.yaml")
    text = site.read_text(encoding="utf-8").replace("mode: simulation", f"mode: {mode}\npilots: [{{id: pia}}]")
    site.write_text(text, encoding="utf-8")
    assert run(["up", "--http", "127.0.0.1:0", "--listen", "tcp/0.0.0.0:0"]) == 1
    said = capsys.readouterr().err
    wording(said)
    assert f"is in mode {mode}" in said
    assert "help: " in said

    site.write_text(text.replace("tcp/127.0.0.1:7447", "tcp/0.0.0.0:0"), encoding="utf-8")
    assert run(["up", "--http", "127.0.0.1:0"]) == 1
    wording(capsys.readouterr().err)
    assert not Path(".formiga").exists()
