"""A site with keys, every part a process: a mission is flown while its router is killed, and while it takes new rules."""

import configparser
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from formiga_bt.transport.zenoh_session import free_endpoint
from tests.e2e.test_resume import flying, goals_begun, wait
from tests.e2e.test_service import Shell, new_site, wait_for_agents

pytestmark = [pytest.mark.network, pytest.mark.slow]

DEPLOY = Path(__file__).parents[2] / "deploy"
AGENTS = ("lwd_1", "lwd_2", "hwd_1", "picker_1", "watcher_1")


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    site = made.folder / "site.yaml"
    text, endpoint = site.read_text(encoding="utf-8"), free_endpoint("tls/127.0.0.1:0")
    text = text.replace("listen: tcp/127.0.0.1:0", f'listen: "{endpoint}", keys: .formiga/my_meadow/keys')
    site.write_text(text, encoding="utf-8")
    yield made
    made.close()


def unit_of_the_router() -> configparser.SectionProxy:
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str  # type: ignore[method-assign, assignment]  # names of systemd have capitals
    unit.read(DEPLOY / "formiga-router@.service")
    return unit["Service"]


def test_a_mission_goes_on_when_its_router_is_killed_or_takes_new_rules(shell: Shell) -> None:
    shell.run("access", "ca")
    shell.run("access", "agent", *AGENTS[:-1])
    assert "formiga access agent watcher_1" in shell.run("up", "--sim", "--http", "127.0.0.1:0", code=1)
    shell.run("access", "agent", AGENTS[-1])
    unit = unit_of_the_router()
    program, *words = unit["ExecStart"].split()
    assert (program, unit["ExecReload"]) == ("/usr/local/lib/formiga/bin/formiga", "/bin/kill -HUP $MAINPID")
    router = shell.start(*words)
    try:
        shell.up("--sim", "--speed", "4")
        wait_for_agents(shell, len(AGENTS))
        shell.run("run", "Hello", "--param", "target=lake_shore")
        wait(lambda: flying(shell, "TakeOff") or flying(shell, "GoTo"), what="a drone in the air")
        router.kill()
        router.communicate(timeout=20)
        router = shell.start(*words)
        wait(lambda: flying(shell, "GoTo"), what="a drone on its way")
        assert "the router lets in the engine and hwd_1" in shell.run("router", "--restart", "--yes")
        wait(lambda: re.search("Hello-1.*(SUCCEEDED|FAILED)", shell.run("tasks")), what="the end of Hello-1")
        assert "SUCCEEDED" in shell.run("tasks")
        begun = goals_begun(shell, "my_meadow")
        assert begun
        assert set(begun.values()) == {1}, "no goal is begun twice"
        shell.run("down", "--yes")
        router.terminate()
        told, _ = router.communicate(timeout=float(unit["TimeoutStopSec"]))
        assert router.returncode == 0, told
    finally:
        router.kill()
        router.communicate(timeout=20)
