"""News of a running engine over real sockets: what goes out, what comes back, and that a new start goes on."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.app import run
from formiga_bt.services.kept.journaling import JournalAt
from tests.unit.services.conftest import Service, Start
from tests.unit.services.news.receiver import SECRET, Receiver, kinds, receiving

pytestmark = pytest.mark.network
ROOM = "  room: {webhook: {url: {file: room.url}, secret: {file: room.secret}, private: true}}\n"
CHIEF = (
    ROOM.replace("room:", "chief:").replace("true}}", "true}, unacknowledged: 20 s}").replace("room.url", "chief.url")
)


def with_news(folder: Path, text: str = ROOM, **urls: str) -> None:
    """Let the site of a folder have channels."""
    with (folder / "site.yaml").open("a", encoding="utf-8") as file:
        file.write(f"news:\n{text}")
    for name, said in {"room.secret": SECRET, **{f"{name}.url": url for name, url in urls.items()}}.items():
        (folder / name).write_text(said, encoding="utf-8")
        (folder / name).chmod(0o600)


def settled(service: Service, receiver: Receiver, kind: str) -> Callable[[], bool]:
    return lambda: kind in kinds(receiver)


def data(receiver: Receiver, kind: str) -> dict[str, Any]:
    return next(dict(body["data"]) for _, body in receiver.got if body["type"] == kind)


def test_ends_questions_and_alarms_go_out_without_names_and_once(start: Start, tmp_path: Path) -> None:
    with receiving() as receiver:
        with_news(tmp_path, room=receiver.url)
        with start() as service:
            task = service.submit("Ask")
            service.wait(settled(service, receiver, "question.opened"))
            service.post("/v1/lockdown", {"how": "hold"})
            service.post("/v1/alarms/A1/ack", {"by": "ann"})
            service.post("/v1/lockdown", {"how": "release"})
            service.post(f"/v1/tasks/{task}/abort", {})
            service.wait(settled(service, receiver, "task.ended"))
        assert sorted(kinds(receiver)) == [
            "alarm.acknowledged", "alarm.cleared", "alarm.raised", "question.opened", "task.ended",
        ]  # fmt: skip
        assert len({ident for ident, _ in receiver.got}) == 5
        assert data(receiver, "task.ended") == {
            "site": "meadow", "id": task, "task": task, "state": "CANCELED", "severity": "info", "code": "aborted",
        }  # fmt: skip
        assert data(receiver, "question.opened")["id"] == "Q1"
        assert data(receiver, "alarm.raised")["severity"] == "critical"
        assert not any("watcher_1" in str(body) or "ann" in str(body) for _, body in receiver.got)


def test_what_a_dead_receiver_missed_comes_after_a_new_start(start: Start, tmp_path: Path) -> None:
    kept = JournalAt(str(tmp_path / "journal.db"))
    with receiving() as receiver:
        port = receiver.port
    with_news(tmp_path, room=receiver.url)  # nobody is there any more
    with start(journal=kept) as service:
        service.post("/v1/lockdown", {"how": "hold"})
        service.wait(lambda: service.get("/v1/news")["channels"][0]["state"] == "failing")
        assert service.get("/v1/news")["channels"][0].get("waits_since")
    with receiving(port) as receiver, start(journal=kept) as service:
        service.wait(settled(service, receiver, "alarm.raised"))
        service.post("/v1/lockdown", {"how": "release"})
        service.wait(settled(service, receiver, "alarm.cleared"))
    first = len(receiver.got)
    assert kinds(receiver) == ["alarm.raised", "alarm.cleared"]
    with receiving(port) as receiver, start(journal=kept) as service:
        service.post("/v1/lockdown", {"how": "hold"})
        service.wait(settled(service, receiver, "alarm.raised"))
    assert (first, len(receiver.got)) == (2, 1)  # what was told is not told again after a clean end


def test_an_alarm_that_nobody_acknowledges_goes_to_the_next_channel(start: Start, tmp_path: Path) -> None:
    with receiving() as room, receiving() as chief:
        with_news(tmp_path, ROOM + CHIEF, room=room.url, chief=chief.url)
        with start() as service:  # 20 s of engine time are one second here
            service.post("/v1/lockdown", {"how": "hold"})
            service.wait(lambda: chief.got)
            service.post("/v1/lockdown", {"how": "release"})
            service.post("/v1/lockdown", {"how": "hold"})
            service.post("/v1/alarms/A2/ack")
            service.wait(lambda: "alarm.acknowledged" in kinds(room))
            service.post("/v1/lockdown", {"how": "release"})
            service.wait(lambda: kinds(room).count("alarm.cleared") == 2)
        assert kinds(chief) == ["alarm.escalated"]
        assert "alarm.escalated" not in kinds(room)


def test_a_dead_receiver_hinders_neither_another_one_nor_the_engine(start: Start, tmp_path: Path) -> None:
    other = ROOM.replace("room:", "other:").replace("room.url", "other.url")
    with receiving() as dead, receiving() as alive:
        dead.answer = lambda: (time.sleep(20), (500, {}, b""))[1]  # type: ignore[func-returns-value]
        with_news(tmp_path, ROOM + other, room=dead.url, other=alive.url)
        with start() as service:
            began = time.monotonic()
            for how in ("hold", "release") * 5:
                service.post("/v1/lockdown", {"how": how})
            service.wait(lambda: len(alive.got) == 10)
            assert time.monotonic() - began < 10
        assert len(dead.got) <= 2


def test_a_test_message_tells_what_came_back(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with receiving() as receiver:
        with_news(tmp_path, room=receiver.url)
        with start() as service:
            assert run(["news", "test", "room"]) == 0
            assert kinds(receiver) == ["test"]
            receiver.answer = lambda: (401, {}, b"who are you")
            assert run(["news", "test", "room"]) == 1
            assert "401: who are you" in capsys.readouterr().out
            assert run(["news"]) == 0
            told = capsys.readouterr().out
            assert "room" in told
            assert str(receiver.port) not in told
            assert service.refused("POST", "/v1/news/roof/test")["code"] == "unknown_channel"


def test_a_site_without_channels_tells_nobody(service: Service) -> None:
    assert service.get("/v1/news") == {"channels": []}
