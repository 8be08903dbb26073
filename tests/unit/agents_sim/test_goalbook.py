"""What an agent notes of its goals: once when begun, once when ended, whatever its engine says or repeats."""

from pathlib import Path

from agents_sim.goalbook import BookedBody, BookedSide, GoalBook, read_books
from formiga_bt.agent.pacing import PacedScheduler
from formiga_bt.transport.messages import AgentCard, AgentEvent, AgentStatus, GoalEvent, GoalRequest

CARD = AgentCard(id="d", type="lwd", boot_id="b", actions=("GoTo",))


class Body:
    def start(self, request: GoalRequest) -> str:
        return str(request.fields.get("refuse", ""))

    def cancel(self, goal_id: str) -> bool:
        return True


class Link:
    def publish_status(self, status: AgentStatus) -> None: ...
    def publish_event(self, event: GoalEvent) -> None: ...
    def publish_agent_event(self, event: AgentEvent) -> None: ...
    def publish_card(self, card: AgentCard) -> None: ...


def request(goal: str, **fields: object) -> GoalRequest:
    return GoalRequest(goal_id=goal, agent="d", action="GoTo", fields=fields, epoch=1, beat=0, ttl_beats=5)


def test_a_goal_is_noted_when_it_begins_and_when_it_ends(tmp_path: Path) -> None:
    book = GoalBook(tmp_path, "d", lambda: 7)
    side = BookedSide(CARD, BookedBody(Body(), book), Link(), PacedScheduler(lambda: 0, 0), lambda by: None)
    side.book = book
    side.on_goal(request("T-1/1/steps/a", to=[1, 2]))
    side.on_goal(request("T-1/1/steps/a", to=[1, 2]))  # repeated: answered, not begun
    side.on_goal(request("T-1/1/steps/b", refuse="no"))
    side.finish("T-1/1/steps/a", "succeeded")
    side.finish("T-1/1/steps/a", "canceled")  # it has ended
    side.finish("T-1/1/steps/x", "canceled")  # it never began
    book.close()
    with (tmp_path / "d.goals.jsonl").open("ab") as file:
        file.write(b'{"agent":"d","go')  # died while it wrote

    notes = list(read_books(tmp_path))

    assert [(note.goal, note.state, note.action, note.at) for note in notes] == [
        ("T-1/1/steps/a", "begun", "GoTo", 7),
        ("T-1/1/steps/a", "succeeded", "", 7),
    ]
    assert notes[0].fields == {"to": [1, 2]}
