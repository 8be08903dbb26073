"""The files that ship with formiga_bt are found in a checkout."""

from pathlib import Path

from formiga_bt.base.packaged import files, folder

ROOT = Path(__file__).parents[3]


def test_a_checkout_uses_its_own_folders() -> None:
    assert folder("actions") == ROOT / "actions"
    assert folder("trees") == ROOT / "trees"


def test_files_are_sorted_and_without_test_files() -> None:
    found = files("trees")
    assert found == sorted(found)
    assert not [path for path in found if path.name.endswith(".test.yaml")]
