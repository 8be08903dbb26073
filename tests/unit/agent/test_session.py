"""An agent of one's own under the rules of all agents, in virtual time."""

import asyncio
from typing import Any, Literal, TypedDict

import pytest

from formiga_bt.agent import (
    ActionError,
    Agent,
    CancelToken,
    GoalRequest,
    Metres,
    MetresPerSecond,
    Place,
    action,
    event,
)
from formiga_bt.agent.testing import AgentBench
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Position
from formiga_bt.transport.attachments import FileError, check_bytes


class Seen(TypedDict):
    cracks: int
    at: Place


class Rover(Agent, type="rover", fields={"open": bool, "load": Metres}):
    """A rover."""

    def __init__(self) -> None:
        self.log: list[str] = []

    @action(moves_to="to")
    async def Drive(self, to: Place, speed: MetresPerSecond = 1.0) -> None:
        """Drive to a place."""
        try:
            for tenth in range(10):
                await asyncio.sleep(to.east_m / speed / 10)
                self.feedback(progress=(tenth + 1) / 10, phase="driving")
        except asyncio.CancelledError:
            self.log.append("stopped")
            raise
        self.status(pose=to)

    @action
    def Inspect(self, token: CancelToken, how: Literal["fast", "slow"] = "slow") -> Seen:
        for _ in range(5 if how == "slow" else 1):
            token.sleep(1)
            self.feedback(progress=0.5)
        return {"cracks": 3, "at": Place(1.0, 2.0)}

    @action(cancelable=False)
    async def Press(self) -> None:
        await self.sleep(4)

    @action(exclusive=False)
    async def Ask(self) -> dict[str, Any]:
        await self.sleep(2)
        return {"said": "yes"}

    @action
    async def Break(self, how: str) -> Seen:
        if how == "code":
            raise ActionError("no_light", "it is dark")
        if how == "bug":
            raise ZeroDivisionError("oh")
        return {"cracks": "many", "at": Place(0.0, 0.0)}  # type: ignore[typeddict-item]

    @event
    def bump(self, level: int) -> None:
        """Never run: the call is the event."""
        raise AssertionError

    def accepts(self, request: GoalRequest) -> str:
        return "too_far" if request.fields.get("to", {}).get("east_m", 0) > 1000 else ""


@pytest.fixture
def bench() -> AgentBench:
    return AgentBench(Rover())


def rover(bench: AgentBench) -> Rover:
    assert isinstance(bench.agent, Rover)
    return bench.agent


def test_an_async_action_runs_in_virtual_time_and_its_status_comes_with_its_end(bench: AgentBench) -> None:
    end = bench.do("Drive", to=Place(20, 0), speed=2.0)
    assert (end.state, end.progress) == ("succeeded", 1.0)
    assert end.status is not None
    assert end.status.position == Position(20.0, 0.0, 0.0)
    assert 10.0 <= bench.scheduler.now() / SECOND < 10.2
    assert bench.bad == []


def test_a_plain_function_gives_a_typed_result(bench: AgentBench) -> None:
    end = bench.do("Inspect")
    assert (end.state, end.result) == ("succeeded", {"cracks": 3, "at": {"east_m": 1.0, "north_m": 2.0}})
    assert 5.0 <= bench.scheduler.now() / SECOND < 5.2


def test_a_cancel_arrives_where_the_action_waits(bench: AgentBench) -> None:
    goal = bench.start("Drive", to=Place(100, 0))
    bench.run_for(3)
    bench.cancel(goal)
    assert bench.end_of(goal).state == "canceled"
    assert rover(bench).log == ["stopped"]


def test_a_cancel_ends_a_plain_function_at_its_token(bench: AgentBench) -> None:
    goal = bench.start("Inspect")
    bench.run_for(1.5)
    bench.cancel(goal)
    assert bench.end_of(goal, within_s=0.1).state == "canceled"


def test_a_cancel_may_be_refused(bench: AgentBench) -> None:
    goal = bench.start("Press")
    bench.cancel(goal)
    assert [one.cancel_refused for one in bench.news if one.goal_id == goal] == [False, True]
    assert bench.end_of(goal).state == "succeeded"


def test_a_second_goal_is_busy_and_a_safety_goal_replaces_the_first_after_it_has_stopped(bench: AgentBench) -> None:
    first = bench.start("Drive", to=Place(100, 0))
    assert bench.do("Inspect").code == "busy"
    bench.send(GoalRequest(goal_id="s", agent="agent_1", action="Press", safety=True, epoch=1, beat=1))
    assert bench.end_of(first).state == "superseded"
    assert rover(bench).log == ["stopped"]
    assert bench.end_of("s").state == "succeeded"


def test_goals_that_are_not_exclusive_run_beside_each_other(bench: AgentBench) -> None:
    goals = [bench.start("Ask") for _ in range(3)] + [bench.start("Drive", to=Place(1, 0))]
    assert {bench.end_of(goal).state for goal in goals} == {"succeeded"}
    assert bench.scheduler.now() < 3 * SECOND


def test_a_repeated_goal_is_not_begun_again(bench: AgentBench) -> None:
    request = GoalRequest(
        goal_id="g", agent="agent_1", action="Drive", fields={"to": {"east_m": 1, "north_m": 0}}, epoch=1, beat=1
    )
    bench.send(request)
    assert bench.end_of("g").state == "succeeded"
    bench.send(request)
    assert [one.state for one in bench.news].count("succeeded") == 2
    assert len([one for one in bench.news if one.state == "running"]) == 10


@pytest.mark.parametrize(
    ("action", "fields", "code"),
    [
        ("Drive", {}, "bad_field"),
        ("Drive", {"to": "there"}, "bad_field"),
        ("Drive", {"to": {"east_m": 1, "north_m": 1}, "speed": "fast"}, "bad_field"),
        ("Inspect", {"how": "never"}, "bad_field"),
        ("Drive", {"to": {"east_m": 2000, "north_m": 1}}, "too_far"),
        ("Fly", {}, "unknown_action"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_code(bench: AgentBench, action: str, fields: Any, code: str) -> None:
    end = bench.do(action, **fields)
    assert (end.state, end.code) == ("rejected", code)


@pytest.mark.parametrize(("how", "code"), [("code", "no_light"), ("bug", "agent_error"), ("type", "bad_result")])
def test_an_action_that_raises_fails_its_goal_and_the_agent_goes_on(bench: AgentBench, how: str, code: str) -> None:
    end = bench.do("Break", how=how)
    assert (end.state, end.code) == ("failed", code)
    assert bench.do("Ask").result == {"said": "yes"}


def test_fields_of_its_own_stand_in_the_status_together(bench: AgentBench) -> None:
    rover(bench).status(open=True)
    rover(bench).status(load=2.5, battery=40.0)
    bench.run_for(0.1)
    assert (bench.status.fields, bench.status.battery) == ({"open": True, "load": 2.5}, 40.0)


@pytest.mark.parametrize("wrong", [{"batery": 3}, {"open": 1}, {"load": "much"}])
def test_a_wrong_status_is_an_error_where_it_is_said(bench: AgentBench, wrong: Any) -> None:
    with pytest.raises(TypeError):
        rover(bench).status(**wrong)


def test_an_event_is_published_with_its_fields(bench: AgentBench) -> None:
    rover(bench).bump(level=3)
    bench.run_for(0.1)
    assert [(one.event, one.fields, one.n) for one in bench.events] == [("bump", {"level": 3}, 1)]
    with pytest.raises(TypeError):
        rover(bench).bump(level="high")  # type: ignore[arg-type]


def test_a_pilot_ends_the_goal_and_nothing_begins_until_it_is_handed_back(bench: AgentBench) -> None:
    goal = bench.start("Drive", to=Place(100, 0))
    bench.agent.take_control("pilot")
    assert bench.end_of(goal).state == "taken_over"
    assert bench.do("Press").code == "not_in_command"
    bench.agent.take_control("engine")
    assert bench.do("Press").state == "succeeded"
    assert rover(bench).log == ["stopped"]


def test_the_card_says_what_the_class_does(bench: AgentBench) -> None:
    card = bench.cards[0]
    drive = card.action("Drive")
    assert drive is not None
    assert drive.fields is not None
    assert {name: field.type for name, field in drive.fields.items()} == {"to": "place", "speed": "speed"}
    assert (drive.fields["speed"].default, drive.moves_to, drive.help) == (1.0, "to", "Drive to a place.")
    assert card.names == ("Drive", "Inspect", "Press", "Ask", "Break")
    assert {name: field.type for name, field in card.fields.items()} == {"open": "bool", "load": "distance"}
    assert card.faults == {}


def test_an_agent_that_flies_says_what_it_does_without_its_link() -> None:
    with pytest.raises(TypeError, match="link_lost"):

        class Kite(Agent, type="kite", mobility="air"):
            @action
            async def Rise(self) -> None: ...


def test_without_its_link_it_acts_by_itself_until_the_engine_is_heard_again() -> None:
    class Kite(Agent, type="kite", mobility="air"):
        @action
        async def Rise(self) -> None:
            self.status(landed="airborne")
            await self.sleep(1000)

        async def link_lost(self) -> None:
            await self.sleep(5)
            self.status(landed="grounded")

    bench = AgentBench(Kite())
    bench.send(GoalRequest(goal_id="g", agent="agent_1", action="Rise", epoch=1, beat=1, link_silence_s=10.0))
    bench.run_for(1)
    bench.hub.cut("agent_1", vanishes=False)
    bench.run_for(12)
    assert bench.session.side.control == "failsafe"
    bench.run_for(10)
    bench.hub.mend("agent_1")
    bench.run_for(3)
    assert bench.end_of("g").state == "taken_over"
    assert (bench.status.control, bench.status.landed) == ("engine", "grounded")


@pytest.mark.parametrize(
    "body",
    [
        "async def Do(self, x) -> None: ...",
        "async def Do(self, x: object) -> None: ...",
        "async def Do(self, *x: int) -> None: ...",
        "async def Do(self) -> int: ...",
        "async def Do(self, token: CancelToken) -> None: ...",
    ],
)
def test_a_class_that_cannot_be_announced_is_an_error_at_once(body: str) -> None:
    names: dict[str, Any] = {"Agent": Agent, "action": action, "CancelToken": CancelToken}
    with pytest.raises(TypeError, match="Odd: action Do"):
        exec(f"class Odd(Agent, type='odd'):\n    @action\n    {body}", names)


def test_equal_runs_are_equal() -> None:
    def run() -> list[Any]:
        bench = AgentBench(Rover())
        bench.do("Inspect")
        bench.do("Drive", to=Place(3, 0))
        return [*bench.news, *bench.statuses]

    assert run() == run()


class Camera(Agent, type="rover"):
    @action
    async def Look(self) -> dict[str, Any]:
        file = self.attach("roof.jpg", b"photo")
        self.seen(level=1, attachments=[file])
        return {}

    @action
    def Log(self, token: CancelToken) -> dict[str, Any]:
        self.attach("a.txt", b"a log")
        token.sleep(1)
        raise ActionError("broken")

    @event
    def seen(self, level: int) -> None: ...


class Keeps:
    def __init__(self) -> None:
        self.kept: dict[str, bytes] = {}
        self.busy = 0

    def put(self, digest: str, data: bytes) -> None:
        if self.busy:
            self.busy -= 1
            raise FileError("busy: ask again")
        check_bytes(digest, data)
        self.kept[digest] = data

    def get(self, digest: str) -> bytes | None:
        return self.kept.get(digest)


def test_a_file_is_sent_and_named_by_the_result_and_by_events() -> None:
    bench, store = AgentBench(Camera()), Keeps()
    bench.hub.transport.keep_files(store)
    end = bench.do("Look")
    (named,) = end.attachments
    assert (named.name, named.media_type, named.size) == ("roof.jpg", "image/jpeg", 5)
    assert store.kept == {named.sha256: b"photo"}
    assert [one.attachments for one in bench.events] == [(named,)]
    assert bench.events[0].fields == {"level": 1}


def test_a_file_of_a_failed_action_is_named_and_bytes_are_sent_again_to_who_is_busy() -> None:
    bench, store = AgentBench(Camera()), Keeps()
    store.busy = 2
    bench.hub.transport.keep_files(store)
    end = bench.do("Log")
    assert (end.state, [one.name for one in end.attachments]) == ("failed", ["a.txt"])
    assert store.kept == {}
    bench.run_for(10)
    assert list(store.kept) == [end.attachments[0].sha256]


def test_a_name_that_is_a_path_is_an_error_where_it_is_said() -> None:
    bench = AgentBench(Camera())
    with pytest.raises(FileError):
        bench.agent.attach("../x", b"")


class Follower(Agent, type="rover"):
    @action(live=["to"])
    async def Follow(self, to: Place, speed: MetresPerSecond = 1.0) -> dict[str, Any]:
        seen = []
        for _ in range(5):
            seen.append(self.live("to").east_m)
            await self.sleep(1)
        return {"seen": seen}

    @action(live=["to"])
    def Chase(self, to: Place, token: CancelToken) -> dict[str, Any]:
        seen = []
        for _ in range(5):
            seen.append(self.live("to").east_m)
            token.sleep(1)
        return {"seen": seen}

    @action
    async def Drive(self, to: Place) -> None:
        await self.sleep(5)


@pytest.mark.parametrize("action_name", ["Follow", "Chase"])
def test_a_live_parameter_changes_while_the_action_runs(action_name: str) -> None:
    bench = AgentBench(Follower())
    goal = bench.start(action_name, to=Place(1.0, 0.0))
    bench.run_for(1.5)
    answer = bench.update(goal, 2, to=Place(7.0, 0.0))
    assert answer is not None
    assert (answer.code, answer.stands) == ("", 2)
    bench.update(goal, 1, to=Place(3.0, 0.0))
    assert bench.end_of(goal).result == {"seen": [1.0, 1.0, 7.0, 7.0, 7.0]}


@pytest.mark.parametrize(
    ("name", "fields", "code"),
    [
        ("Follow", {"speed": 2.0}, "bad_field"),
        ("Follow", {"to": "there"}, "bad_field"),
        ("Drive", {"to": Place(2.0, 0.0)}, "no_update"),
    ],
)
def test_what_is_not_live_or_of_another_type_is_refused(name: str, fields: dict[str, Any], code: str) -> None:
    bench = AgentBench(Follower())
    goal = bench.start(name, to=Place(1.0, 0.0))
    answer = bench.update(goal, 1, **fields)
    assert answer is not None
    assert answer.code == code
    assert bench.end_of(goal).state == "succeeded"


def test_live_names_parameters_and_is_asked_within_an_action() -> None:
    with pytest.raises(TypeError, match="too"):

        class Wrong(Agent, type="rover"):
            @action(live=["too"])
            async def Follow(self, to: Place) -> None: ...

    bench = AgentBench(Follower())
    with pytest.raises(RuntimeError):
        bench.agent.live("to")
