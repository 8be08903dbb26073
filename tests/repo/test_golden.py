"""The golden files of `tests.golden`: no entry is left of a test that is gone, and a wrong text is shown with the way out."""

from pathlib import Path

import pytest

from tests.golden import Golden, Wording, normal

TEST = "tests/unit/none/test_no.py::test_no"


def test_every_entry_is_of_a_test_that_is_there(golden: Golden) -> None:
    assert not golden.stale(), "python -m pytest --update-golden drops them"


@pytest.fixture
def entries(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> tuple[Golden, Path]:
    monkeypatch.setattr("tests.golden.ROOT", tmp_path)
    (tmp_path / "tests/unit/none").mkdir(parents=True)
    (tmp_path / "tests/unit/none/test_no.py").touch()
    return Golden(update=True), tmp_path / "tests/unit/none/wording.txt"


def test_what_is_written_is_compared(entries: tuple[Golden, Path], tmp_path: Path) -> None:
    golden, file = entries
    given = Wording(golden, TEST)
    given(f"in {Path(__file__).parents[2]}/x\n\n  at 127.0.0.1:54321  \n\x1b[0m")
    given(["a", ("b", 1)], ValueError("c"))
    given.end()
    golden.write()

    assert file.read_text().partition("\n\n")[2] == (
        "test_no.py::test_no\n    in <formiga>/x\n\n      at 127.0.0.1:<n>\n    \\x1b[0m\n\n"
        "test_no.py::test_no (2)\n    a\n    b | 1\n    c\n"
    )
    again = Wording(Golden(update=False), TEST)
    again(f"in {Path(__file__).parents[2]}/x\n\n  at 127.0.0.1:12345\n\x1b[0m")
    with pytest.raises(
        pytest.fail.Exception, match=r'(?s)test_no \(2\).*-b \| 1\n\+b \| 2.*--update-golden "tests/unit'
    ):
        again(["a", ("b", 2)], "c")


def test_an_entry_that_is_not_used_any_more_is_found(entries: tuple[Golden, Path]) -> None:
    golden, file = entries
    for text in ("one", "two"):
        given = Wording(golden, f"{TEST}[{text}]")
        given(text)
        given(text)
    golden.write()

    less = Golden(update=False)
    given = Wording(less, f"{TEST}[one]")
    given("one")
    with pytest.raises(pytest.fail.Exception, match=r"one\] \(2\)"):
        given.end()
    less.files = {TEST.partition("::")[0]}
    less.tests = {f"{TEST}[one]"}
    assert less.stale() == [f"tests/unit/none/wording.txt: test_no.py::test_no[two]{n}" for n in ("", " (2)")]
    (file.parent / "test_no.py").unlink()
    assert len(less.stale()) == 4
    less.write()
    assert not file.exists()


def test_a_temporary_folder_reads_the_same_everywhere(tmp_path: Path) -> None:
    assert normal(f"cannot read {tmp_path}/site.yaml: no file") == "cannot read <tmp>/site.yaml: no file"
    assert normal(f"'{tmp_path}'") == "'<tmp>'"
