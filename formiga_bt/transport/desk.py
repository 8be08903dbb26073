"""People at this machine: agents without a wire, who answer by `formiga answer` or in the console.

Every question to a person is a Confirm goal to an agent, so a person at the keyboard is an agent too. The desk keeps
the rules of all agents (`AgentSide`), shows what is open and takes the answers.

Threads: the driver's thread sends goals and polls; answers come from the thread of whoever serves people. One lock
guards the desk's few lists; listeners and `wake` are called outside it.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import msgspec
from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import TransportError
from formiga_bt.base.wires import GUARANTEES
from formiga_bt.lang.forms import FormField, lack
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.codec import Asked, CancelRequest, GoalsRequest, WireError, encode, read_reply, serve_request
from formiga_bt.transport.messages import (
    AgentCard,
    AgentEvent,
    AgentSeen,
    AgentStatus,
    ClockBeat,
    EventArrived,
    GoalEvent,
    GoalReported,
    GoalRequest,
    SendFailed,
    SiteMessage,
    StatusArrived,
    TransportEvent,
    UpdateRequest,
    to_wire,
)

MOST_OPEN: Final = 100
"""The most questions one person may have open; more are rejected `too_many_questions`."""


class ConfirmFields(Struct, frozen=True):
    """The fields of a Confirm goal on the wire."""

    question: str
    options: tuple[str, ...]
    note: str = ""
    number: str = ""
    """The short number people use (`Q7`)."""
    expires_us: Micros | None = None
    """Engine time at which the question lapses."""
    if_no_answer: str = ""
    """A text that says what happens then; never an answer."""
    attachments: tuple[Attachment, ...] = ()
    """The newest files of the task that asks."""
    form: tuple[FormField, ...] = ()
    """What is filled in with the answer."""


class OpenQuestion(Struct, frozen=True, kw_only=True):
    """A question that waits for its person's answer."""

    goal_id: str
    person: str
    person_name: str
    task_id: str
    asked_at: Micros
    ask: ConfirmFields


class _Person:
    """A person's body: questions are shown, withdrawing one always succeeds."""

    def __init__(self, desk: "DeskTransport", card: AgentCard, name: str, now: Callable[[], Micros]) -> None:
        self.name = name
        self.questions: dict[str, OpenQuestion] = {}
        self.side = AgentSide(card, self, desk, now=now)

    def start(self, request: GoalRequest) -> str:
        if len(self.questions) >= MOST_OPEN:
            return "too_many_questions"
        try:
            ask = msgspec.convert(request.fields, ConfirmFields)
        except msgspec.ValidationError:
            return "bad_fields"
        if not ask.options:
            return "bad_fields"
        self.questions[request.goal_id] = OpenQuestion(
            goal_id=request.goal_id,
            person=self.side.card.id,
            person_name=self.name,
            task_id=request.task_id,
            asked_at=self.side.engine_now(),
            ask=ask,
        )
        return ""

    def cancel(self, goal_id: str) -> bool:
        del self.questions[goal_id]
        self.side.finish(goal_id, "canceled")
        return True


class DeskTransport:
    """The people of this process.

    Args:
        now: a local clock in microseconds.
        boot_id: must differ at every start of the process, so that questions of the last one are asked again.
        on_change: called after the open questions changed, from the thread that changed them.
    """

    name = "desk"
    guarantees = GUARANTEES

    def __init__(
        self, *, now: Callable[[], Micros], boot_id: str = "", on_change: Callable[[], None] = lambda: None
    ) -> None:
        self._now = now
        self._boot_id = boot_id or f"desk-{now()}"
        self._on_change = on_change
        self._wake: Callable[[], None] = lambda: None
        self._lock = threading.RLock()
        self._people: dict[str, _Person] = {}
        self._inbox: deque[TransportEvent] = deque()
        self._site: SiteMessage | None = None

    # People.

    def add_person(self, person: str, agent_type: str, name: str = "") -> None:
        """Let a person work at this desk, under an agent's id.

        Raises:
            TransportError: somebody has this id.
        """
        with self._lock:
            if person in self._people:
                raise TransportError(f"{person!r} is at the desk already")
            card = AgentCard(id=person, type=agent_type, boot_id=self._boot_id, actions=(CONFIRM,), mobility="people")
            one = self._people[person] = _Person(self, card, name or person, self._now)
            if self._site is not None:
                one.side.on_site(self._site)
            one.side.announce()
        self._wake()

    def open_questions(self, person: str = "") -> tuple[OpenQuestion, ...]:
        """Return the questions that wait for an answer, oldest first; of one person if given."""
        with self._lock:
            found = [
                question
                for one in self._people.values()
                for question in one.questions.values()
                if person in ("", one.side.card.id)
            ]
        return tuple(sorted(found, key=lambda question: (question.asked_at, question.goal_id)))

    def find(self, word: str, person: str = "") -> OpenQuestion | None:
        """Return the open question with this goal id or short number (`Q7`, any case), of `person` if given."""
        for question in self.open_questions(person):
            if word == question.goal_id or (word and word.lower() == question.ask.number.lower()):
                return question
        return None

    def answer(self, goal_id: str, option: str, form: Mapping[str, Any] | None = None) -> str | None:
        """Answer an open question. Return None, or the text of what is wrong (nothing is changed then).

        Args:
            goal_id: of the question.
            option: one of its options.
            form: what was filled in, by name, as runtime values.
        """
        with self._lock:
            question = self.find(goal_id)
            if question is None:
                return f"answer_late: {goal_id!r} is not open: it was answered, withdrawn or has lapsed"
            if option not in question.ask.options:
                choices = ", ".join(question.ask.options)
                return f"bad_option: {option!r} is no answer to this question; choose from {choices}"
            if missing := lack(question.ask.form, form or {}):
                return f"bad_fields: {missing}"
            one = self._people[question.person]
            del one.questions[question.goal_id]
            result: dict[str, Any] = {"answer": option, "by": question.person, "at": one.side.engine_now()}
            if question.ask.form:
                result["form"] = to_wire(dict(form or {}))
            one.side.finish(question.goal_id, "succeeded", result=result)
        self._wake()
        self._on_change()
        return None

    def report_event(self, person: str, event: str, fields: Mapping[str, Any]) -> None:
        """Tell an event of a person's own, with its fields as wire values.

        Raises:
            TransportError: nobody at the desk has this id.
        """
        with self._lock:
            one = self._people.get(person)
            if one is None:
                raise TransportError(f"nobody called {person!r} is at the desk")
            one.side.report_event(event, **fields)
        self._wake()

    # The engine's end.

    def open(self, wake: Callable[[], None]) -> None:
        """Start; people who were added before are seen at the first poll."""
        self._wake = wake
        if self._inbox:
            wake()

    def close(self) -> None:
        """Stop; open questions end with the process."""
        self._wake = lambda: None

    def poll(self) -> Sequence[TransportEvent]:
        """Return what has happened since."""
        with self._lock:
            events = tuple(self._inbox)
            self._inbox.clear()
        return events

    def send_goal(self, request: GoalRequest) -> None:
        """Ask a person."""
        self._ask(request.agent, "goal", request.goal_id, request)

    def cancel_goal(self, agent: str, goal_id: str) -> None:
        """Withdraw a question."""
        self._ask(agent, "cancel", goal_id, CancelRequest(goal_id))

    def query_goals(self, agent: str, goal_ids: Sequence[str]) -> None:
        """Ask what became of questions."""
        self._ask(agent, "query", "", GoalsRequest(tuple(goal_ids)))

    def send_update(self, update: UpdateRequest) -> None:
        """Change a question: refused, nobody's question changes while it is read."""
        self._ask(update.agent, "update", update.goal_id, update)

    def publish_clock(self, beat: ClockBeat) -> None:
        """Tell everyone the time; they answer with their status."""
        with self._lock:
            for one in self._people.values():
                one.side.on_clock(beat)
                one.side.publish_status()
        self._wake()

    def publish_site(self, message: SiteMessage) -> None:
        """Tell everyone of the site; it is the same for who comes later."""
        with self._lock:
            self._site = message
            for one in self._people.values():
                one.side.on_site(message)

    # The people's link; called with the lock held.

    def publish_status(self, status: AgentStatus) -> None:
        """Take in a person's status."""
        self._inbox.append(StatusArrived(status))

    def publish_event(self, event: GoalEvent) -> None:
        """Take in news of a question."""
        self._inbox.append(GoalReported(event))

    def publish_agent_event(self, event: AgentEvent) -> None:
        """Take in an event of a person's own."""
        self._inbox.append(EventArrived(event))

    def publish_card(self, card: AgentCard) -> None:
        """Take in a person."""
        self._inbox.append(AgentSeen(card))

    def _ask(self, agent: str, what: Asked, goal_id: str, message: Any) -> None:
        with self._lock:
            one = self._people.get(agent)
            try:
                if one is None:
                    raise WireError(f"nobody called {agent!r} is at the desk")
                reply = serve_request(one.side, what, encode(message))
                self._inbox.append(read_reply(agent, what, goal_id, reply))
            except WireError as error:
                self._inbox.append(SendFailed(agent, what, goal_id, "unreachable", str(error)))
        self._wake()
        if what != "query":
            self._on_change()
