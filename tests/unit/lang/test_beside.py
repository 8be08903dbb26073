"""Who misses a type or an action is told of a catalogue beside the task that has it, and how a site names it."""

from pathlib import Path

from formiga_bt.lang.loader import load_catalogue, load_task, load_task_text

ROOT = Path(__file__).parents[3]
OWN = """\
formiga_catalogue: 1
types:
  mole:
    of: {mobility: ground}
    actions: [Dig]
actions:
  # how deep it goes
  Dig:
    typical: 1 min
"""
TASK = """\
formiga: 1
task: Digs
agents: {mole: {type: mole}, watcher: {type: watcher}}
steps:
  - do: watcher.Dig
  - do: watcher.Diig
"""


def said(folder: Path, text: str = TASK) -> dict[str, str]:
    (folder / "digs.yaml").write_text(text, encoding="utf-8")
    catalogue = load_catalogue([ROOT / "actions" / "base.yaml"])[0]
    found = load_task(folder / "digs.yaml", catalogue=catalogue).diagnostics
    return {f"{one.code} {one.mark.line}": one.help for one in found}


def test_a_catalogue_beside_the_task_is_named(tmp_path: Path) -> None:
    (tmp_path / "actions").mkdir()
    (tmp_path / "actions" / "garden.yaml").write_text(OWN, encoding="utf-8")
    (tmp_path / "notes.yaml").write_bytes(b"\xff\xfe")

    told = said(tmp_path)

    how = "is in actions/garden.yaml: actions: [actions/garden.yaml] in site.yaml, or --actions actions/garden.yaml"
    assert told["E020 3"].endswith(f"; 'mole' {how}")
    assert told["E021 5"].endswith(f"; 'Dig' {how}")
    assert "garden" not in told["E021 6"]


def test_of_a_task_in_trees_the_catalogue_of_its_site_is_named(tmp_path: Path) -> None:
    for folder in ("actions", "trees"):
        (tmp_path / folder).mkdir()
    (tmp_path / "actions" / "garden.yaml").write_text(OWN, encoding="utf-8")

    told = said(tmp_path / "trees")

    assert "actions: [actions/garden.yaml] in site.yaml" in told["E020 3"]
    assert "actions: [actions/garden.yaml] in site.yaml" in told["E021 5"]


def test_a_type_is_no_action_and_one_of_a_file_that_is_no_catalogue_is_none(tmp_path: Path) -> None:
    (tmp_path / "else.yaml").write_text("steps:\n  mole:\n  Dig:\n", encoding="utf-8")

    assert not any("else.yaml" in one for one in said(tmp_path).values())


def test_a_task_that_is_given_as_a_text_is_beside_nothing(tmp_path: Path) -> None:
    (tmp_path / "garden.yaml").write_text(OWN, encoding="utf-8")
    catalogue = load_catalogue([ROOT / "actions" / "base.yaml"])[0]

    found = load_task_text(TASK, "digs.yaml", catalogue=catalogue).diagnostics

    assert not any("garden" in one.help for one in found)
