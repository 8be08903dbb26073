"""Libraries that a site names are found by every verb, by the editor, and by drafts of language models."""

import subprocess
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.cli.loading import bundles_of
from formiga_bt.editor.checks import check
from formiga_bt.editor.project import Document, Project
from formiga_bt.llm.mcp.ground import ServerFiles, ground_of
from formiga_bt.llm.vocabulary import verbs_of
from formiga_bt.llm.world import world_of

Capture = pytest.CaptureFixture[str]
LIBRARY = """\
formiga: 1
subtrees:
  Glance:
    params: {drone: agent, at: place}
    steps:
      - do: drone.GoTo
        with: {to: "${above(at, 30 m)}"}
"""
TASK = """\
formiga: 1
task: Look
imports: [lib/flying.yaml, glances.yaml]
agents: {drone: {type: lwd, near: "${base}"}}
steps:
  - do: drone.TakeOff
  - call: Glance
    with: {drone: "${drone}", at: "${base}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
TEST = "formiga_test: 1\ntask: look.yaml\nsite: ../site.yaml\ncases: [{name: it looks, expect: {status: succeeded}}]\n"


@pytest.fixture
def meadow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Path:
    monkeypatch.chdir(tmp_path)
    assert run(["init", "meadow"]) == 0
    capsys.readouterr()
    site = tmp_path / "meadow" / "site.yaml"
    site.write_text(site.read_text("utf-8").replace("\nbase:", "\nlibraries: [trees/team]\nbase:", 1), encoding="utf-8")
    trees = site.parent / "trees"
    (trees / "team").mkdir()
    for name, text in (("team/glances.yaml", LIBRARY), ("look.yaml", TASK), ("look.test.yaml", TEST)):
        (trees / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(site.parent)
    return site.parent


VERBS = ("check --strict .", "show trees/look.yaml", "dryrun trees/look.yaml", "test trees", "fix trees/look.yaml",
         "check --strict trees/team/glances.yaml", "export --to btcpp trees/look.yaml")  # fmt: skip


@pytest.mark.parametrize("words", VERBS)
def test_a_verb_finds_them(words: str, meadow: Path, capsys: Capture) -> None:
    assert run(words.split()) == 0, (meadow, "".join(capsys.readouterr()))


def test_files_of_a_folder_are_checked_against_the_site_that_lies_there(
    meadow: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    for here, there in ((meadow.parent, "meadow"), (meadow / "trees", "look.yaml")):
        monkeypatch.chdir(here)
        assert run(["check", "--strict", there]) == 0, capsys.readouterr().out


def test_what_is_sent_to_an_engine_has_them_along(meadow: Path) -> None:
    (bundle,) = bundles_of(Path("trees/look.yaml"), meadow.resolve())

    assert sorted(bundle.texts) == ["trees/look.yaml", "trees/team/glances.yaml"]


def test_the_editor_finds_them_and_proposes_them(meadow: Path) -> None:
    project, path = Project(), meadow / "trees" / "look.yaml"
    document = project.open[path] = Document(path, TASK, 1)

    assert check(project, document).diagnostics == ()
    assert "glances.yaml" in project.importable(path)
    assert project.locate(path, "glances.yaml") == meadow / "trees" / "team" / "glances.yaml"
    assert project.subtrees(document)["Glance"].imported


def test_a_language_model_is_told_of_their_subtrees(meadow: Path) -> None:
    assert verbs_of(world_of(meadow / "site.yaml"))["Glance"].library == "glances.yaml"


@pytest.mark.parametrize("words", ["show meadow/trees/look.yaml", "export --to btcpp meadow/trees/look.yaml"])
def test_a_file_brings_its_site_from_elsewhere(words: str, meadow: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(meadow.parent)

    assert run(words.split()) == 0


def test_a_revision_is_read_with_the_libraries_of_then(meadow: Path, capsys: Capture) -> None:
    def git(*words: str) -> None:
        subprocess.run(["git", "-c", "user.name=eve", "-c", "user.email=eve@example.org", *words], check=True)

    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    library = meadow / "trees" / "team" / "glances.yaml"
    library.write_text(LIBRARY.replace("30 m", "45 m"), encoding="utf-8")

    assert run(["diff", "--git", "HEAD", "trees/look.yaml"]) == 1
    assert "45 m" in capsys.readouterr().out


def test_an_assistant_finds_them(meadow: Path) -> None:
    ground = ground_of(ServerFiles(site="site.yaml"))

    assert ground.load(TASK).diagnostics == []
