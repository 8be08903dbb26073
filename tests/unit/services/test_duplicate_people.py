"""What is said in the name of a person of the desk is not heard, and told once, with what to do."""

from collections.abc import Sequence

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.services.duplicate_people import OneEach
from formiga_bt.transport.messages import (
    AgentCard,
    AgentGone,
    AgentSeen,
    AgentStatus,
    GoalEvent,
    GoalReported,
    StatusArrived,
    TransportEvent,
)
from tests.golden import Wording
from tests.unit.services.conftest import Start


class Said:
    """A wire on which this comes in."""

    name = "said"
    guarantees = ()

    def __init__(self) -> None:
        self.next: list[TransportEvent] = []
        self.wire = OneEach(self, {"ann"})  # type: ignore[arg-type]  # of a wire only what is polled is needed

    def poll(self) -> Sequence[TransportEvent]:
        found, self.next = self.next, []
        return found

    def comes(self, *events: TransportEvent) -> list[TransportEvent]:
        self.next += events
        return list(self.wire.poll())


def card(agent: str, boot: str = "a") -> AgentSeen:
    return AgentSeen(AgentCard(id=agent, type="watcher", boot_id=boot, actions=("Confirm",), mobility="people"))


def status(boot: str, at_s: float, agent: str = "lwd_1") -> StatusArrived:
    return StatusArrived(AgentStatus(id=agent, type="lwd", boot_id=boot, stamp=round(at_s * SECOND), seq=1))


def test_nobody_speaks_for_a_person_of_the_desk(wording: Wording) -> None:
    said = Said()
    done = GoalReported(GoalEvent(goal_id="g1", agent="ann", state="succeeded", n=1))

    assert said.comes(card("ann"), status("a", 1, "ann"), done, card("ben"), AgentGone("ann")) == [card("ben")]
    assert said.wire.troubles() == ()  # it has gone again
    said.comes(card("ann", "b"), done)
    (trouble,) = said.wire.troubles()
    assert (trouble.code, trouble.subject) == ("double", "ann")
    wording(trouble.text)


@pytest.mark.network
def test_an_engine_tells_of_a_person_who_answers_at_its_desk_and_elsewhere(start: Start) -> None:
    with start(desk={"watcher_1": "watcher"}) as service:
        service.wire.add("watcher_1", "watcher", next(iter(service.host.site.ports.values())).at, mobility="people")

        def alarms() -> list[str]:
            return [event.text for event in service.host.feed.after(0)[0] if event.type == "alarm"]

        service.wait(alarms)
        assert "--without watcher_1" in alarms()[0]
        task = service.submit("Ask")
        service.wait(lambda: service.get("/v1/inbox")["questions"])
        (question,) = service.get("/v1/inbox")["questions"]
        assert question["here"]
        service.post(f"/v1/inbox/{question['number']}/answer", {"option": "yes_it_is"})
        assert service.ends(task)["status"] == "SUCCEEDED"
