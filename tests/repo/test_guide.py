"""The guide to the language: its pages in order, each complete task in it flown as the page says, each test file played.

An example is saved under the name in the command that follows it; the command is run, in virtual time, and has exit code 0.
"""

import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.lang.kinds import KINDS, MODIFIERS, RETRY, ROLE, TASK, Option

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "language"
INDEX = (FOLDER / "index.md").read_text(encoding="utf-8")
PAGES = re.findall(r"^\| \d+ \| \[([^]]+)\]\((\S+\.md)\)", INDEX, re.MULTILINE)
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def guide(page: str) -> str:
    return (FOLDER / page).read_text(encoding="utf-8")


def sessions(page: str) -> Iterator[tuple[str, str, list[str]]]:
    """Iterate over the YAML of a page, each with the file that it is saved as and the commands shown after it."""
    blocks = FENCE.findall(guide(page))
    for n, (language, text) in enumerate(blocks):
        if language == "csv":
            commands = next(told for plain, told in blocks[n:] if not plain)
            yield text, next(word for word in commands.split() if word.endswith(".csv")), []
    for (language, text), (after, commands) in zip(blocks, [*blocks[1:], ("", "")], strict=True):
        if language == "yaml":
            told = commands.splitlines() if not after else []
            names = [word for line in told for word in line.split() if word.endswith(".yaml")]
            yield text, (names or [""])[0], told


@pytest.mark.parametrize("page", [page for _, page in PAGES])
def test_the_examples_of_a_page_do_as_it_says(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    flown = 0
    for text, file, commands in sessions(page):
        if not file:
            assert "\ntask:" not in text, "a complete task is followed by the command that flies it"
            continue
        Path(file).write_text(text, encoding="utf-8")
        for command in commands:
            words = shlex.split(command.removeprefix("formiga "))
            assert run(words) == 0, f"{command}\n{''.join(capsys.readouterr())}"
            flown += words[0] == "dryrun"
    assert flown >= 1


def test_no_yaml_of_the_guide_goes_unchecked() -> None:
    for page in (page for _, page in PAGES):
        outside = FENCE.sub("", guide(page))
        assert not re.search(r"^ {4}", outside, re.MULTILINE), page


BREAKS = {
    "`to: ${target}`": ("${above(target, 40 m)}", "${target}", "E066"),
    "`wait: 10`": ("wait: 10 s", "wait: 10", "E017"),
    "`do: drone.Takeoff`": ("drone.TakeOff", "drone.Takeoff", "E021"),
}


@pytest.mark.parametrize("written", [*BREAKS, "nothing after `wait`"])
def test_the_first_task_breaks_as_its_page_says(
    written: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = guide("first-task.md")
    assert f"| {written} |" in page
    ((text, _, _),) = sessions("first-task.md")
    old, new, code = BREAKS.get(written, (text.split("- wait: 10 s\n")[1], "", "E031"))
    assert text.count(old) == 1
    file = tmp_path / "look_at.yaml"
    file.write_text(text.replace(old, new), encoding="utf-8")

    assert run(["check", str(file)]) == 1
    assert capsys.readouterr().out.count(f": {code}: ") == 1


def test_the_index_names_every_page_under_its_title() -> None:
    assert sorted(page for _, page in PAGES) == sorted({p.name for p in FOLDER.glob("*.md")} - {"index.md"})
    for title, page in PAGES:
        assert guide(page).startswith(f"# {title}\n"), page


def test_each_page_leads_to_the_next() -> None:
    for (_, page), (title, following) in pairwise(PAGES):
        assert guide(page).endswith(f"\nNext: [{title}]({following})\n"), page


def test_the_page_of_steps_names_every_kind_and_modifier() -> None:
    steps = guide("steps.md")
    words = [*KINDS, *(modifier.name for modifier in MODIFIERS)]
    assert [word for word in words if f"| `{word}" not in steps and word != "note"] == []


def test_every_option_of_a_step_is_spoken_of_somewhere() -> None:
    text = "".join(guide(page) for _, page in PAGES)
    options = {option.name for kind in KINDS.values() for option in kind.options}
    assert sorted(name for name in options if not re.search(rf"(?<!\w){name}\b", text)) == []


@pytest.mark.parametrize(("page", "options"), [("file.md", TASK), ("roles.md", ROLE), ("retries.md", RETRY)])
def test_a_page_names_every_key_of_what_it_explains(page: str, options: tuple[Option, ...]) -> None:
    text = guide(page)
    assert [option.name for option in options if not re.search(rf"`{option.name}\b", text)] == []
