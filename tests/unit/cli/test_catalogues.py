"""Every verb takes the catalogues of the site, and adds those of `--actions`."""

import json
from pathlib import Path

import pytest

from formiga_bt.cli.app import run

SITE = """formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
ports: {p1: {at: {east: 0 m, north: 20 m}}}
places: {pit: {east: 60 m, north: 60 m}}
agents: {crane_1: {type: crane, home: p1}}
actions: [mine.yaml]
"""
CRANE = """types:
  crane: {extends: hwd, actions: [Winch]}
actions:
  Winch: {fields: {down: distance}, requires: airborne, typical: 20 s}
"""
LIFT = """formiga: 1
task: Lift
agents: {crane: {type: crane}}
steps:
  - do: crane.TakeOff
  - do: crane.Winch
    with: {down: 5 m}
  - do: crane.LandIn
    with: {at: "${crane.home}"}
"""


@pytest.fixture(autouse=True)
def yard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("site.yaml").write_text(SITE)
    Path("mine.yaml").write_text(CRANE)
    Path("trees").mkdir()
    Path("trees/lift.yaml").write_text(LIFT)


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    code = run(list(words))
    read = capsys.readouterr()
    return code, read.out + read.err


@pytest.mark.parametrize(
    "words",
    [
        ("check", "--site", "site.yaml", "trees/lift.yaml"),
        ("check", "trees/lift.yaml"),
        ("check", "--json", "trees/lift.yaml", "--site", "site.yaml"),
        ("check", "site.yaml", "mine.yaml"),
        ("show", "trees/lift.yaml", "--site", "site.yaml"),
        ("fix", "--diff", "trees/lift.yaml"),
        ("export", "--to", "btcpp", "trees/lift.yaml"),
        ("schema", "--llm"),
    ],
)
def test_verbs_know_what_the_site_names(capsys: pytest.CaptureFixture[str], words: tuple[str, ...]) -> None:
    code, out = said(capsys, *words)

    assert code == 0, out
    if words[0] == "schema":
        assert "do_Winch" in json.loads(out)["$defs"]


def test_what_is_added_is_beside_the_site_and_by_name_too(capsys: pytest.CaptureFixture[str]) -> None:
    Path("kite.yaml").write_text("types:\n  kite: {extends: lwd}\n")
    Path("trees/lift.yaml").write_text(
        LIFT.replace("{crane: {type: crane}}", "{crane: {type: crane}, kite: {type: kite}}")
    )

    assert said(capsys, "check", "trees/lift.yaml")[0] == 1
    code, out = said(capsys, "check", "--actions", "kite.yaml", "--actions", "base", "trees/lift.yaml")
    assert "E020" not in out
    code, out = said(capsys, "check", "--actions", "bass", "trees/lift.yaml")
    assert code == 2
    assert "base" in out


def test_an_engine_does_not_speak_of_shipped_tasks_that_it_cannot_serve(capsys: pytest.CaptureFixture[str]) -> None:
    from formiga_bt.cli.inputs import read_world
    from formiga_bt.cli.operator.library import read_library

    Path("site.yaml").write_text(SITE.replace("mine.yaml", ""))
    Path("own.yaml").write_text("types:\n  crane: {actions: [Winch]}\nactions:\n  Winch: {typical: 20 s}\n")
    Path("trees/lift.yaml").write_text(
        "formiga: 1\ntask: Lift\nagents: {crane: {type: crane}}\nsteps:\n  - do: crane.Winch\n"
    )
    world = read_world([Path("own.yaml")], Path("site.yaml"))
    served, refused = read_library(None, Path(), world, {}, "")

    assert "Lift" in served
    assert all(one.shipped for one in refused)
    assert capsys.readouterr() == ("", "")
