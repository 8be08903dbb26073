"""The documents tell the truth: their examples check clean, their commands exist, every verb is described."""

import re
from pathlib import Path

import pytest

from formiga_bt.cli.inputs import read_task, read_world, rendered
from formiga_bt.cli.verbs import verbs
from formiga_bt.lang.loader import load_library_text

ROOT = Path(__file__).parents[2]
DOCS = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")])
FENCE = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|#)([^)#]+)")
SITES = {
    path.read_text(encoding="utf-8"): path.parent / "site.yaml"
    for path in (ROOT / "docs" / "examples").rglob("*.yaml")
    if (path.parent / "site.yaml").is_file()
}
"""Recipes that stand beside a site of their own -> that site."""
ELSEWHERE = re.compile(r"(?<![\w.])/(?:home|root|opt|srv|mnt)/|\.\./\.\./")


def name(value: object) -> str:
    return str(value.relative_to(ROOT)) if isinstance(value, Path) else ""


def examples() -> list[object]:
    found = []
    for doc in DOCS:
        for match in FENCE.finditer(doc.read_text(encoding="utf-8")):
            if match[1].startswith("formiga: 1"):
                line = doc.read_text(encoding="utf-8").count("\n", 0, match.start()) + 2
                found.append(pytest.param(match[1], id=f"{name(doc)}:{line}"))
    return found


@pytest.mark.parametrize("text", examples())
def test_examples_check_without_a_warning(text: str, tmp_path: Path) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(text, encoding="utf-8")
    world = read_world(site=SITES.get(text))
    if "\ntask:" in text:
        read = read_task(file, world)
        assert not read.diagnostics, "\n\n".join(rendered(read.diagnostics, read.sources))
    else:
        assert load_library_text(text, str(file), catalogue=world.catalogue).diagnostics == []


def spoken(text: str) -> set[str]:
    """Return the verbs that a document names in code: inline, or in a fenced or indented block."""
    code = re.findall(r"`([^`\n]+)`", text) + re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return {verb for piece in code for verb in re.findall(r"(?:^|/|\s)formiga ([a-z]+)\b", piece)}


@pytest.mark.parametrize("doc", DOCS, ids=name)
def test_commands_named_in_documents_exist(doc: Path) -> None:
    assert spoken(doc.read_text(encoding="utf-8")) <= set(verbs())


@pytest.mark.parametrize("verb", list(verbs()))
def test_every_verb_is_described(verb: str) -> None:
    assert any(verb in spoken(doc.read_text(encoding="utf-8")) for doc in DOCS)


@pytest.mark.parametrize("doc", DOCS, ids=name)
def test_links_lead_to_files(doc: Path) -> None:
    for target in LINK.findall(doc.read_text(encoding="utf-8")):
        assert (doc.parent / target).exists(), target


@pytest.mark.parametrize("doc", DOCS, ids=name)
def test_documents_stand_alone(doc: Path) -> None:
    assert not ELSEWHERE.search(doc.read_text(encoding="utf-8"))


def test_the_tour_names_files_that_exist() -> None:
    tour = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:\w+/)*\w+\.py|(?:\w+/)+)`", tour))
    ours = [
        path.as_posix() + "/" * path.is_dir()
        for room in ("formiga_bt", "agents_sim")
        for path in (ROOT / room).rglob("*")
    ]
    there = [path for path in sorted(named) if (ROOT / path).exists() or any(one.endswith(f"/{path}") for one in ours)]
    assert sorted(named - set(there)) == []


def test_every_code_of_the_checker_is_described_and_no_other() -> None:
    code = re.compile(r"[\"']([EW]\d{3})[\"']")
    used = {c for path in (ROOT / "formiga_bt").rglob("*.py") for c in code.findall(path.read_text(encoding="utf-8"))}
    table = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| ([EW]\d{3}) \|", table, re.MULTILINE)) == used


def test_the_first_task_passes_its_first_test(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The two files of the README, saved under the names that it gives them."""
    from formiga_bt.cli.app import run

    found = FENCE.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    monkeypatch.chdir(tmp_path)
    Path("my.yaml").write_text(found[0], encoding="utf-8")
    Path("my.test.yaml").write_text(
        next(text for text in found if text.startswith("formiga_test: 1")), encoding="utf-8"
    )
    assert run(["test", "my.test.yaml", "--coverage"]) == 0
    assert "coverage of LookAt: 5 of 5 steps (100 %)\n2 cases passed\n" in capsys.readouterr().out
