"""A backup under load, by real processes: killed in the middle, restored elsewhere, and nothing moves before a person says."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.base.site_folder import EngineAddress, find_engines
from formiga_bt.client import ApiError, Client
from tests.e2e.test_resume import ROOT, SLOW, fleet, flying, kill, wait
from tests.e2e.test_service import ASK, Shell, new_site, wait_for_agents

pytestmark = pytest.mark.network


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    (made.folder / "trees" / "ask.yaml").write_text(ASK, encoding="utf-8")
    site = made.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8") + "resume_hold_after: 10 min\n", encoding="utf-8")
    yield made
    made.close()


def status(at: EngineAddress) -> dict[str, str]:
    return {one.id: one.status for one in Client(at).tasks("", 10_000).tasks}


def held(at: EngineAddress) -> dict[str, tuple[str, ...]]:
    return {one.id: tuple(one.held) for one in Client(at).tasks("", 10_000).tasks if one.held}


def elsewhere(shell: Shell, folder: Path, file: Path) -> Shell:
    shell.run("restore", str(file), "--into", str(folder))
    made = Shell(folder)
    made.engines = shell.engines  # so that they are ended with the test
    return made


def test_a_mission_is_held_after_a_restore_until_a_person_lets_it_go_on(shell: Shell, tmp_path: Path) -> None:
    file, actions = tmp_path / "b.zip", tmp_path / "actions.yaml"
    shipped = (ROOT / "actions/base.yaml").read_text(encoding="utf-8")
    actions.write_text(shipped.replace("link_silence: 10 s", "link_silence: 300 s"), encoding="utf-8")
    site = shell.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8") + "actions: []\n", encoding="utf-8")
    up = ("--desk", "watcher_1", "--actions", str(actions), *SLOW)
    address = shell.up(*up)
    with fleet(shell, address, tmp_path / "sim", [actions]):
        wait_for_agents(shell, 5)
        shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "TakeOff"), what="the take-off")
        shell.run("backup", str(file))
        later = Client(address).request("Ask")  # the backup does not know it
        again = elsewhere(shell, tmp_path / "again", file)
        kill(shell)
        shell = again
        at = shell.up(*up, "--listen", address.endpoint)
        assert at.epoch > address.epoch + 400
        assert held(at) == {"Hello-1": ("resume", "lockdown")}
        with pytest.raises(ApiError) as refused:
            Client(at).request("Ask")
        assert refused.value.code == "lockdown"
        wait_for_agents(shell, 5)
        wait(lambda: not flying(shell, "TakeOff"), what="it stops")
        time.sleep(2)  # 20 s of engine time in which nothing may begin
        assert held(at) == {"Hello-1": ("resume", "lockdown")}
        assert [one.action for one in Client(at).agents().agents if one.action] == []

        kill(shell)  # who is killed before anybody has released it begins HELD again, and no backup is remembered
        at = shell.up(*up, "--listen", address.endpoint)
        assert set(held(at)["Hello-1"]) >= {"resume", "lockdown"}
        shell.run("lockdown", "release")
        assert "resume" in held(at)["Hello-1"]
        wait_for_agents(shell, 5)
        shell.run("continue", "Hello-1")
        wait(lambda: status(at)["Hello-1"] == "SUCCEEDED", what="the end of Hello-1")
        assert Client(at).request("Ask") not in (later, "Ask-1", "Ask-2")
        shell.run("down", "--yes")


def test_a_backup_under_load_is_whole_and_a_killed_one_harms_nothing(shell: Shell, tmp_path: Path) -> None:
    at, file, over = shell.up("--desk", "watcher_1"), tmp_path / "b.zip", threading.Event()
    (shell.folder / "trees" / "photo.bin").write_bytes(os.urandom(60_000_000))  # so that it takes a second or two
    asked: list[str] = []

    def load() -> None:
        while not over.is_set():
            asked.append(Client(at).request("Ask"))
            over.wait(0.03)

    thread = threading.Thread(target=load)
    thread.start()
    try:
        wait(lambda: len(asked) > 20, what="some tasks")
        shell.run("backup", str(file))
        known = len(asked)
        whole = file.read_bytes()
        for part in (file.with_name(".b.zip.part"), file.with_name(".b.zip.journal")):
            begun = shell.start("backup", str(file), "--force")
            wait(lambda part=part: part.exists(), what=f"{part.name} is begun")
            begun.send_signal(signal.SIGKILL)
            begun.communicate()
            assert file.read_bytes() == whole
        shell.run("backup", str(file), "--force")
        assert [one.name for one in tmp_path.iterdir() if one.name.startswith(".")] == []
    finally:
        over.set()
        thread.join()
    (found,) = find_engines(shell.folder)
    assert Client(found).health().journal == "ok"
    assert set(asked) <= set(status(at)), "the engine has all that it acknowledged"
    kill(shell)

    again = elsewhere(shell, tmp_path / "again", file)
    there = status(again.up("--desk", "watcher_1"))
    assert set(asked[:known]) <= set(there), "all that was acknowledged before the last backup began"
    again.run("down", "--yes")
