"""What an assistant's task may read, and what not."""

import shutil
from pathlib import Path

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.packaged import folder
from formiga_bt.llm.mcp.ground import ServedSite, ServerFiles, ground_of
from tests.golden import Wording

HEAD = "formiga: 1\ntask: X\n"
OWN = "formiga: 1\nsubtrees:\n  Own:\n    steps:\n      - wait: 1 s\n"


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A site's folder with a task of its own, beside a secret."""
    (tmp_path / "secret.yaml").write_text(OWN.replace("Own", "Secret"), encoding="utf-8")
    place = tmp_path / "meadow"
    (place / "trees").mkdir(parents=True)
    (place / ".formiga" / "rovaniemi").mkdir(parents=True)
    (place / ".formiga" / "rovaniemi" / "token.yaml").write_text(OWN, encoding="utf-8")
    shutil.copy(folder("trees") / "demo-site.yaml", place / "site.yaml")
    (place / "trees" / "own.yaml").write_text(OWN, encoding="utf-8")
    mine = HEAD.replace("X", "Mine") + "steps:\n  - notify: hello\n"
    (place / "trees" / "mine.yaml").write_text(mine, encoding="utf-8")
    return place


def ground(site: Path) -> ServedSite:
    return ground_of(ServerFiles(str(site / "site.yaml")))


def messages(ground: ServedSite, imports: str) -> list[str]:
    text = f"{HEAD}imports: {imports}\nsteps:\n  - notify: hello\n"
    return [f"{d.code} {d.message}" for d in ground.load(text).diagnostics]


def test_libraries_and_files_of_the_site_can_be_imported(site: Path) -> None:
    text = f"{HEAD}imports: [own.yaml, lib/flying.yaml]\nsteps:\n  - call: Own\n"
    loaded = ground(site).load(text)
    assert loaded.task is not None
    assert [d.code for d in loaded.diagnostics] == ["W060"]


@pytest.mark.parametrize("path", ["../../secret.yaml", "../../nothing.yaml", "/etc/passwd", "lib/../../../secret.yaml"])
def test_an_import_that_leads_out_is_refused_whether_it_exists_or_not(site: Path, path: str, wording: Wording) -> None:
    wording(messages(ground(site), f"[{path}]"), messages(ground(site), path))


def test_a_link_that_leads_out_is_not_followed(site: Path, wording: Wording) -> None:
    (site / "trees" / "link.yaml").symlink_to(site.parent / "secret.yaml")
    wording(messages(ground(site), "[link.yaml]"))


def test_the_runtime_folder_is_never_read(site: Path, wording: Wording) -> None:
    (site / "trees" / "link.yaml").symlink_to(site / ".formiga" / "rovaniemi" / "token.yaml")
    wording(messages(ground(site), "[link.yaml]"))
    with pytest.raises(OSError, match="no such file"):
        ground(site).read(site / ".formiga" / "rovaniemi" / "token.yaml")


@pytest.mark.parametrize("name", ["notes.txt", ".hidden.yaml"])
def test_only_yaml_that_is_not_hidden_is_read(site: Path, name: str, wording: Wording) -> None:
    (site / "trees" / name).write_text(OWN, encoding="utf-8")
    wording(messages(ground(site), f"[{name}]"))


def test_tasks_are_found_by_their_names_those_of_the_site_first(site: Path, wording: Wording) -> None:
    (site / "trees" / "circle.yaml").write_text(HEAD.replace("X", "Circle") + "steps:\n  - notify: mine\n")
    found = ground(site)
    assert {"Mine", "Circle", "PickUp", "Convoy"} <= set(found.tasks)
    assert found.file_of("Circle") == site / "trees" / "circle.yaml"
    with pytest.raises(UnusableFile) as refused:
        found.file_of("PickUpp")
    wording(refused.value)


def test_a_large_file_is_not_read(site: Path, wording: Wording) -> None:
    (site / "trees" / "large.yaml").write_text("#" * 1_000_001)
    wording(messages(ground(site), "[large.yaml]"))


def test_a_site_with_errors_is_told_at_the_start(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "site.yaml").write_text("formiga_site: 1\n")
    with pytest.raises(UnusableFile) as refused:
        ground_of(ServerFiles(str(tmp_path / "site.yaml")))
    wording(refused.value)
