"""`formiga doctor`: what is wrong with a site is found and named, and no check keeps the others waiting."""

import json
import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.authority import issue, make_authority, revoke
from formiga_bt.base.certificates import DAY_S, About
from formiga_bt.base.clock_sync import ClockSync, clock_sync
from formiga_bt.base.site_folder import EngineAddress
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.cli.operator.checkup import engine, machine
from formiga_bt.cli.operator.checkup.finding import Check, Finding, Patient, run_checks, worst
from formiga_bt.client import Client
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.journal.store import Journal
from formiga_bt.show.facts import EngineHealth, EngineLoad, LockdownFact
from tests.e2e.killing import free_port

Found = list[dict[str, Any]]


@pytest.fixture
def doctor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Look a site over; return the exit code and what is wrong. Its port is free, and the clock is said to be right."""
    text = start("site").replace("@site", "meadow").replace(":7447", ":0")
    (tmp_path / "site.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(machine, "clock_sync", lambda: ClockSync(True, 0.02))

    def look(*words: str) -> tuple[int, Found]:
        code = run(["doctor", "--http", "127.0.0.1:0", "--json", *words])
        told = json.loads(capsys.readouterr().out)
        wrong = [one for one in told["findings"] if one["level"] != "ok"]
        assert told["worst"] == max((one["level"] for one in told["findings"]), key=("ok", "warn", "fail").index)
        return code, wrong

    return look


@pytest.fixture
def runtime(tmp_path: Path) -> Path:
    """The runtime folder of a site that ran, and was ended cleanly."""
    folder = tmp_path / ".formiga" / "meadow"
    folder.mkdir(parents=True, mode=0o700)
    with Journal(folder / "journal.db", "meadow") as journal:
        journal.take()
        journal.begin(EngineState(), wall=5_000_000)
        journal.end(6_000_000)
    (folder / "epoch").write_text("1\n")
    (folder / "token").write_text("x" * 20)
    (folder / "token").chmod(0o600)
    return folder


def test_a_sound_site_is_sound_before_and_after_it_ran(doctor: Callable[..., Any], tmp_path: Path) -> None:
    assert doctor("--strict") == (0, [])
    assert not (tmp_path / ".formiga").exists(), "looking changes nothing"


def test_a_site_that_ran_is_sound(doctor: Callable[..., Any], runtime: Path) -> None:
    before = sorted(one.name for one in runtime.iterdir())
    assert doctor("--strict") == (0, [])
    assert sorted(one.name for one in runtime.iterdir()) == before


def open_token(folder: Path) -> None:
    (folder / "token").chmod(0o640)


def open_folder(folder: Path) -> None:
    folder.chmod(0o755)


def broken_marks(folder: Path) -> None:
    (folder / "marks.json").write_text("{")


def no_journal(folder: Path) -> None:
    (folder / "journal.db").unlink()


def damaged_journal(folder: Path) -> None:
    os.truncate(folder / "journal.db", 9000)


def another_journal(folder: Path) -> None:
    (folder / "journal.db").unlink()
    with Journal(folder / "journal.db", "harbour") as journal:
        journal.take()


def tree_with_an_error(folder: Path) -> None:
    trees = folder.parents[1] / "trees"
    trees.mkdir()
    (trees / "a.yaml").write_text("formiga: 1\ntask: A\nsteps: [{do: drone.Fly}]\n")


def site_with_an_error(folder: Path) -> None:
    site = folder.parents[1] / "site.yaml"
    site.write_text(site.read_text() + "spped: 3\n")


def no_site(folder: Path) -> None:
    (folder.parents[1] / "site.yaml").unlink()


@pytest.mark.parametrize(
    ("spoil", "check", "level", "where"),
    [
        (open_token, "files", "fail", "token"),
        (open_folder, "files", "fail", "meadow"),
        (broken_marks, "files", "fail", "marks.json"),
        (no_journal, "journal", "fail", "meadow"),
        (damaged_journal, "journal", "fail", "journal.db"),
        (another_journal, "journal", "fail", "journal.db"),
        (tree_with_an_error, "tasks", "warn", "trees/a.yaml"),
        (site_with_an_error, "site", "fail", "site.yaml"),
        (no_site, "site", "fail", "site.yaml"),
    ],
)
def test_what_is_wrong_is_named_with_its_place_and_what_mends_it(
    spoil: Callable[[Path], None], check: str, level: str, where: str, doctor: Callable[..., Any], runtime: Path
) -> None:
    spoil(runtime)
    code, found = doctor()
    assert {(one["check"], one["level"]) for one in found} == {(check, level)}
    assert where in found[0]["where"]
    assert all(one["fix"] for one in found)
    assert code == (level == "fail")
    assert doctor("--strict")[0] == 1


def test_a_port_that_is_held_names_its_holder(doctor: Callable[..., Any]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as held:
        code, (found,) = doctor("--http", f"127.0.0.1:{held.getsockname()[1]}")
    assert (code, found["check"]) == (1, "ports")
    assert f"process {os.getpid()}," in found["what"]


def test_the_port_of_a_router_that_does_not_run_is_looked_at(doctor: Callable[..., Any], tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    with socket.create_server(("127.0.0.1", 0)) as held:
        where = f"127.0.0.1:{held.getsockname()[1]}"
        site.write_text(site.read_text().replace("listen: tcp/127.0.0.1:0", f'listen: "tls/{where}", keys: keys'))
        _, found = doctor()
    assert [one["where"] for one in found if one["check"] == "ports"] == [where]


def test_a_clock_that_nobody_keeps_right_is_told(doctor: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    for told in (ClockSync(False, 0.0), ClockSync(True, 3.5), None):
        monkeypatch.setattr(machine, "clock_sync", lambda told=told: told)
        code, (found,) = doctor()
        assert (code, found["check"], found["level"]) == (0, "clock", "warn")


def test_the_kernel_says_how_its_clock_is() -> None:
    told = clock_sync()
    assert told is not None
    assert told.most_off_s >= 0


def test_a_full_disk_and_a_slow_one_are_told(doctor: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.statvfs(".")
    monkeypatch.setattr(os, "statvfs", lambda _: os.statvfs_result([*real[:4], 10, *real[5:]]))
    monkeypatch.setattr(machine, "SLOW_S", 0.0)
    code, found = doctor()
    assert (code, [(one["check"], one["level"]) for one in found]) == (1, [("disk", "fail"), ("disk", "warn")])


def test_a_library_that_is_too_old_or_missing_is_told(
    doctor: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    needed = ["msgspec>=999", "no-such-library>=1", "no-such-extra>=1; extra == 'x'"]
    monkeypatch.setattr(machine.metadata, "requires", lambda _: needed)
    code, found = doctor()
    assert code == 1
    assert [one["what"].partition(" ")[0] for one in found] == ["msgspec>=999", "no-such-library>=1"]


PATIENT = Patient(Path("site.yaml"), "127.0.0.1:0", Path("nowhere"))


def test_a_check_that_hangs_and_one_with_a_bug_hide_nothing() -> None:
    released = threading.Event()

    def hangs(_: Patient) -> list[Finding]:
        released.wait(60)
        return []

    def has_a_bug(_: Patient) -> list[Finding]:
        return [Finding("ok", str(1 // 0))]

    checks = [Check("a", "a disk", hangs), Check("b", "b", has_a_bug), Check("c", "c", lambda _: [])]
    begun = time.monotonic()
    found = run_checks(checks, PATIENT, given_s=0.2)
    assert time.monotonic() - begun < 5
    assert [(one.check, one.finding.level) for one in found] == [("a", "fail"), ("b", "warn"), ("c", "ok")]
    assert worst(found) == "fail"
    released.set()


@pytest.mark.parametrize(
    ("status", "kept", "level"),
    [
        ("ok", "ok", "ok"),
        ("overloaded", "ok", "warn"),
        ("deposed", "ok", "fail"),
        ("ok", "slow", "warn"),
        ("ok", "full", "fail"),
    ],
)
def test_how_the_engine_says_that_it_is(
    status: str, kept: str, level: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = EngineHealth(
        status=status, site="meadow", mode="simulation", version="0", epoch=3, pid=1, speed=1.0, endpoint="", at=0, ahead_us=0,
        steps=1, tasks={}, agents={}, questions=0, lockdown=LockdownFact(on=False), alarms=(), house=(),
        load=EngineLoad(waiting={}, most_waiting=0, replaced=0, behind_s=0.0), journal=kept,
    )  # fmt: skip
    monkeypatch.setattr(Client, "health", lambda _: told)
    address = EngineAddress("meadow", os.getpid(), 3, "http://127.0.0.1:1", "", folder=str(tmp_path))
    found = run_checks([Check("engine", "the engine", engine.health)], replace(PATIENT, engine=address))
    assert worst(found) == level


def test_an_engine_that_says_nothing_is_told_in_time() -> None:
    """Its process is stopped, or stands still: connections come in, and no answer goes out."""
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = EngineAddress("meadow", os.getpid(), 3, f"http://127.0.0.1:{mute.getsockname()[1]}", "")
        checks = [Check("engine", "the engine, if it runs", engine.health)]
        (found,) = run_checks(checks, replace(PATIENT, engine=address), given_s=0.3)
    assert found.finding.level == "fail"


def test_keys_that_do_not_fit_are_named_each_with_its_command(doctor: Callable[..., Any], tmp_path: Path) -> None:
    keys, now_s = tmp_path / "keys", time.time()
    site = tmp_path / "site.yaml"
    site.write_text(
        site.read_text().replace("listen: tcp/127.0.0.1:0", f'listen: "tls/127.0.0.1:{free_port()}", keys: keys')
    )
    code, found = doctor()
    assert (code, {(one["check"], one["level"]) for one in found}) == (1, {("keys", "fail"), ("keys", "warn")})

    make_authority(keys, "meadow", (), now_s)
    for name, at in (
        ("lwd_1", now_s),
        ("lwd_2", now_s - 25 * DAY_S),
        ("hwd_1", now_s),
        ("picker_1", now_s - 40 * DAY_S),
    ):
        issue(keys, name, About(), at)
    revoke(keys, "hwd_1", now_s)
    code, found = doctor()
    assert code == 0
    assert {one["fix"] for one in found} == {
        "formiga access agent lwd_2 --renew", "formiga access agent hwd_1", "formiga access agent picker_1 --renew",
        "formiga access agent watcher_1", "formiga router",
    }  # fmt: skip

    (keys / "ca.key").chmod(0o644)
    make_authority(keys, "meadow", (), now_s - 340 * DAY_S)
    (keys / "engine" / "key.pem").chmod(0o644)
    code, found = doctor()
    assert code == 1
    assert {one["where"] for one in found if one["level"] == "fail"} == {str(keys / "ca.key"), str(keys / "engine")}
    assert [one["fix"] for one in found if one["where"] == str(keys / "router")] == ["formiga access ca"]


def test_a_channel_of_the_news_without_its_secret_is_named(doctor: Callable[..., Any], tmp_path: Path) -> None:
    with (tmp_path / "site.yaml").open("a", encoding="utf-8") as file:
        file.write("news:\n  room: {webhook: {url: {file: room.url}, secret: {env: NO_SUCH_WORD}}}\n")
    _, wrong = doctor()
    assert [(one["check"], one["level"]) for one in wrong if one["check"] == "news"] == [
        ("news", "fail"),
        ("news", "warn"),
    ]
    (tmp_path / "room.url").write_text("https://example.org/key123")
    (tmp_path / "room.url").chmod(0o644)
    _, wrong = doctor()
    (first, _) = [one for one in wrong if one["check"] == "news"]
    assert "chmod 600" in first["fix"]
    assert "key123" not in str(wrong)
