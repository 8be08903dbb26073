"""On a real site, what a model wrote is approved by somebody else, whichever way it comes: by the commands alone."""

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from anyio.from_thread import start_blocking_portal
from mcp import Client, Implementation, StdioServerParameters, stdio_client

from tests.e2e.terminal import at_terminal
from tests.e2e.test_loading import ANSWER, FILE, WORDS
from tests.e2e.test_mcp import LOOK, Assistant
from tests.e2e.test_real_site import approve, set_secrets
from tests.e2e.test_real_site import field as field
from tests.e2e.test_service import Shell
from tests.unit.llm.fake_endpoint import FakeEndpoint

pytestmark = pytest.mark.network
WROTE = r"was written by a model \(\S+ fake\) on the request of ann"


@pytest.fixture
def endpoint() -> Iterator[FakeEndpoint]:
    with FakeEndpoint([ANSWER] * 4) as made:
        yield made


def drafted(field: Shell, endpoint: FakeEndpoint) -> str:
    code, shown = at_terminal(
        field.folder, "draft", WORDS, "--base-url", endpoint.base_url, "--model", "fake", "--run", "--by", "ann",
        until=r"no such words", types=lambda _: "",
    )  # fmt: skip
    assert code == 1, shown
    return shown


def refused(field: Shell, file: str, by: str) -> str:
    """Return why an approver's word is not taken; nothing is asked for."""
    return field.run("approve", file, "--by", by, code=1)


def test_what_a_model_wrote_is_approved_by_another_whichever_way_it_comes(field: Shell, endpoint: FakeEndpoint) -> None:
    set_secrets(field, "bob")
    shown = drafted(field, endpoint)  # no engine runs
    assert "an approver who did not ask for it reads" in shown
    assert f"formiga approve {FILE} --by bob" in shown
    text = (field.folder / FILE).read_text(encoding="utf-8")
    assert re.match(r'# drafted \{"by": \["ann"\], "model": "\S+ fake"', text)
    said = refused(field, FILE, "ann")
    assert re.search(rf"LookAtShore {WROTE}; another approver \(bob\) must approve it", said), said
    assert re.search(rf"origin  it {WROTE}: who asked for it, or requests it, may not approve it", said), said

    field.up("--desk", "watcher_1")  # its file lies in trees/
    said = field.run("run", "LookAtShore", code=1)
    must = r"another approver \(bob\) must: formiga approve LookAtShore --by NAME"
    assert re.search(rf"LookAtShore \(\w{{8}}\) is not approved as it is now, and {WROTE}; {must}", said), said

    copy = re.sub(r"#.*", "", text).replace("LookAtShore", "Mine").replace("lake_shore:", "shore:")
    copy = copy.replace("${lake_shore}", "${shore}").replace("40 m", "45 m")
    assert "drafted" not in copy
    (field.folder / "missions").mkdir()
    (field.folder / "missions" / "mine.yaml").write_text(copy, encoding="utf-8")
    said = field.run("run", "missions/mine.yaml", code=1)  # read by the running engine
    assert re.search(rf"Mine \(\w{{8}}\) is not approved as it is now, and {WROTE}; ", said), said
    assert re.search(rf"Mine {WROTE}", refused(field, "missions/mine.yaml", "ann"))
    assert "is approved by bob" in approve(field, "missions/mine.yaml", "bob")
    said = field.run("run", "missions/mine.yaml", "--by", "bob", code=1)
    assert "and bob, who requests it, approved it; another approver (nobody else is named in" in said
    assert "Mine-1" in field.run("run", "missions/mine.yaml", "--by", "rita")

    field.run("drafts", "delete", "1")  # that it was drafted stays
    assert "there are no drafts" in field.run("drafts")
    said = field.run("load", FILE)
    assert re.search(rf"LookAtShore {WROTE}", refused(field, FILE, "ann"))
    field.run("down", "--yes")


def test_so_is_what_an_assistant_proposed(field: Shell) -> None:
    command = StdioServerParameters(
        command=sys.executable, args=["-m", "formiga_bt", "mcp", "--by", "ann"], cwd=field.folder
    )
    greeting = Client(stdio_client(command), client_info=Implementation(name="desk helper", version="1"))
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(greeting) as client:
        assistant = Assistant(portal, client, field.folder)
        told = assistant.call("propose_task", yaml=LOOK, params={"target": "lake_shore"}, why="Look at the shore.")
    (copied,) = [one.split() for one in told["next"] if one.startswith("cp ")]
    mine = Path(copied[-1])
    assert f"formiga approve {mine} --by bob" in told["next"]
    assert (
        Path(copied[-2]).read_text(encoding="utf-8").startswith('# drafted {"by": ["ann"], "model": "mcp:desk helper"')
    )
    mine.write_text(LOOK, encoding="utf-8")  # without the line
    (row,) = json.loads(field.run("drafts", "--json"))
    assert (row["number"], row["task"], row["by"]) == (1, "Look", "mcp:desk helper")
    field.up()
    said = refused(field, str(mine), "ann")
    who = r"was written by a model \(mcp:desk helper\) on the request of ann"
    assert re.search(rf"Look {who}; another approver \(bob\) must approve it", said), said
    assert re.search(rf"is not approved as it is now, and {who}", field.run("run", "Look", "-p", "target=camp", code=1))
    field.run("down", "--yes")
