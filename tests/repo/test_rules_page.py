"""docs/rules.md: its rules check on a site, its test file passes, and its figures of noise are those that the engine has."""

import random
import re
from pathlib import Path

import pytest

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.packaged import folder
from formiga_bt.cli.app import run
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.rules.borders import BAND_M, OLDEST_US, side_of
from formiga_bt.lang.compose import compose
from formiga_bt.lang.rules.keys import RULE

PAGE = (Path(__file__).parents[2] / "docs" / "rules.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
CORNERS = ((-300, -300), (300, -300), (300, 300), (-300, 300))
FIELD = f"[{', '.join(f'{{east: {east} m, north: {north} m}}' for east, north in CORNERS)}]"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that the page describes."""
    rules, cases, task = BLOCKS
    text = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8")
    (tmp_path / "site.yaml").write_text(text.replace("regions:\n", f"regions:\n  field: {FIELD}\n"), encoding="utf-8")
    for name, block in (("rules/pickers", rules), ("trees/stand_watch", task), ("trees/stand_watch.test", cases)):
        path = tmp_path / f"{name}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(block, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_rules_of_the_page_are_those_of_the_site(here: Path) -> None:
    world = compose(here / "site.yaml")
    assert world.site is not None, world.diagnostics
    assert list(world.site.rules) == ["sos", "left_field"]
    assert run(["check", "site.yaml", "trees/stand_watch.yaml"]) == 0


def test_the_test_file_of_the_page_passes(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["test", str(here / "trees")]) == 0
    assert "2 cases passed" in capsys.readouterr().out


def test_the_page_names_every_key() -> None:
    assert [option.name for option in RULE if not re.search(rf"`{option.name}`", PAGE)] == []


def test_the_figures_of_noise_are_right() -> None:
    assert f"more than {BAND_M:g} m beyond the border" in PAGE
    assert f"older than {OLDEST_US / 1e6:g} s" in PAGE
    square = Region((Place(0, 0), Place(0, 500), Place(-500, 500), Place(-500, 0)))
    rng, bare, lasting = random.Random(7), [], []
    for _ in range(40):
        inside, beyond, fired, lasted = True, 0, 0, 0
        for _ in range(3600):
            at = Position(rng.gauss(0, 3), 250 + rng.gauss(0, 3), 0.0)
            side = side_of(AgentRecord(id="p", type="picker", position=at), square)
            fired += side is False and inside
            inside = inside if side is None else side
            beyond = 0 if side is True else beyond + (beyond > 0 or side is False)
            lasted += beyond == 11
        bare.append(fired)
        lasting.append(lasted)
    assert 1.0 <= sum(bare) / len(bare) <= 2.5, "the page says: twice"
    assert sum(lasting) / len(lasting) < 0.05, "the page says: not at all"
