"""The faults of the paper's published tasks, written in this language: each is refused, its corrected twin passes.

`tests/lang_errors/paper/T10_takeoff_misspelt.yaml` is a slip, `.expected.txt` beside it what the checker says (written anew by
`--update-golden`), and `T10_Delivery.right.yaml` the mission as it was meant.
"""

import difflib
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import render
from formiga_bt.lang.loader import load_task
from formiga_bt.lang.model import Catalogue, Site
from tests.golden import Wording

FOLDER = Path(__file__).parents[2] / "lang_errors" / "paper"
RIGHT = {path.name.split("_")[0]: path for path in sorted(FOLDER.glob("*.right.yaml"))}
SLIPS = sorted(path.name for path in FOLDER.glob("*.yaml") if not path.name.endswith(".right.yaml"))
CODES = {
    "T4_may_end_airborne": {"E031"},
    "T5_longitude_lost": {"E008"},
    "T6_takeoff_misspelt": {"E021"},
    "T6_undefined_radius": {"E010"},
    "T6_at_height_0": {"E066"},
    "T6_lands_nowhere": {"E022"},
    "T7_takeoff_misspelt": {"E021"},
    "T7_unknown_conversion": {"E012"},
    "T8_land_is_no_action": {"E021"},
    "T9_lands_with_takeoff": {"E030"},
    "T9_undefined_preference": {"E010"},
    "T9_undefined_goal": {"E010"},
    "T10_takeoff_misspelt": {"E021"},
    "T10_lands_before_takeoff": {"E030"},
    "T10_undefined_return_task": {"E050"},
    "T10_undefined_reference": {"E010"},
    "T10_port_is_a_text": {"E010"},
    "T10_robot_misspelt": {"E020"},
    "T10_robot_of_no_type": {"E008"},
    "T10_robot1_commanded_twice": {"E034"},
}


def test_every_slip_is_here() -> None:
    assert sorted(CODES) == sorted(name.removesuffix(".yaml") for name in SLIPS)


@pytest.mark.parametrize("name", SLIPS)
def test_the_slip_is_refused_with_its_place_and_the_fix(
    name: str, catalogue: Catalogue, demo_site: Site, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(FOLDER)
    loaded = load_task(Path(name), catalogue=catalogue, site=demo_site)
    text = "\n\n".join(render(d, loaded.sources) for d in loaded.diagnostics) + "\n"

    assert loaded.task is None
    wording.file(FOLDER / name.replace(".yaml", ".expected.txt"), text)
    assert {d.code for d in loaded.diagnostics} == CODES[name.removesuffix(".yaml")]
    assert all(d.help for d in loaded.diagnostics)


@pytest.mark.parametrize("name", SLIPS)
def test_it_stands_where_the_slip_differs_from_what_was_meant(name: str, catalogue: Catalogue, demo_site: Site) -> None:
    slip, right = (path.read_text(encoding="utf-8").splitlines() for path in (FOLDER / name, RIGHT[name.split("_")[0]]))
    changes = difflib.SequenceMatcher(None, slip, right, autojunk=False).get_opcodes()
    changed = {line for tag, low, high, _, _ in changes if tag != "equal" for line in range(low, high + 1)}
    found = load_task(FOLDER / name, catalogue=catalogue, site=demo_site).diagnostics

    if "airborne" not in name:  # E031 stands at the last step that leaves the drone in the air
        assert {d.mark.line - 1 for d in found} & {near + by for near in changed for by in (-1, 0, 1)}


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("with_site", [False, True])
def test_what_was_meant_checks_clean(name: str, with_site: bool, catalogue: Catalogue, demo_site: Site) -> None:
    loaded = load_task(RIGHT[name], catalogue=catalogue, site=demo_site if with_site else None)

    assert loaded.diagnostics == []
    assert loaded.task is not None
