"""Files of an agent on a full disk: nothing ends, it is told once, and all is written when there is room."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from agents_sim import lines as module
from agents_sim.goalbook import GoalBook, read_books
from agents_sim.ledger import BodyFile, Saved
from agents_sim.lines import CALM_US, Disk, Lines
from agents_sim.motion import BodyState, Segment
from formiga_bt.base.geo import Place, Position
from tests.golden import Wording

STANDS = Position(0.0, 0.0, 0.0)
BODY = BodyState(Segment(0, STANDS, 0, STANDS), "rest", 80.0, 0, 0.1, Place(0.0, 0.0))


@contextmanager
def room(bytes_: int) -> Iterator[None]:
    """No file of this process can grow beyond so many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


class Told:
    """Takes what is told, unless it is deaf."""

    def __init__(self) -> None:
        self.now = 0
        self.texts: list[str] = []
        self.is_deaf = False
        self.disk = Disk("hwd_1", self.tell, lambda: self.now)
        self.files: list[Lines] = []

    def open(self, path: Path) -> Lines:
        self.files.append(Lines(path, self.disk))
        return self.files[-1]

    def tell(self, text: str) -> bool:
        if not self.is_deaf:
            self.texts.append(text)
        return not self.is_deaf


@pytest.fixture
def told() -> Iterator[Told]:
    made = Told()
    yield made
    for file in made.files:
        file.close()


def test_a_line_that_found_half_its_room_is_finished_later(tmp_path: Path, told: Told) -> None:
    file = told.open(tmp_path / "d.jsonl")
    file.write(b"first")
    with room(10):
        file.write(b"the second")
        file.write(b"the third")
        assert (tmp_path / "d.jsonl").read_bytes() == b"first\nthe "
    file.try_again()
    assert (tmp_path / "d.jsonl").read_bytes() == b"first\nthe second\nthe third\n"
    file.close()


def test_it_is_told_once_and_once_that_all_is_well(tmp_path: Path, told: Told, wording: Wording) -> None:
    files = [told.open(tmp_path / name) for name in ("a", "b")]
    with room(0):
        for file in (*files, *files):
            file.write(b"x")
    wording(told.texts)
    files[0].try_again()
    told.now = CALM_US
    files[0].try_again()
    assert len(told.texts) == 1  # the other one still waits
    files[1].try_again()
    wording(told.texts[1:])
    assert (tmp_path / "b").read_bytes() == b"x\nx\n"


def test_a_disk_that_is_full_now_and_then_is_told_once(tmp_path: Path, told: Told) -> None:
    file = told.open(tmp_path / "a")
    for _ in range(3):
        with room(0):
            file.write(b"x")
        file.try_again()
        told.now += CALM_US - 1
    assert len(told.texts) == 1


def test_what_could_not_be_told_is_told_later(tmp_path: Path, told: Told, wording: Wording) -> None:
    told.is_deaf = True
    file = told.open(tmp_path / "a")
    with room(0):
        file.write(b"x")
    told.is_deaf, told.now = False, CALM_US
    file.try_again()
    wording([text.partition(" (")[0] for text in told.texts])


def test_beyond_what_memory_takes_the_oldest_lines_are_given_up(
    tmp_path: Path, told: Told, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(module, "MOST_BYTES", 20)
    file = told.open(tmp_path / "a")
    with room(2):
        for n in range(6):
            file.write(f"line{n}".encode())  # 6 bytes each; of the first one two are written
    told.now = CALM_US
    file.try_again()
    assert (tmp_path / "a").read_bytes() == b"line0\nline4\nline5\n"
    wording(told.texts[-1])


def test_a_line_cut_short_by_a_death_does_not_spoil_the_next(tmp_path: Path) -> None:
    with (tmp_path / "d.goals.jsonl").open("wb") as file:
        file.write(b'{"agent":"d","goal":"a","state":"begun","wall":1,"at":1}\n{"agent":"d","go')
    book = GoalBook(tmp_path, "d", lambda: 7)
    book.note("b", "begun")
    book.close()
    assert [note.goal for note in read_books(tmp_path)] == ["a", "b"]


def test_a_file_that_cannot_be_made_is_made_later(tmp_path: Path, told: Told, wording: Wording) -> None:
    file = told.open(tmp_path / "gone" / "a")
    file.write(b"x")
    wording(told.texts)
    (tmp_path / "gone").mkdir()
    file.close()
    assert (tmp_path / "gone" / "a").read_bytes() == b"x\n"


def test_a_body_that_cannot_be_saved_is_as_it_was(tmp_path: Path, told: Told, wording: Wording) -> None:
    file = BodyFile(tmp_path, "d", told.disk)
    file.save(Saved(body=BODY, engine_us=1, wall_us=1, speed=1.0))
    with room(0):
        file.save(Saved(body=BODY, engine_us=2, wall_us=2, speed=1.0))
    saved = file.load()
    assert saved is not None
    assert saved.engine_us == 1
    wording(told.texts[0])
