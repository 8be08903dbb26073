"""`formiga access ca`, `agent`, `keys`, `revoke agent`; `formiga router` as far as it starts nothing; keys of an agent."""

import json
import time
from pathlib import Path

import pytest

from formiga_bt.agent import Agent, action
from formiga_bt.agent.process import run as run_agent
from formiga_bt.base.certificates import read_keys
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.lang.loader import load_site
from formiga_bt.services.listening import keys_of, listen_of

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "site.yaml").write_text(start("site").replace("@site", "meadow"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / ".formiga" / "meadow" / "keys"


def said(*words: str) -> int:
    return run(["access", *words])


def transports(options: str) -> None:
    text = Path("site.yaml").read_text(encoding="utf-8")
    head, _, tail = text.partition("transports:")
    rest = tail.partition("\n")[2]
    Path("site.yaml").write_text(f"{head}transports: {options}\n{rest}", encoding="utf-8")


def test_keys_are_made_listed_renewed_and_revoked(keys: Path, capsys: Capture) -> None:
    assert said("ca", "--host", "engine.example") == 0
    line = next(one for one in capsys.readouterr().out.splitlines() if one.startswith("say in site.yaml: "))
    transports(line.partition("transports: ")[2])
    assert run(["check", "site.yaml"]) == 0
    site, problems, _ = load_site(Path("site.yaml"))
    assert site is not None
    assert (problems, keys_of(site), listen_of(site)) == ([], keys, "tls/0.0.0.0:7447")

    assert said("agent", "lwd_1", "lwd_2") == 0
    found = read_keys(keys / "lwd_1", time.time(), "lwd_1")
    assert (found.about.site, found.about.connect) == ("meadow", "tls/engine.example:7447")
    assert said("agent", "lwd_1") == 1
    assert said("agent", "lwd_1", "--renew") == said("program", "shop") == 0
    assert said("revoke", "agent", "lwd_2") == 0
    capsys.readouterr()
    assert said("keys", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert [(one["name"], one["state"]) for one in told["keys"]] == [
        ("lwd_1", "counts"),
        ("lwd_2", "revoked"),
        ("shop", "counts"),
    ]
    assert (told["hosts"], told["router"]) == (["engine.example"], "")
    assert said("keys") == 0


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["agent"], 2),
        (["program"], 2),
        (["agent", "lwd_1"], 1),  # there is no authority
        (["agent", "lwd_1", "--renew"], 1),
        (["revoke", "agent"], 2),
        (["revoke", "agent", "lwd_1"], 1),
        (["revoke", "3f9c0a1b", "4"], 2),
        (["ca", "meadow"], 2),
        (["ca", "--host", "a b"], 1),
    ],
)
def test_what_cannot_be_done_is_said(keys: Path, capsys: Capture, words: list[str], code: int) -> None:
    assert said(*words) == code
    assert "Traceback" not in capsys.readouterr().err


def test_who_only_looks_makes_nothing(keys: Path, capsys: Capture) -> None:
    assert said("keys") == 0
    assert said("agent", "lwd_1") == said("revoke", "agent", "lwd_1") == 1
    assert "formiga access ca" in capsys.readouterr().err
    assert not keys.parents[1].exists()


def test_a_new_agent_of_a_site_with_keys_says_how_it_gets_its_own(keys: Path, capsys: Capture) -> None:
    transports('{zenoh: {listen: "tls/0.0.0.0:7447", keys: .formiga/meadow/keys}}')
    assert run(["new", "agent", "mule.py"]) == 0
    shown = capsys.readouterr().err
    assert "formiga access agent mule_1" in shown
    assert "python mule.py --keys .formiga/meadow/keys/mule_1" in shown
    assert "connect=" not in Path("mule.py").read_text(encoding="utf-8")


def test_no_private_key_is_ever_shown(keys: Path, capsys: Capture) -> None:
    assert said("ca") == said("agent", "lwd_1") == said("keys") == said("agent", "lwd_1", "--renew") == 0
    shown = "".join(capsys.readouterr())
    for file in keys.rglob("*key*"):
        if file.is_file():
            assert not any(line in shown for line in file.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ('{zenoh: {listen: "tls/0.0.0.0:7447", keys: k}}', 0),
        ("{zenoh: {keys: k}}", 0),
        ('{zenoh: {listen: "tls/0.0.0.0:7447"}}', 1),
        ('{zenoh: {listen: "tcp/127.0.0.1:7447", keys: k}}', 1),
        ('{zenoh: {listen: "tls/0.0.0.0:7447#enable_mtls=false", keys: k}}', 1),
        ('{zenoh: {listen: "tls/0.0.0.0:7447", keys: k, insecure: true}}', 1),
    ],
)
def test_tls_and_keys_belong_together(keys: Path, options: str, code: int) -> None:
    transports(options)
    assert run(["check", "site.yaml"]) == code


def test_a_router_needs_keys_that_count(keys: Path, capsys: Capture) -> None:
    assert run(["router"]) == 2
    assert "formiga access ca" in capsys.readouterr().err
    assert run(["router", "--keys", "keys", "--listen", "tcp/127.0.0.1:0"]) == 1
    assert run(["router", "--keys", "keys", "--restart"]) == 1
    assert "no router runs" in capsys.readouterr().err


def test_an_engine_does_not_start_with_keys_that_are_not_there(keys: Path, capsys: Capture) -> None:
    assert run(["up", "--http", "127.0.0.1:0", "--listen", "tls/127.0.0.1:1", "--keys", "nowhere"]) == 1
    assert "has no" in capsys.readouterr().err


class Mule(Agent, type="mule", mobility="ground"):
    """A mule."""

    @action
    async def Stand(self) -> None: ...  # noqa: N802 - actions are CamelCase


@pytest.mark.parametrize(
    ("words", "said_"),
    [
        (["--keys", "KEYS/lwd_2"], "not of lwd_1"),
        (["--keys", "nowhere"], "has no"),
        (["--keys", "KEYS/lwd_1", "--connect", "tcp/127.0.0.1:7447"], "not TLS"),
        (["--connect", "tls/127.0.0.1:7447"], "needs keys"),
        (["--connect", "tcp/10.0.0.5:7447"], "not TLS"),
    ],
)
def test_an_agent_does_not_start_where_it_would_believe_anybody(keys: Path, words: list[str], said_: str) -> None:
    assert said("ca") == said("agent", "lwd_1", "lwd_2") == 0
    with pytest.raises(SystemExit) as end:
        run_agent(Mule, id="lwd_1", site="meadow", arguments=[one.replace("KEYS", str(keys)) for one in words])
    assert said_ in str(end.value)
