"""The rules of a router allow what the table of keys says, and nothing else; docs/wire.md has the same table."""

import re
from io import BytesIO
from pathlib import Path
from typing import Any

import zenoh

from formiga_bt.base.certificates import ENGINE
from formiga_bt.transport.zenoh_keys import KEYS
from formiga_bt.transport.zenoh_router import Refusals
from formiga_bt.transport.zenoh_rules import Member, access_control

DOC = Path(__file__).parents[3] / "docs" / "wire.md"
AGENTS = [Member("a1", "a1"), Member("a2", "a2.3"), Member("shop", "shop", is_program=True)]


def may(rules: dict[str, Any], who: str, flow: str, message: str, key: str) -> bool:
    """Whether the rules let a message of somebody pass, as Zenoh reads them."""
    (names,) = [one["rules"] for one in rules["policies"] if who in one["subjects"]]
    wanted = zenoh.KeyExpr(key)
    return any(
        zenoh.KeyExpr(allowed).includes(wanted)
        for one in rules["rules"]
        if one["id"] in names and flow in one["flows"] and message in one["messages"]
        for allowed in one["key_exprs"]
    )


def test_an_agent_writes_its_own_keys_and_reads_the_engines() -> None:
    rules = access_control("s", AGENTS, simulation=False)
    for message, key in (
        ("put", "s/drone/a1/status"), ("put", "s/drone/a1/card"), ("put", "s/drone/a1/action/Go/event"),
        ("put", "s/drone/a1/event/sos"), ("declare_queryable", "s/drone/a1/action/*/goal"),
        ("reply", "s/drone/a1/action/Go/goal"), ("liveliness_token", "s/drone/a1/alive"),
        ("declare_subscriber", "s/engine/clock"), ("query", "s/engine/site"), ("query", "s/engine/attachments/ab"),
    ):  # fmt: skip
        assert may(rules, "a1", "ingress", message, key), (message, key)
        assert not may(rules, "a2.3", "ingress", message, key) or "/engine/" in key, (message, key)
    assert may(rules, "a1", "egress", "query", "s/drone/a1/action/Go/goal")
    assert not may(rules, "a1", "egress", "query", "s/drone/a2/action/Go/goal")


def test_what_nobody_but_the_engine_may() -> None:
    rules = access_control("s", AGENTS, simulation=False)
    for message, key in (
        ("put", "s/engine/clock"), ("put", "s/engine/site"), ("declare_queryable", "s/engine/site"),
        ("declare_queryable", "s/engine/attachments/*"), ("liveliness_token", "s/engine/alive"),
        ("query", "s/drone/a1/action/Go/goal"), ("query", "s/drone/a1/action/*/cancel"), ("query", "s/drone/a1/goals"),
        ("declare_subscriber", "s/*/*/status"),
    ):  # fmt: skip
        assert may(rules, ENGINE, "ingress", message, key), (message, key)
        assert not may(rules, "a1", "ingress", message, key), (message, key)
        assert not may(rules, "a2.3", "ingress", message, key), (message, key)
    assert not may(rules, ENGINE, "ingress", "put", "s/drone/a1/status")


def test_everything_else_is_denied() -> None:
    rules = access_control("s", AGENTS, simulation=False)
    assert (rules["enabled"], rules["default_permission"]) == (True, "deny")
    assert {one["permission"] for one in rules["rules"]} == {"allow"}
    for who in (ENGINE, "a1", "a2.3"):
        for flow in ("ingress", "egress"):
            for message in ("put", "query", "declare_subscriber", "declare_queryable", "delete", "liveliness_token"):
                for key in ("**", "s/**", "@/**", "other/drone/a1/status", "s/drone/a1/**", "s/drone/a1/motion"):
                    assert not may(rules, who, flow, message, key), (who, flow, message, key)


def test_each_calls_services_under_its_own_name_and_a_program_is_no_agent() -> None:
    rules = access_control("s", AGENTS, simulation=True)
    for who, name in (("shop", "shop"), ("a1", "a1"), ("a2.3", "a2")):
        assert may(rules, who, "ingress", "query", f"s/svc/{name}/formiga/add_task")
        for other in ("*", "ann", "*/formiga", "local"):
            assert not may(rules, who, "ingress", "query", f"s/svc/{other}/formiga/add_task")
        assert not may(rules, who, "ingress", "query", "s/formiga/add_task")
        assert not may(rules, who, "ingress", "declare_queryable", f"s/svc/{name}/formiga/add_task")
        assert may(rules, who, "egress", "reply", f"s/svc/{name}/formiga/add_task")
    assert may(rules, ENGINE, "ingress", "declare_queryable", "s/svc/*/formiga/add_task")
    for message, key in (
        ("put", "s/drone/shop/status"), ("liveliness_token", "s/drone/shop/alive"), ("declare_subscriber", "s/engine/clock"),
    ):  # fmt: skip
        assert not may(rules, "shop", "ingress", message, key)


def test_agents_hear_where_others_move_in_simulations_only() -> None:
    real, simulated = (access_control("s", AGENTS, simulation=one) for one in (False, True))
    for message in ("declare_subscriber",):
        assert may(simulated, "a1", "ingress", message, "s/*/*/motion")
        assert not may(real, "a1", "ingress", message, "s/*/*/motion")
    assert may(simulated, "a2.3", "ingress", "put", "s/drone/a2/motion")
    assert not may(simulated, "a2.3", "ingress", "put", "s/drone/a1/motion")


def test_the_page_of_the_wire_has_the_keys_of_the_table() -> None:
    text = DOC.read_text(encoding="utf-8").partition("\n## Keys")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)` \| ([^|]+) \| (\w+) \|", text, re.MULTILINE)
    words = {
        "<type>/<id>": "*/*",
        "<action>": "*",
        "<event>": "*",
        "<sha256>": "*",
        "<principal>": "*",
        "<service>": "**",
    }
    said = {re.sub("|".join(map(re.escape, words)), lambda found: words[found[0]], key): how for key, how, _ in rows}
    table = {one.of_all: one for one in KEYS if one.reader != "simulated"}
    assert said.keys() == table.keys()
    ways = {"put": "put", "query": "queryable", "presence": "liveliness token"}
    for key, how in said.items():
        assert {way for way, word in ways.items() if word in how} == set(table[key].ways), key


LOG = "2026-11-28T11:42:08Z TRACE rx-1 ThreadId(12) zenoh::net::routing::interceptor::access_control: {what}\n"
CUT = "2026-11-28T11:42:08Z TRACE rx-1 ThreadId(12) zenoh::net::routing::interceptor: Msg intercepted!\n"
WARN = "2026-11-28T11:41:48Z \x1b[33m WARN\x1b[0m acc-0 ThreadId(06) zenoh_link_tls::unicast: {what} Hint: none.\n"


def test_refusals_are_told_in_words_and_not_over_and_over() -> None:
    told: list[str] = []
    now = [0.0]
    known = {"22586ae3860fe280": "mallory"}
    refusals = Refusals(lambda number: known.get(number, ""), told.append, lambda: now[0])
    denied = LOG.format(what="22586ae3860fe280 on Interface(lo)+X is unauthorized to Put (ingress) on s/d/a2/status")
    for line in (denied, CUT) * 3:
        refusals.take(line.encode())
    assert told == ["refused mallory: put s/d/a2/status"]
    now[0] = 61.0
    for line in (denied, CUT):
        refusals.take(line.encode())
    assert len(told) == 2


def test_what_is_only_worked_out_beforehand_is_no_refusal() -> None:
    told: list[str] = []
    refusals = Refusals(lambda _: "", told.append)
    refusals.take(LOG.format(what="22586ae3860fe280 is unauthorized to Put (ingress) on s/d/a2/status").encode())
    refusals.take(LOG.format(what="22586ae3860fe280 is authorized to Put (ingress) on s/d/a1/status").encode())
    assert told == []


def test_refused_connections_say_why() -> None:
    told: list[str] = []
    refusals = Refusals(lambda _: "", told.append)
    for what in (
        "invalid peer certificate: certificate expired: at 1",
        "peer sent no certificates.",
        "something \x1b]0;new\x07.",
    ):
        refusals.take(WARN.format(what=what).encode())
    assert [one.removeprefix("refused a connection: ") for one in told[:2]] == [
        "its certificate has expired", "it showed no certificate",
    ]  # fmt: skip
    assert told[2].isprintable()


def test_who_makes_up_ever_new_keys_fills_no_disk() -> None:
    told: list[str] = []
    now = [0.0]
    refusals = Refusals(lambda number: number[:4], told.append, lambda: now[0])
    for minute in (0.0, 61.0):
        now[0] = minute
        for who in ("22586ae3860fe280", "33586ae3860fe280"):
            for number in range(500):
                denied = f"{who} on Interface(lo)+X is unauthorized to Put (ingress) on s/d/a2/{number}{'x' * 5_000}"
                refusals.take(LOG.format(what=denied).encode())
                refusals.take(CUT.encode())
    assert len(told) == 2 * 2 * 21
    assert max(map(len, told)) <= 300
    assert [one for one in told if "and more" in one] == [
        "refused 2258: and more, this minute",
        "refused 3358: and more, this minute",
    ] * 2


def test_a_line_that_breaks_the_reader_does_not_end_it() -> None:
    told: list[str] = []

    def names(number: str) -> str:
        raise KeyError(number)

    refusals = Refusals(names, told.append)
    denied = LOG.format(what="22586ae3860fe280 is unauthorized to Put (ingress) on s/d/a2/status")
    refusals.read(BytesIO("".join([denied, CUT, WARN.format(what="peer sent no certificates.")]).encode()))
    assert told[-1] == "refused a connection: it showed no certificate"
