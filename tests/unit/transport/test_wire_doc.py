"""docs/wire.md says all there is to say: every field, state and code, and examples that are what the code writes.

To renew the examples: FORMIGA_UPDATE=1 pytest tests/unit/transport/test_wire_doc.py
"""

import os
import re
from pathlib import Path
from typing import Any, get_args

import msgspec
import pytest
from msgspec import Struct

from formiga_bt.base.geo import Position
from formiga_bt.transport import agent_side, codec
from formiga_bt.transport.attachments import MOST_BYTES, attachment_of
from formiga_bt.transport.codec import CancelRequest, GoalsReply, GoalsRequest
from formiga_bt.transport.desk import ConfirmFields
from formiga_bt.transport.messages import (
    AgentCard,
    AgentError,
    AgentEvent,
    AgentLinkState,
    AgentStatus,
    CardAction,
    CardField,
    Clearance,
    ClockBeat,
    Control,
    GoalEvent,
    GoalRequest,
    GoalState,
    Landed,
    PreflightCheck,
    SiteBase,
    SiteMessage,
    SitePoint,
    SiteStation,
    UpdateReply,
    UpdateRequest,
    to_wire,
)

DOC = Path(__file__).parents[3] / "docs" / "wire.md"
T0 = 1_790_000_000_000_000

STATUS = AgentStatus(
    id="hwd_1",
    type="hwd",
    battery=87.5,
    position=Position(180.0, 90.0, 60.0),
    lat=66.50080692,
    lng=25.70403425,
    initial_deployment=Position(0.0, 20.0, 0.0),
    landed="airborne",
    payload_kg=1.2,
    wind_east_m_s=3.0,
    wind_north_m_s=-1.5,
    checks=(PreflightCheck("home", True, "0 E 20 N"), PreflightCheck("storage", False, "the card is full")),
    heading_deg=271.5,
    speed_m_s=7.9,
    altitude_m=181.2,
    charging=False,
    link=AgentLinkState(rtt_ms=12.5, loss=0.0),
    errors=(AgentError("lamp", "the lamp does not answer", "warning"),),
    fields={"parachute": True},
    engine_id="7c1e66f0",
    site="9f0c2d41aa7be013",
    age_us=40_000,
    boot_id="hwd_1@65a1",
    seq=412,
    stamp=T0 + 12_000_000,
    beat=731,
    last_goal="PickUp-12/0/steps/steps[1]",
    last_goal_state="succeeded",
)
DONE = GoalEvent(
    goal_id="PickUp-12/0/steps/steps[1]", agent="hwd_1", state="succeeded", n=7, result={"found": 3}, status=STATUS
)
PHOTO = attachment_of("roof.jpg", b"a photo", "image/jpeg")
TO = CardField(type="position", help="Where to hover.")
SPEED = CardField(type="speed", unit="m/s", optional=True, min=0.5, max=20.0)
EXAMPLES: dict[str, Struct] = {
    "AgentCard": AgentCard(
        id="hwd_1",
        type="hwd",
        boot_id="hwd_1@65a1",
        actions=("TakeOff", "LandIn", CardAction(name="GoTo", fields={"to": TO, "speed": SPEED}, moves_to="to")),
        limits={"speed_m_s": 10.0, "climb_m_s": 3.0},
        events={"geofence": {"side": CardField(type="enum", values=("in", "out"))}},
        fields={"parachute": CardField(type="bool")},
        software="px4-bridge 1.14",
    ),
    "CardAction": CardAction(name="GoTo", fields={"to": TO, "speed": SPEED}, moves_to="to", typical_s=60.0),
    "CardField": SPEED,
    "AgentStatus": STATUS,
    "PreflightCheck": PreflightCheck("gnss", True, "14 satellites"),
    "GoalRequest": GoalRequest(
        goal_id="PickUp-12/0/steps/steps[1]",
        agent="hwd_1",
        action="GoTo",
        fields={"to": to_wire(Position(180.0, 90.0, 60.0)), "speed": 8.0},
        engine_id="7c1e66f0",
        epoch=4,
        beat=724,
        clearance=Clearance("watcher_1", T0),
        link_silence_s=10.0,
        task_id="PickUp-12",
    ),
    "GoalEvent": DONE,
    "AgentEvent": AgentEvent(
        agent="picker_1", event="sos", boot_id="picker_1@11c0", n=2, stamp=T0 + 12_000_000, fields={"level": 3}
    ),
    "Attachment": PHOTO,
    "CancelRequest": CancelRequest("PickUp-12/0/steps/steps[1]"),
    "UpdateRequest": UpdateRequest(
        goal_id="PickUp-12/0/steps/steps[1]",
        agent="hwd_1",
        action="GoTo",
        n=2,
        fields={"to": to_wire(Position(175.0, 96.0, 60.0))},
        engine_id="7c1e66f0",
        epoch=4,
        beat=728,
        ttl_beats=5,
    ),
    "UpdateReply": UpdateReply(goal_id="PickUp-12/0/steps/steps[1]", agent="hwd_1", n=2, stands=2),
    "GoalsRequest": GoalsRequest(("PickUp-12/0/steps/steps[1]", "PickUp-12/0/steps/steps[2]")),
    "GoalsReply": GoalsReply(
        "hwd_1@65a1",
        (
            msgspec.structs.replace(DONE, state="running", n=3, result={}, status=None, progress=0.4, eta_s=12.0),
            GoalEvent(goal_id="PickUp-12/0/steps/steps[2]", agent="hwd_1", state="unknown"),
        ),
    ),
    "ClockBeat": ClockBeat(
        wall_us=T0 + 500_000, engine_us=T0 + 12_000_000, speed=1.0, epoch=4, beat=731, engine_id="7c1e66f0"
    ),
    "SiteMessage": SiteMessage(
        site="rovaniemi",
        version="9f0c2d41aa7be013",
        engine_id="7c1e66f0",
        epoch=4,
        base=SiteBase(66.5, 25.7, 120.0),
        fence=(SitePoint(-500.0, -500.0), SitePoint(900.0, -500.0), SitePoint(200.0, 800.0)),
        no_fly=((SitePoint(100.0, 0.0), SitePoint(150.0, 0.0), SitePoint(120.0, 40.0)),),
        transit_m=(60.0, 75.0, 90.0),
        return_m=90.0,
        stations={"s1": SiteStation(at=SitePoint(4.0, 2.0), heading_deg=90.0, charges=True, kinds=("rover",))},
        ports={"p1": SitePoint(0.0, 20.0)},
    ),
    "ConfirmFields": ConfirmFields(
        question="Is the crate loaded?",
        options=("not_yet", "loaded"),
        note="hwd_1 stands at camp with its rotors off",
        number="Q7",
        expires_us=T0 + 300_000_000,
        if_no_answer="hwd_1 flies home without it",
    ),
}


def written(message: Struct) -> str:
    return msgspec.json.format(codec.encode(message), indent=2).decode()


def block(name: str, body: str) -> str:
    return f"<!-- example: {name} -->\n```json\n{body}\n```\n"


@pytest.fixture(scope="module")
def doc() -> str:
    text = DOC.read_text()
    if os.environ.get("FORMIGA_UPDATE"):
        for name, message in EXAMPLES.items():
            head, tail = text.split(f"<!-- example: {name} -->\n", 1)
            text = head + block(name, written(message)) + tail.split("```\n", 1)[1]
        DOC.write_text(text)
    return text


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_is_what_the_code_writes_and_reads(doc: str, name: str) -> None:
    message = EXAMPLES[name]
    assert block(name, written(message)) in doc, "renew it with FORMIGA_UPDATE=1"
    assert codec.decode(codec.encode(message), type(message)) == message


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_field_is_explained(doc: str, name: str) -> None:
    fields = type(EXAMPLES[name]).__struct_encode_fields__
    assert [field for field in fields if f"`{field}`" not in doc] == []


@pytest.mark.parametrize("words", [GoalState, Control, Landed])
def test_every_word_is_named(doc: str, words: Any) -> None:
    assert [word for word in get_args(words) if f"`{word}`" not in doc] == []


def test_every_code_of_the_agents_rules_is_named(doc: str) -> None:
    source = Path(agent_side.__file__).read_text()
    codes = set(re.findall(r'return "([a-z_]+)"|code="([a-z_]+)"', source))
    found = {first or second for first, second in codes} | {"busy"}
    assert {"epoch_old", "goal_expired", "unknown_action", "not_in_command"} <= found
    assert [code for code in sorted(found) if f"`{code}`" not in doc] == []


def test_the_limits_are_the_codes(doc: str) -> None:
    assert str(codec.FRAME_LIMIT) in doc
    assert str(MOST_BYTES) in doc
    assert f"{agent_side.REMEMBERED_GOALS:,}" in doc
