"""Attacks on the wire of a secured site, over real Zenoh: a router in a process of its own, an engine's end and agents here.

Each attack is refused, the engine hears nothing of it, whoever is honest goes on, and the router says why. `Attacker.put`
and the like use Zenoh as it is: nothing of formiga's own keeps an attacker from anything.
"""

import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import pytest
import zenoh

from formiga_bt.base.authority import issue, make_authority, renew, revoke
from formiga_bt.base.certificates import DAY_S, About, Keys, KeysError, read_keys
from formiga_bt.base.clock import SECOND
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.calls import Call
from formiga_bt.transport.messages import (
    AgentCard,
    AgentGone,
    AgentSeen,
    BadMessage,
    ClockBeat,
    GoalReported,
    GoalRequest,
    SendFailed,
    StatusArrived,
    TransportEvent,
)
from formiga_bt.transport.zenoh import ZenohTransport
from formiga_bt.transport.zenoh_agent import ZenohAgentLink
from formiga_bt.transport.zenoh_session import free_endpoint, open_session

pytestmark = pytest.mark.network

SITE, ENGINE_ID = "vault", "e1"
DEADLINE_S = 20.0
T = TypeVar("T")

SITE_FILE = """\
formiga_site: 1
name: vault
base: {{lat: 66.5, lng: 25.7, ground_msl: 120 m}}
fence: [{{east: 0 m, north: 0 m}}, {{east: 9 m, north: 0 m}}, {{east: 9 m, north: 9 m}}]
transports: {{zenoh: {{listen: "{endpoint}", keys: keys}}}}
mode: simulation
"""


def until(found: Callable[[], T | None], what: Callable[[], str] | str) -> T:
    end = time.monotonic() + DEADLINE_S
    while True:
        value = found()
        if value:
            return value
        assert time.monotonic() < end, f"waited in vain for {what if isinstance(what, str) else what()}"
        threading.Event().wait(0.02)


class Vault:
    """A secured site: its keys, its router as `formiga router` runs it, the engine's end of the wire."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.keys = folder, folder / "keys"
        self.endpoint = free_endpoint("tls/127.0.0.1:0")
        (folder / "site.yaml").write_text(SITE_FILE.format(endpoint=self.endpoint), encoding="utf-8")
        make_authority(self.keys, SITE, (), time.time())
        for name in ("victim", "mallory", "gone"):
            issue(self.keys, name, About(), time.time())
        issue(self.keys, "shop", About(), time.time(), is_program=True)
        issue(self.keys, "late", About(), time.time() - 40 * DAY_S)
        self.said = folder / "router.log"
        self.router: subprocess.Popen[bytes] | None = None
        self.start_router()
        self.heard: list[TransportEvent] = []
        self.engine = ZenohTransport(SITE, listen=self.endpoint, keys=self.keys, reply_timeout_s=1.0)
        self.engine.serve_calls(Desk(), bare=not self.engine.binds_names)
        self.engine.open(lambda: None)
        self.beats = 0

    def start_router(self) -> None:
        program = "import sys; from formiga_bt.cli import main; sys.argv[0] = 'formiga'; main()"
        with self.said.open("ab") as log:
            self.router = subprocess.Popen(
                [sys.executable, "-c", program, "router"], cwd=self.folder, stdout=log, stderr=log
            )
        self.says("it lets in the engine")

    def end_router(self) -> None:
        assert self.router is not None
        self.router.terminate()
        self.router.wait(10)

    def says(self, words: str) -> str:
        def found() -> str | None:
            lines = self.said.read_text(encoding="utf-8").splitlines() if self.said.exists() else []
            return next((line for line in reversed(lines) if words in line), None)

        return until(found, lambda: f"{words!r} in {self.said.read_text(encoding='utf-8')[-2000:]}")

    def hear(self, kind: type[T], fits: Callable[[Any], bool], since: int = 0) -> T:
        def found() -> T | None:
            self.heard.extend(self.engine.poll())
            return next((one for one in self.heard[since:] if isinstance(one, kind) and fits(one)), None)

        return until(found, lambda: f"{kind.__name__}; heard {self.heard[since:][-5:]}")

    def beat(self, epoch: int = 4) -> None:
        self.beats += 1
        self.engine.publish_clock(
            ClockBeat(
                wall_us=0, engine_us=self.beats * SECOND, speed=1.0, epoch=epoch, beat=self.beats, engine_id=ENGINE_ID
            )
        )

    def goal(self, agent: str, goal_id: str, epoch: int = 4, engine_id: str = ENGINE_ID) -> str:
        self.engine.send_goal(
            GoalRequest(
                goal_id=goal_id, agent=agent, action="Go", fields={}, epoch=epoch, beat=self.beats, engine_id=engine_id
            )
        )
        found = self.hear(GoalReported, lambda one: one.event.goal_id == goal_id).event
        return found.code or found.state

    def is_unharmed(self, agent: "Honest") -> None:
        """The honest agent is heard, and gets its goals."""
        mark = len(self.heard)
        self.hear(StatusArrived, lambda one: one.status.id == agent.name, since=mark)
        assert self.goal(agent.name, f"after/{mark}/{time.monotonic_ns()}") in ("accepted", "busy")
        assert not [one for one in self.heard if isinstance(one, BadMessage) and one.agent == agent.name]

    def close(self) -> None:
        self.engine.close()
        self.end_router()


class Desk:
    """Answers calls with whose they are."""

    services = ("formiga/add_task",)
    urgent = ()

    def answer(self, call: Call) -> bytes:
        return f"{call.principal} calls {call.service}".encode()


class Honest:
    """An agent that keeps all rules, with its own keys."""

    def __init__(self, vault: Vault, name: str, endpoint: str = "") -> None:
        self.name, self.started, self.beats = name, [], []
        own = read_keys(vault.keys / name, time.time(), name)
        self.link = ZenohAgentLink(SITE, connect=endpoint or vault.endpoint, keys=own)
        card = AgentCard(id=name, type="drone", boot_id=f"b{time.monotonic_ns()}", actions=("Go",))
        self.side = AgentSide(card, self, self.link, now=lambda: time.monotonic_ns() // 1000)
        self.stop = threading.Event()
        self.link.serve(self.side)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self) -> None:
        while not self.stop.is_set():
            self.link.pump(0.05)
            self.side.publish_status(battery=80.0)

    def start(self, request: GoalRequest) -> str:
        self.started.append(request.goal_id)
        return ""

    def cancel(self, goal_id: str) -> bool:
        return True

    def close(self) -> None:
        self.stop.set()
        self.thread.join(5)
        self.link.close()


class Attacker:
    """A session that does as it likes, with whatever keys it has."""

    def __init__(self, vault: Vault, keys: Keys | None, mode: str = "peer", endpoint: str = "") -> None:
        self.session = open_session(mode, SITE, connect=[endpoint or vault.endpoint], keys=keys)
        self.kept: list[Any] = []
        self.caught: list[str] = []

    def catch(self, sample: Any) -> None:
        self.caught.append(str(sample.key_expr))

    def close(self) -> None:
        self.session.close()


@pytest.fixture(scope="module")
def vault(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Vault]:
    made = Vault(tmp_path_factory.mktemp("vault"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def victim(vault: Vault) -> Iterator[Honest]:
    agent = Honest(vault, "victim")
    vault.hear(AgentSeen, lambda one: one.card.id == "victim")
    vault.beat()
    yield agent
    agent.close()


@pytest.fixture
def attack(vault: Vault, victim: Honest) -> Iterator[Callable[..., Attacker]]:
    made: list[Attacker] = []

    def make(keys: Keys | None, **more: Any) -> Attacker:
        made.append(Attacker(vault, keys, **more))
        return made[-1]

    yield make
    for one in made:
        one.close()
    vault.is_unharmed(victim)


def as_they_are(folder: Path) -> Keys:
    """Keys that nobody looked through."""
    return Keys(folder, "whoever", 0)


def only_tls(vault: Vault) -> Keys:
    """Keys of somebody who knows the authority's certificate, and has none of their own."""

    class Bare(Keys, frozen=True):
        def tls(self, *, listens: bool) -> dict[str, str | bool]:
            return {"root_ca_certificate": str(self.folder / "ca.pem"), "enable_mtls": False}

    return Bare(vault.keys, "", 0)


STATUS = {"id": "victim", "type": "drone", "boot_id": "b", "seq": 10**6, "stamp": 10**6, "battery": 1.0}


def heard_of(vault: Vault, battery: float) -> bool:
    vault.heard.extend(vault.engine.poll())
    return any(isinstance(one, StatusArrived) and one.status.battery == battery for one in vault.heard)


# -- who is not let in ------------------------------------------------------------------------------------------------
def test_without_a_certificate_nobody_gets_in(vault: Vault, attack: Callable[..., Attacker]) -> None:
    attack(only_tls(vault)).session.put("drone/victim/status", json.dumps(STATUS))
    vault.says("refused a connection: it showed no certificate")
    assert not heard_of(vault, 1.0)


def test_without_tls_nobody_gets_in(vault: Vault, attack: Callable[..., Attacker]) -> None:
    attack(None, endpoint=vault.endpoint.replace("tls/", "tcp/")).session.put("drone/victim/status", json.dumps(STATUS))
    vault.says("refused a connection: it does not speak TLS")
    assert not heard_of(vault, 1.0)


def test_a_certificate_of_another_authority_lets_nobody_in(
    vault: Vault, attack: Callable[..., Attacker], tmp_path: Path
) -> None:
    make_authority(tmp_path / "keys", SITE, (), time.time())
    issue(tmp_path / "keys", "victim", About(), time.time())
    own = tmp_path / "keys" / "victim"
    shutil.copy(vault.keys / "ca.pem", own / "ca.pem")
    attack(as_they_are(own)).session.put("drone/victim/status", json.dumps(STATUS))
    vault.says("refused a connection: its certificate is not of this site's authority")
    assert not heard_of(vault, 1.0)
    with pytest.raises(KeysError, match="not of the authority"):
        read_keys(own, time.time())


def test_an_expired_certificate_lets_nobody_in(vault: Vault, attack: Callable[..., Attacker]) -> None:
    attack(as_they_are(vault.keys / "late")).session.put("drone/late/status", json.dumps(STATUS))
    vault.says("refused a connection: its certificate has expired")
    with pytest.raises(KeysError, match="expired"):
        read_keys(vault.keys / "late", time.time())


def test_a_certificate_of_the_router_is_no_agents_and_the_other_way_round(
    vault: Vault, attack: Callable[..., Attacker], victim: Honest
) -> None:
    attack(as_they_are(vault.keys / "router"))
    vault.says("refused a connection: ")
    # An agent that plays the router: nobody believes it.
    endpoint = free_endpoint("tls/127.0.0.1:0")
    fake = open_session("router", "", listen=[endpoint], keys=as_they_are(vault.keys / "mallory"), rules={})
    seen = []
    listener = fake.info.declare_link_events_listener(lambda event: seen.append(event), history=True)
    lured = Honest(vault, "gone", endpoint)
    try:
        key = f"{SITE}/engine/clock"
        beat = ClockBeat(wall_us=0, engine_us=SECOND, speed=1.0, epoch=9, beat=9, engine_id="fake")
        end = time.monotonic() + 2.0
        while time.monotonic() < end:  # longer than a link takes elsewhere in this file
            fake.put(key, msgspec.json.encode(beat))
            threading.Event().wait(0.1)
        assert seen == []
    finally:
        lured.close()
        del listener
        fake.close()


# -- what an agent may not --------------------------------------------------------------------------------------------
@pytest.fixture
def mallory(vault: Vault, attack: Callable[..., Attacker]) -> Attacker:
    """Somebody with the keys of an agent of the site, who is not who they play."""
    made = attack(read_keys(vault.keys / "mallory", time.time()))
    until(lambda: made.session.info.routers_zid(), "a link")
    return made


def pass_through(vault: Vault, mallory: Attacker) -> None:
    """Say something that mallory may: what it said before on its link has come through, or never will."""
    number = time.monotonic_ns() % 10**9
    own = {**STATUS, "id": "mallory", "seq": number, "stamp": number}
    mallory.kept.append(
        mallory.session.declare_queryable(
            "drone/mallory/card",
            lambda query: query.reply(
                "drone/mallory/card",
                msgspec.json.encode(AgentCard(id="mallory", type="drone", boot_id="b", actions=("Go",))),
            ),
        )
    )
    mark = len(vault.heard)

    def heard() -> bool:
        own["seq"] += 1
        mallory.session.put("drone/mallory/status", json.dumps(own))
        vault.heard.extend(vault.engine.poll())
        return any(isinstance(one, StatusArrived) and one.status.id == "mallory" for one in vault.heard[mark:])

    until(heard, "mallory's own status")


def test_an_agent_does_not_write_what_another_one_is(vault: Vault, mallory: Attacker) -> None:
    mallory.session.put("drone/victim/status", json.dumps(STATUS))
    mallory.session.put("drone/victim/card", b"{}")
    mallory.session.delete("drone/victim/status")
    event = {"goal_id": "x", "agent": "victim", "state": "succeeded", "n": 9, "status": STATUS}
    mallory.session.put("drone/victim/action/Go/event", json.dumps(event))
    mallory.session.put("drone/victim/event/sos", json.dumps({"agent": "victim", "event": "sos"}))
    mallory.session.put("boat/victim/status", json.dumps({**STATUS, "type": "boat"}))
    pass_through(vault, mallory)
    assert not heard_of(vault, 1.0) or all(
        one.status.id == "mallory"
        for one in vault.heard
        if isinstance(one, StatusArrived) and one.status.battery == 1.0
    )
    assert not [one for one in vault.heard if isinstance(one, GoalReported) and one.event.goal_id == "x"]
    assert not [one for one in vault.heard if isinstance(one, BadMessage)]
    vault.says(f"refused mallory: put {SITE}/drone/victim/status")
    vault.says(f"refused mallory: put {SITE}/drone/victim/action/Go/event")


def test_an_agent_is_not_present_as_another_one_and_does_not_answer_for_it(vault: Vault, mallory: Attacker) -> None:
    token = mallory.session.liveliness().declare_token("drone/ghost/alive")
    answered: list[str] = []
    for key in ("drone/ghost/card", "drone/victim/card", "drone/victim/goals", "*/*/action/*/goal", "**"):
        mallory.kept.append(mallory.session.declare_queryable(key, lambda query: answered.append(str(query.key_expr))))
    pass_through(vault, mallory)
    assert vault.goal("victim", f"mine/{time.monotonic_ns()}") in ("accepted", "busy")
    assert not [one for one in vault.heard if isinstance(one, AgentSeen) and one.card.id == "ghost"]
    assert [key for key in answered if "mallory" not in key] == []
    vault.says("refused mallory: liveliness token")
    token.undeclare()


def test_an_agent_sends_no_goal_and_cancels_none(vault: Vault, victim: Honest, mallory: Attacker) -> None:
    before = list(victim.started)
    goal = GoalRequest(goal_id="evil", agent="victim", action="Go", fields={}, epoch=99, beat=1, engine_id=ENGINE_ID)
    said: list[str] = []
    for what in ("goal", "cancel", "update"):
        said += [
            str(reply.ok) for reply in mallory.session.get(
                f"drone/victim/action/Go/{what}", payload=msgspec.json.encode(goal), timeout=1.0,
                target=zenoh.QueryTarget.ALL,
            )
        ]  # fmt: skip
    pass_through(vault, mallory)
    assert said == []
    assert "evil" not in victim.started
    assert set(victim.started) >= set(before)
    vault.says(f"refused mallory: query {SITE}/drone/victim/action/Go/goal")


def test_an_agent_is_not_the_engine(vault: Vault, victim: Honest, mallory: Attacker) -> None:
    beat = ClockBeat(wall_us=0, engine_us=SECOND, speed=1.0, epoch=900, beat=9, engine_id="evil")
    mallory.session.put("engine/clock", msgspec.json.encode(beat))
    mallory.session.put("engine/site", b"{}")
    mallory.kept.append(mallory.session.liveliness().declare_token("engine/alive"))
    for key in ("engine/site", "engine/attachments/*"):
        mallory.kept.append(mallory.session.declare_queryable(key, lambda query: mallory.caught.append("asked")))
    pass_through(vault, mallory)
    vault.beat()
    mark = len(vault.heard)
    told = vault.hear(
        StatusArrived, lambda one: one.status.id == "victim" and one.status.beat == vault.beats, since=mark
    )
    assert (told.status.epoch, told.status.engine_id, told.status.epoch_ignored) == (4, ENGINE_ID, 0)
    assert "asked" not in mallory.caught
    vault.says(f"refused mallory: put {SITE}/engine/clock")


def test_an_agent_hears_nothing_of_others_and_looks_into_nothing(
    vault: Vault, victim: Honest, mallory: Attacker
) -> None:
    for key in ("**", "*/*/status", "drone/victim/**", "*/*/action/*/event"):
        mallory.kept.append(mallory.session.declare_subscriber(key, mallory.catch))
    mallory.kept.append(mallory.session.liveliness().declare_subscriber("**", mallory.catch, history=True))
    mallory.kept.append(mallory.session.declare_subscriber("engine/clock", mallory.catch))
    until(lambda: vault.beat() or "engine/clock" in mallory.caught, "the clock, which it may hear")
    vault.is_unharmed(victim)
    assert [key for key in mallory.caught if "mallory" not in key and key != "engine/clock"] == []
    assert list(mallory.session.get("drone/victim/card", timeout=1.0)) == []
    config = {
        "mode": "client", "connect": {"endpoints": [vault.endpoint]},
        "transport": {"link": {"tls": read_keys(vault.keys / "mallory", time.time()).tls(listens=False)}},
    }  # fmt: skip
    bare = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    try:
        own = str(bare.zid())  # a session tells itself what it is
        for key in ("@/**", "**"):
            assert [one for one in bare.get(key, timeout=1.0) if str(one.replier_id.zid) != own] == []
    finally:
        bare.close()


def test_an_agent_that_plays_a_router_breaks_nothing(
    vault: Vault, victim: Honest, attack: Callable[..., Attacker]
) -> None:
    rogue = attack(read_keys(vault.keys / "mallory", time.time()), mode="router")
    until(lambda: rogue.session.info.routers_zid(), "a link")
    rogue.session.put("drone/victim/status", json.dumps(STATUS))
    rogue.kept.append(rogue.session.declare_subscriber("**", rogue.catch))
    for _ in range(3):
        vault.is_unharmed(victim)
    assert [key for key in rogue.caught if key != "engine/clock"] == []


# -- programs ----------------------------------------------------------------------------------------------------------
def test_a_program_calls_services_under_its_own_name_and_is_no_agent(
    vault: Vault, victim: Honest, attack: Callable[..., Attacker]
) -> None:
    shop = attack(read_keys(vault.keys / "shop", time.time()))
    until(lambda: shop.session.info.routers_zid(), "a link")

    def said(key: str) -> list[str]:
        return [one.ok.payload.to_string() for one in shop.session.get(key, timeout=1.0) if one.ok is not None]

    assert until(lambda: said("svc/shop/formiga/add_task"), "an answer") == ["shop calls formiga/add_task"]
    for other in (
        "svc/ann/formiga/add_task",
        "svc/*/formiga/add_task",
        "svc/**",
        "formiga/add_task",
        "drone/victim/card",
    ):
        assert said(other) == []
    for key in ("**", "*/*/status", "engine/clock"):
        shop.kept.append(shop.session.declare_subscriber(key, shop.catch))
    vault.beat()
    vault.is_unharmed(victim)
    assert shop.caught == []
    vault.says(f"refused shop: query {SITE}/svc/ann/formiga/add_task")

    revoke(vault.keys, "shop", time.time())
    (refused,) = [one.err for one in shop.session.get("svc/shop/formiga/add_task", timeout=1.0)]
    assert "keys_revoked" in refused.payload.to_string()


def test_keys_that_cannot_be_read_leave_the_router_as_it_is(vault: Vault, victim: Honest) -> None:
    holders = vault.keys / "holders.json"
    good = holders.read_bytes()
    assert vault.router is not None
    try:
        holders.write_text("{", encoding="utf-8")
        vault.router.send_signal(signal.SIGHUP)
        vault.says("not started anew, it goes on as before")
    finally:
        holders.write_bytes(good)
    vault.is_unharmed(victim)


def test_a_flood_of_what_is_refused_fills_no_log_and_leaves_the_others_alone(
    vault: Vault, victim: Honest, mallory: Attacker
) -> None:
    before = vault.said.stat().st_size
    for number in range(20_000):
        mallory.session.put(f"drone/victim/event/made_up_{number}", b"x" * 100)
        if number % 5_000 == 0:
            vault.is_unharmed(victim)
    vault.says("refused mallory: and more, this minute")
    vault.is_unharmed(victim)
    assert vault.said.stat().st_size - before < 10_000


# -- an engine that is not the agent's own -----------------------------------------------------------------------------
def test_an_agent_keeps_to_the_engine_that_admitted_it(vault: Vault, victim: Honest) -> None:
    """These goals come with the engine's own keys: what an old start of it, or another site's engine, would send."""
    vault.beat()
    mark = len(vault.heard)
    vault.hear(StatusArrived, lambda one: one.status.id == "victim" and one.status.beat == vault.beats, since=mark)
    assert vault.goal("victim", "old/1", epoch=3) == "epoch_old"
    assert vault.goal("victim", "far/1", epoch=4 + 1_001) == "epoch_far"
    assert vault.goal("victim", "other/1", epoch=4, engine_id="stranger") == "other_engine"
    assert not {"old/1", "far/1", "other/1"} & set(victim.started)
    vault.is_unharmed(victim)


# -- keys that count no more -------------------------------------------------------------------------------------------
def test_keys_that_were_revoked_count_no_more(vault: Vault, victim: Honest) -> None:
    stolen = vault.folder / "stolen"
    shutil.copytree(vault.keys / "gone", stolen)
    thief = Honest(vault, "gone")
    try:
        vault.hear(AgentSeen, lambda one: one.card.id == "gone")
        revoke(vault.keys, "gone", time.time())
        mark = len(vault.heard)
        vault.hear(AgentGone, lambda one: one.agent == "gone", since=mark)
        mark = len(vault.heard)
        vault.engine.send_goal(
            GoalRequest(goal_id="to/gone", agent="gone", action="Go", fields={}, epoch=4, engine_id=ENGINE_ID)
        )
        assert "revoked" in vault.hear(SendFailed, lambda one: one.goal_id == "to/gone", since=mark).text
        vault.is_unharmed(victim)
        assert not [one for one in vault.heard[mark:] if isinstance(one, StatusArrived) and one.status.id == "gone"]
        assert [(code, who) for code, who, _ in vault.engine.troubles()] == [("keys_revoked", "gone")]
        with pytest.raises(KeysError, match="still lets the revoked keys"):
            issue(vault.keys, "gone", About(), time.time())

        assert subprocess.run(
            [sys.executable, "-c", "from formiga_bt.cli import main; main()", "router", "--restart", "--yes"],
            cwd=vault.folder, check=False, timeout=60,
        ).returncode == 0  # fmt: skip
        issue(vault.keys, "gone", About(), time.time())
        assert read_keys(vault.keys / "gone", time.time(), "gone").common_name == "gone.2"
        # The engine hears the name again, the router does not know the stolen keys any more.
        mark = len(vault.heard)
        vault.hear(StatusArrived, lambda one: one.status.id == "victim", since=mark)
        until(lambda: thief.link._session.info.routers_zid(), "the thief's link")
        vault.says(f"refused gone: liveliness token {SITE}/drone/gone/alive")
        vault.is_unharmed(victim)
        assert not [
            one
            for one in vault.heard[mark:]
            if getattr(one, "agent", "") == "gone" or (isinstance(one, AgentSeen) and one.card.id == "gone")
        ]
    finally:
        thief.close()


def test_a_link_ends_with_its_certificate_and_a_renewed_one_opens_it_again(vault: Vault, victim: Honest) -> None:
    """No process is started anew for it: files are read at each new link."""
    name = "brief"
    issue(vault.keys, name, About(), time.time())
    subprocess.run(
        [sys.executable, "-c", "from formiga_bt.cli import main; main()", "router", "--restart", "--yes"],
        cwd=vault.folder, check=True, timeout=60,
    )  # fmt: skip
    renew(vault.keys, name, About(), time.time() - 30 * DAY_S + 6)
    agent = Honest(vault, name)
    try:
        vault.hear(AgentSeen, lambda one: one.card.id == name)
        mark = len(vault.heard)
        vault.hear(AgentGone, lambda one: one.agent == name, since=mark)
        vault.says("refused a connection: its certificate has expired")
        renew(vault.keys, name, About(), time.time())
        mark = len(vault.heard)
        vault.hear(AgentSeen, lambda one: one.card.id == name, since=mark)
        vault.is_unharmed(victim)
    finally:
        agent.close()


def test_an_engine_without_its_router_says_so_and_finds_it_again(vault: Vault, victim: Honest) -> None:
    vault.end_router()
    until(lambda: [one for one in vault.engine.troubles() if one[0] == "router_gone"], "router_gone")
    mark = len(vault.heard)
    vault.start_router()
    vault.hear(AgentSeen, lambda one: one.card.id == "victim", since=mark)
    until(lambda: not [one for one in vault.engine.troubles() if one[0] == "router_gone"], "the end of router_gone")
    vault.is_unharmed(victim)


def test_an_engine_whose_certificate_is_over_soon_says_so_and_does_not_start_with_one_that_is(tmp_path: Path) -> None:
    keys = tmp_path / "keys"
    make_authority(keys, SITE, (), time.time() - 340 * DAY_S)
    engine = ZenohTransport(SITE, listen="tls/127.0.0.1:1", keys=keys)
    engine.open(lambda: None)
    try:
        assert [(code, who) for code, who, _ in engine.troubles()] == [("keys_expire", "engine")]
        until(lambda: ("router_gone", "router") in [(code, who) for code, who, _ in engine.troubles()], "router_gone")
    finally:
        engine.close()
    assert engine.troubles() == []
    make_authority(keys, SITE, (), time.time() - 366 * DAY_S)
    with pytest.raises(KeysError, match="expired"):
        ZenohTransport(SITE, listen="tls/127.0.0.1:1", keys=keys).open(lambda: None)
