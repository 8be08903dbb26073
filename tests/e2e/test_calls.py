"""Apps call services over real Zenoh: the page's program, a kill between request and answer, accounts, a real site."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.services.http.audit import read_audit
from formiga_bt.transport.zenoh_session import close_session, free_endpoint, open_session
from tests.e2e.rig import wait_until
from tests.e2e.test_service import Shell, new_site

pytestmark = pytest.mark.network

REAL = "mode: real\npilots: [{id: pia, max_airborne: 1}]"
PAGE = Path(__file__).parents[2] / "docs" / "services.md"


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Shell]:
    made = new_site(tmp_path)
    yield made
    made.close()


def called(endpoint: str, service: str, timeout_s: float = 10.0, /, **request: Any) -> Any:
    """Return the answer to a call, or None if there is none."""
    session = open_session("client", "my_meadow", connect=[endpoint])
    try:
        for reply in session.get(service, payload=json.dumps(request), timeout=timeout_s):
            return json.loads((reply.ok or reply.err).payload.to_bytes())
        return None
    finally:
        close_session(session)


def test_the_program_of_the_page_does_as_it_says(shell: Shell) -> None:
    engine = shell.up("--sim")
    wait_until(lambda: len(shell.json("agents")["agents"]) >= 5, what="its agents are there")
    program, _ = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    program = program.replace('"meadow", "tcp/127.0.0.1:7447"', f'"my_meadow", "{engine.endpoint}"')
    (shell.folder / "app.py").write_text(program, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "app.py"], cwd=shell.folder, capture_output=True, text=True, timeout=60, check=True
    )
    first, *agents, last = done.stdout.splitlines()
    assert first == "Hello-1 True"
    assert {line.split()[0] for line in agents} >= {"lwd_1", "picker_1"}
    assert last.startswith("Hello-1 ends")


def test_who_lost_the_answer_in_a_crash_gets_it_and_no_second_task(shell: Shell) -> None:
    engine = shell.up()
    first = called(engine.endpoint, "formiga/add_task", keyword="Hello", key="order-1")
    os.kill(engine.pid, signal.SIGKILL)
    shell.engines[-1].wait(20)

    engine = shell.up()

    assert called(engine.endpoint, "formiga/add_task", keyword="Hello", key="order-1") == first
    other = called(engine.endpoint, "formiga/add_task", keyword="Circle", key="order-1")
    assert other["code"] == "idempotency_conflict"
    assert shell.json("tasks")["total"] == 1


def test_an_account_speaks_by_its_name_and_with_its_roles(shell: Shell) -> None:
    shell.run("access", "add", "shop", "--role", "requester", "--task", "Hello")
    engine = shell.up()
    mine = called(engine.endpoint, "svc/shop/formiga/add_task", keyword="Hello", by="eve")["task_id"]
    assert shell.json("tasks")["tasks"][0]["by"] == "shop"
    no = called(engine.endpoint, "svc/shop/fleet_manager_front/assign_task", task_id=mine, mex_id="lwd_1")
    assert (no["code"], "operator" in no["text"]) == ("no_role", True)
    assert called(engine.endpoint, "svc/nobody/formiga/add_task", keyword="Hello")["code"] == "no_account"


def test_a_real_site_on_the_loopback_serves_nobody_whose_name_is_not_bound(shell: Shell) -> None:
    site = shell.folder / "site.yaml"
    site.write_text(site.read_text(encoding="utf-8").replace("mode: simulation", REAL), encoding="utf-8")
    shell.run("access", "add", "ann", "--role", "operator")
    engine = shell.up("--speed", "1")
    assert called(engine.endpoint, "formiga/add_task", 1.0, keyword="Hello") is None
    assert called(engine.endpoint, "svc/ann/formiga/add_task", 1.0, keyword="Hello") is None


@pytest.mark.slow
def test_a_program_with_keys_speaks_as_its_account_and_as_no_other(shell: Shell) -> None:
    site, endpoint = shell.folder / "site.yaml", free_endpoint("tls/127.0.0.1:0")
    text = site.read_text(encoding="utf-8").replace("mode: simulation", REAL)
    secured = f'listen: "{endpoint}", keys: .formiga/my_meadow/keys'
    site.write_text(text.replace("listen: tcp/127.0.0.1:0", secured), encoding="utf-8")
    shell.run("access", "ca")
    page = PAGE.read_text(encoding="utf-8")
    for command in re.findall(r"^formiga (access (?:add|program) .*)$", page, re.MULTILINE):
        shell.run(*command.split())
    shell.run("access", "add", "ann", "--role", "operator")
    router = shell.start("router")
    try:
        engine = shell.up("--speed", "1")
        _, program = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        program = program.replace("meadow", "my_meadow").replace("tls/engine.example:7447", engine.endpoint)

        def said(text: str) -> Any:
            (shell.folder / "app.py").write_text(text, encoding="utf-8")
            words = [sys.executable, "app.py"]
            done = subprocess.run(words, cwd=shell.folder, capture_output=True, text=True, timeout=60, check=False)
            return json.loads(done.stdout) if done.stdout else done.stderr

        wait_until(lambda: said(program), what="the program is let in by the router")
        assert said(program)["code"] == "not_approved", "mode real asks for the approval here too"
        listing = program.replace("formiga/add_task", "fleet_manager_front/get_mex_list").replace(
            '"keyword": "Hello", ', ""
        )
        assert said(listing) == {"mex": []}
        assert said(program.replace("svc/shop", "svc/ann")) == "", "another's name: silence"
        assert said(program.replace("svc/shop/", "")) == "", "and no name"
        assert "Error" in said(
            program.replace('"connect_certificate"', '"other"').replace('"connect_private_key"', '"another"')
        )
        asked = [line for line in read_audit(shell.folder / ".formiga" / "my_meadow") if line["who"] != "local"]
        assert {line["who"] for line in asked} == {"shop"}
    finally:
        router.terminate()
        router.communicate(timeout=20)
