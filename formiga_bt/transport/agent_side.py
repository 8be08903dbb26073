"""The rules that every agent follows, once: remembered goal ids, epochs, expiry, one goal at a time, link silence.

Why here: an engine that crashes, repeats itself or loses messages is only safe if all agents answer alike. Simulated
agents, the desk's people and integrators put an `AgentSide` between their body and their wire (`docs/wire.md`).

Called from one thread. A wire calls the `on_...` methods and sends what they return; a body calls `feedback`, `finish`,
`publish_status` and `take_control`. Both may happen inside a call to the body (`start` may `finish` at once).

Link silence: the owner looks at `is_cut_off` now and then (at `cut_off_at`, or in its loop). While it is True and the
machine is in the air, the body does by itself what its card calls `on_link_loss`, after `take_control("failsafe")`.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

import msgspec

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.bounds import BEAT_STEP, EPOCH_STEP, MOST_EPOCH, MOST_INT
from formiga_bt.base.clock import SECOND, Micros, micros
from formiga_bt.transport.attachments import Attachment
from formiga_bt.transport.base import AgentBody, AgentLink, UpdatableBody
from formiga_bt.transport.messages import (
    TERMINAL,
    AgentCard,
    AgentEvent,
    AgentStatus,
    ClockBeat,
    Control,
    GoalEvent,
    GoalRequest,
    GoalState,
    SiteMessage,
    UpdateReply,
    UpdateRequest,
)

REMEMBERED_GOALS: Final = 1000
"""Ids and results an agent remembers. Goals that still run are never forgotten."""

REMEMBERED_EVENTS: Final = 100
"""Events of its own that an agent tells the next engine again; an engine keeps as many of each agent."""

SET_BACK_US: Final[Micros] = 10 * SECOND
"""Engine time as known here stands still while it is ahead of the engine's by less than that (wall), else it steps back."""

ENGINE_KEPT_US: Final[Micros] = 30 * SECOND
"""An engine that was silent for so long may be replaced by one of another identity."""

STANDBY: Final = "STANDBY"
EXECUTING: Final = "EXECUTING ACTION"

STATUS_FIELDS: Final = frozenset(
    {
        "battery", "position", "lat", "lng", "initial_deployment", "landed", "payload_kg", "quality", "age_us",
        "wind_east_m_s", "wind_north_m_s", "checks", "heading_deg", "speed_m_s", "altitude_m", "floor", "charging", "link",
        "errors", "fields",
    }
)  # fmt: skip
"""What a body may say of itself; all other fields of a status are the side's."""


class _Record:
    """What is remembered of one goal: its request (until it ended), its newest event, whom it replaces."""

    __slots__ = ("action", "event", "replaces", "request", "updates")

    def __init__(self, request: GoalRequest | None, event: GoalEvent, replaces: tuple[str, ...] = ()) -> None:
        self.action = request.action if request is not None else ""
        self.request = request
        self.event = event
        self.replaces = replaces
        self.updates = 0
        """The highest update that it follows."""


class AgentSide:
    """One agent's goals and status, between its wire and its body. A new instance is a new start (new `boot_id`).

    Args:
        card: what the agent announces; `card.boot_id` must differ from that of every earlier start.
        body: what carries out goals.
        link: how events and statuses leave.
        now: a local clock in microseconds that never goes back; engine time is extrapolated with it.
        beat_us: time between the engine's heartbeats by that clock. If given, beats that must have passed unheard
            count for the life of a goal: a process that stood still finds the old goal in its ears before the beats.
    """

    def __init__(
        self,
        card: AgentCard,
        body: AgentBody,
        link: AgentLink,
        *,
        now: Callable[[], Micros],
        beat_us: Micros | None = None,
    ) -> None:
        assert card.boot_id, "an agent's card needs a boot_id that changes with every start"
        self.card = card
        self._body = body
        self._link = link
        self._now = now
        self._beat_us = beat_us
        self._goals: dict[str, _Record] = {}
        self._running: list[str] = []
        self._status = AgentStatus(id=card.id, type=card.type, boot_id=card.boot_id, seq=0, stamp=0)
        self._seq = 0
        self._engine_id = ""
        self._epoch = 0
        self._ignored_epoch = 0
        self._beat = 0
        self._paced: tuple[Micros, int] | None = None
        """A beat that was current, and when by the local clock: later beats are counted from there."""
        self._late: tuple[Micros, int] | None = None
        """The first of the beats that came later than they must have been sent."""
        self._far_beat: int | None = None
        """A beat that was too far ahead to be believed: the next one that follows on it confirms it."""
        self._clock: tuple[Micros, ClockBeat] | None = None
        self._site: SiteMessage | None = None
        self._engine_now: Micros = 0
        self._heard_at: Micros = now()
        self._silence_us: Micros | None = None
        self._untold: list[str] = []
        self._events = 0
        self._unsure: tuple[list[AgentEvent], list[AgentEvent]] = ([], [])
        """Events told since the newest beat, and between that and the one before: an engine may have died with them."""

    # What the owner may look at.

    @property
    def active(self) -> tuple[GoalRequest, ...]:
        """Return the goals that have not ended, oldest first."""
        return tuple(record.request for goal in self._running if (record := self._goals[goal]).request is not None)

    @property
    def active_goal(self) -> GoalRequest | None:
        """Return the oldest goal that has not ended, or None."""
        return next(iter(self.active), None)

    @property
    def engine_id(self) -> str:
        """Return which engine this agent follows; "" before one said its name."""
        return self._engine_id

    @property
    def site(self) -> SiteMessage | None:
        """Return the newest that its engine has told of the site; None before it has."""
        return self._site

    @property
    def wants_site(self) -> bool:
        """Return whether the wire should ask for the site: it has none of the engine that it follows."""
        return self._site is None or self._site.engine_id != self._engine_id

    @property
    def epoch(self) -> int:
        """Return the highest epoch heard, from goals or from the clock."""
        return self._epoch

    @property
    def beat(self) -> int:
        """Return the newest heartbeat heard in this epoch."""
        return self._beat

    @property
    def control(self) -> Control:
        """Return who is in command of this agent."""
        return self._status.control

    @property
    def status(self) -> AgentStatus:
        """Return the status as it would be published now (does not use up a `seq`)."""
        return self._present_status()

    @property
    def cut_off_at(self) -> Micros | None:
        """Return when, by the local clock, the silence grows too long; None before a goal said how long is too long."""
        return self._heard_at + self._silence_us if self._silence_us is not None else None

    @property
    def is_cut_off(self) -> bool:
        """Return whether nothing was heard of the engine for longer than the newest begun goal's `link_silence_s`."""
        at = self.cut_off_at
        return at is not None and self._now() > at

    def state_of(self, goal_id: str) -> GoalState:
        """Return the recorded state of a goal, "unknown" if there is none."""
        record = self._goals.get(goal_id)
        return record.event.state if record else "unknown"

    def action_of(self, goal_id: str) -> str:
        """Return the action of a remembered goal, "" if there is none."""
        record = self._goals.get(goal_id)
        return record.action if record else ""

    def runs_beside(self, action: str) -> bool:
        """Return whether goals of an action run beside any others: a question to a person, and what the card says."""
        if action == CONFIRM:
            return self.card.mobility == "people"
        announced = self.card.action(action)
        return announced is not None and announced.exclusive is False

    def announce(self) -> None:
        """Publish the card and a first status: the owner calls it once, when body and wire are ready."""
        self._link.publish_card(self.card)
        self.publish_status()

    # From the wire.

    def on_goal(self, request: GoalRequest) -> GoalEvent:
        """Begin a goal, or say why not, or answer the recorded state of a repeated id. Return the reply."""
        known = self._goals.get(request.goal_id)
        if known is not None:
            return self._answer(known.event)
        if not self._follows(request.engine_id, request.epoch, request.beat):
            return GoalEvent(goal_id=request.goal_id, agent=self.card.id, state="rejected", n=1, code="other_engine")
        if request.epoch < self._epoch:
            # Not remembered: the engine that replaced the sender may send this very id again.
            return GoalEvent(goal_id=request.goal_id, agent=self.card.id, state="rejected", n=1, code="epoch_old")
        if request.epoch > self._epoch:
            if not self._believes_epoch(request.epoch):
                # Not remembered either: whoever sent it is no engine that this agent follows.
                return GoalEvent(goal_id=request.goal_id, agent=self.card.id, state="rejected", n=1, code="epoch_far")
            self._begin_epoch(request.epoch, request.beat)
        rivals = self._rivals(request)
        code = self._refusal(request, rivals)
        state: GoalState = "rejected" if code else "accepted"
        event = GoalEvent(goal_id=request.goal_id, agent=self.card.id, state=state, n=1, code=code)
        record = _Record(request, event, rivals)
        self._remember(request.goal_id, record)
        if code:
            record.request = None
            return event
        self._heard_at = self._now()
        self._running.append(request.goal_id)
        code = self._body.start(request)
        if not code and request.link_silence_s is not None:
            self._silence_us = micros(request.link_silence_s)
        if code and record.event.state not in TERMINAL:
            self._running.remove(request.goal_id)
            record.request = None
            record.event = msgspec.structs.replace(record.event, state="rejected", code=code)
        else:
            self._replace_rivals(record)
        return self._answer(record.event)

    def on_cancel(self, goal_id: str) -> GoalEvent:
        """Pass a cancel to the body. Return canceling, a refusal, the recorded end, or "unknown".

        The id of an unknown goal is remembered as canceled: should the goal arrive later, it is not begun.
        """
        record = self._goals.get(goal_id)
        if record is None:
            late = GoalEvent(goal_id=goal_id, agent=self.card.id, state="canceled", n=1, code="canceled_before_start")
            self._remember(goal_id, _Record(None, late))
            return msgspec.structs.replace(late, state="unknown", n=0, code="")
        if record.event.state in TERMINAL or record.event.state == "canceling":
            return self._answer(record.event)
        taken = self._body.cancel(goal_id)
        if record.event.state in TERMINAL:
            return self._answer(record.event)
        if taken:
            record.event = self._next(record, state="canceling")
            return record.event
        record.event = self._next(record)
        return msgspec.structs.replace(record.event, cancel_refused=True)

    def on_update(self, update: UpdateRequest) -> UpdateReply:
        """Let a goal that runs follow other fields, or say why not: then it goes on as before. Return the reply."""
        record = self._goals.get(update.goal_id)
        code = self._no_update(update, record)
        if not code and record is not None and update.n > record.updates:
            request, body = record.request, self._body
            assert request is not None, "a goal that runs has its request"
            code = body.update(update.goal_id, update.fields) if isinstance(body, UpdatableBody) else "no_update"
            if not code:
                record.updates = update.n
                if record.request is not None:  # it may have ended by that
                    record.request = msgspec.structs.replace(request, fields={**request.fields, **update.fields})
        stands = record.updates if record is not None else 0
        return UpdateReply(goal_id=update.goal_id, agent=self.card.id, n=update.n, stands=stands, code=code)

    def _no_update(self, update: UpdateRequest, record: _Record | None) -> str:
        """Return why an update cannot be followed, whatever the body says; "" = it may be."""
        if update.agent != self.card.id:
            return "wrong_agent"
        if not self._follows(update.engine_id, update.epoch, update.beat):
            return "other_engine"
        if update.epoch < self._epoch:
            return "epoch_old"
        if update.epoch > self._epoch:
            if not self._believes_epoch(update.epoch):
                return "epoch_far"
            self._begin_epoch(update.epoch, update.beat)
        if self._beat_by_now() > update.beat + update.ttl_beats:
            return "goal_expired"
        if record is None:
            return "unknown_goal"
        if record.event.state in TERMINAL or record.event.state == "canceling":
            return "goal_ended"
        return "" if self._status.control == "engine" else "not_in_command"

    def on_query(self, goal_ids: Sequence[str]) -> tuple[GoalEvent, ...]:
        """Return the recorded state of each asked goal, "unknown" for those this start of the agent never had.

        None asked: every goal that has not ended.
        """
        unknown = GoalEvent(goal_id="", agent=self.card.id, state="unknown")
        return tuple(
            self._answer(self._goals[goal].event)
            if goal in self._goals
            else msgspec.structs.replace(unknown, goal_id=goal)
            for goal in goal_ids or tuple(self._running)
        )

    def on_clock(self, beat: ClockBeat) -> None:
        """Take the engine's clock. Beats of another or older engine, late ones, and ones too far ahead are ignored."""
        if not self._follows(beat.engine_id, beat.epoch, beat.beat):
            return
        if beat.epoch < self._epoch or (beat.epoch > self._epoch and not self._believes_epoch(beat.epoch)):
            return
        was_cut_off = self.is_cut_off
        if beat.epoch > self._epoch:
            self._begin_epoch(beat.epoch, beat.beat)
        elif self._clock is not None and self._clock[1].epoch == beat.epoch and not self._believes_beat(beat.beat):
            return
        elif was_cut_off:
            self._report_events_again()
        self._keep_pace(beat.beat)
        self._beat = max(self._beat, beat.beat)
        self._heard_at = self._now()
        self._clock = (self._heard_at, beat)
        if self._engine_now - beat.engine_us > SET_BACK_US * max(1.0, beat.speed):
            self._engine_now = beat.engine_us
        self._unsure = ([], self._unsure[0])
        if was_cut_off:
            self._report_unheard()

    def on_site(self, message: SiteMessage) -> None:
        """Take what the engine tells of the site; what another one, or an earlier start of it, tells is ignored."""
        known = self._site
        if self._engine_id and message.engine_id not in ("", self._engine_id):
            return
        if known is None or known.engine_id != message.engine_id or message.epoch >= known.epoch:
            self._site = message

    def excuse_silence(self) -> None:
        """Count silence from now on: the owner itself stood still and could not have heard."""
        self._heard_at = self._now()

    def engine_now(self) -> Micros:
        """Return engine time, extrapolated from the newest beat; the local clock before the first.

        It goes back only if it was far ahead of the engine's own (the engine's machine slept, or ran slower afterwards).
        """
        if self._clock is None:
            return self._now()
        heard, beat = self._clock
        self._engine_now = max(self._engine_now, beat.engine_us + round((self._now() - heard) * beat.speed))
        return self._engine_now

    # From the body.

    def feedback(
        self, goal_id: str, *, progress: float | None = None, eta_s: float | None = None, phase: str = ""
    ) -> None:
        """Publish how far a goal is. Ignored for one that has ended."""
        record = self._goals.get(goal_id)
        if record is None or record.event.state in TERMINAL:
            return
        self._replace_rivals(record)
        state: GoalState = "canceling" if record.event.state == "canceling" else "running"
        record.event = self._next(record, state=state, progress=progress, eta_s=eta_s, phase=phase)
        self._link.publish_event(record.event)

    def finish(
        self,
        goal_id: str,
        state: GoalState,
        *,
        code: str = "",
        text: str = "",
        result: dict[str, Any] | None = None,
        attachments: Sequence[Attachment] = (),
    ) -> None:
        """End a goal and publish the end with the full status. Ignored for a goal that has ended (or never began)."""
        assert state in TERMINAL - {"rejected"}, f"{state} does not end a goal that was begun"
        record = self._goals.get(goal_id)
        if record is None or record.event.state in TERMINAL:
            return
        self._replace_rivals(record)
        self._running.remove(goal_id)
        record.request = None
        record.event = self._next(
            record, state=state, code=code, text=text, result=result or {}, attachments=tuple(attachments)
        )
        self._status = msgspec.structs.replace(self._status, last_goal=goal_id, last_goal_state=state)
        if self.is_cut_off:
            self._untold.append(goal_id)
        self._link.publish_event(msgspec.structs.replace(record.event, status=self._make_status()))

    def set_status(self, **fields: Any) -> None:
        """Note the body's present fields of AgentStatus (`battery`, `position`, `landed`, ...) without publishing."""
        wrong = fields.keys() - STATUS_FIELDS
        assert not wrong, f"{sorted(wrong)} are not for the body to set"
        self._status = msgspec.structs.replace(self._status, **fields)

    def publish_status(self, **fields: Any) -> None:
        """Note the body's present fields and publish the full status."""
        if fields:
            self.set_status(**fields)
        self._link.publish_status(self._make_status())

    def report_event(self, event: str, /, attachments: Sequence[Attachment] = (), **fields: Any) -> None:
        """Publish an event of the agent's own, with its fields as wire values.

        What was told while no engine was heard, or just before, is told again to the next one that is.
        """
        self._events += 1
        made = AgentEvent(
            agent=self.card.id, event=event, boot_id=self.card.boot_id, n=self._events, stamp=self.engine_now(),
            fields=fields, attachments=tuple(attachments),
        )  # fmt: skip
        self._unsure[0].append(made)
        del self._unsure[0][:-REMEMBERED_EVENTS]
        self._link.publish_agent_event(made)

    def take_control(self, control: Control) -> None:
        """Say who is in command. Unless it is the engine, running goals end `taken_over` and new ones are rejected."""
        if control == self._status.control:
            return
        self._status = msgspec.structs.replace(self._status, control=control)
        if control != "engine":
            for goal in tuple(self._running):
                self.finish(goal, "taken_over")
        self.publish_status()

    # Inside.

    def _report_unheard(self) -> None:
        """Say again, now that the engine is heard, what ended in the silence."""
        untold, self._untold = self._untold, []
        for goal in untold:
            if goal in self._goals:
                self._link.publish_event(self._answer(self._goals[goal].event))
        self.publish_status()

    def _follows(self, engine_id: str, epoch: int, beat: int) -> bool:
        """Return whether this is the engine that the agent follows: the first that said its name, as long as it is heard."""
        if not engine_id or engine_id == self._engine_id:
            return True
        if self._engine_id:
            if self._now() - self._heard_at < ENGINE_KEPT_US or epoch > MOST_EPOCH:
                return False
            # Another engine has the site now: its count of starts and beats is another one, too.
            self._clock = None
            self._begin_epoch(epoch, beat)
        self._engine_id = engine_id
        return True

    def _believes_epoch(self, epoch: int) -> bool:
        """Return whether an epoch above ours may be an engine's: any is the first of a start, later ones come in steps."""
        most = min(MOST_EPOCH, self._epoch + EPOCH_STEP) if self._epoch else MOST_EPOCH
        if epoch > most:
            self._ignored_epoch = min(epoch, MOST_INT)
        return epoch <= most

    def _believes_beat(self, beat: int) -> bool:
        """Return whether a beat of this epoch is news: not late, and not so far ahead that one alone is no proof."""
        far, self._far_beat = self._far_beat, None
        if beat < self._beat:
            return False
        if beat <= self._beat + BEAT_STEP or (far is not None and far < beat <= far + BEAT_STEP):
            return True
        self._far_beat = beat
        return False

    def _begin_epoch(self, epoch: int, beat: int) -> None:
        """Another engine is there: it may not know what was told to the one before, or to nobody."""
        self._epoch, self._beat, self._far_beat = epoch, beat, None
        self._paced = self._late = None
        self._report_events_again()

    def _report_events_again(self) -> None:
        newest, older = self._unsure
        for event in (*older, *newest):
            self._link.publish_agent_event(event)

    def _refusal(self, request: GoalRequest, rivals: tuple[str, ...]) -> str:
        if request.agent != self.card.id:
            return "wrong_agent"
        if self._beat_by_now() > request.beat + request.ttl_beats:
            return "goal_expired"
        if request.action not in self.card.names:
            return "unknown_action"
        if self._status.control != "engine":
            return "not_in_command"
        return "busy" if rivals and not request.safety else ""

    def _beat_by_now(self) -> int:
        """Return the beat that the engine must have reached: the newest heard, or more by the time that passed since."""
        if self._beat_us is None or self._paced is None:
            return self._beat
        at, beat = self._paced
        return max(self._beat, beat + (self._now() - at) // self._beat_us)

    def _keep_pace(self, beat: int) -> None:
        """Note when a beat was current. One that is late tells of no time: after a standstill the old ones are read first.

        If beats stay late at the engine's own pace, it is the engine that stood still, and its count holds from then on.
        """
        if self._beat_us is None:
            return
        now, late = self._now(), self._late
        if self._paced is None or beat >= self._beat_by_now():
            self._paced, self._late = (now, beat), None
        elif late is None or (beat - late[1]) * self._beat_us > 2 * (now - late[0]):
            self._late = (now, beat)  # they come faster than the engine beats: from a queue
        elif now - late[0] >= 2 * self._beat_us:
            self._paced, self._late = (now, beat), None

    def _rivals(self, request: GoalRequest) -> tuple[str, ...]:
        """Return the running goals beside which this one cannot run."""
        if self.runs_beside(request.action):
            return ()
        return tuple(goal.goal_id for goal in self.active if not self.runs_beside(goal.action))

    def _replace_rivals(self, record: _Record) -> None:
        # After the body took the new goal, so that a refused safety goal leaves the running one alone.
        rivals, record.replaces = record.replaces, ()
        for goal in rivals:
            self.finish(goal, "superseded")

    def _remember(self, goal_id: str, record: _Record) -> None:
        self._goals[goal_id] = record
        if len(self._goals) > REMEMBERED_GOALS + len(self._running):
            del self._goals[next(goal for goal, old in self._goals.items() if old.event.state in TERMINAL)]

    def _next(self, record: _Record, **changes: Any) -> GoalEvent:
        return msgspec.structs.replace(record.event, n=record.event.n + 1, **changes)

    def _answer(self, event: GoalEvent) -> GoalEvent:
        """Return a recorded event as a reply: an end carries the present status."""
        if event.state in TERMINAL and event.state != "rejected":
            return msgspec.structs.replace(event, status=self._make_status())
        return event

    def _make_status(self) -> AgentStatus:
        self._seq += 1
        return self._present_status()

    def _present_status(self) -> AgentStatus:
        goal = self.active_goal
        return msgspec.structs.replace(
            self._status,
            status=EXECUTING if goal else STANDBY,
            task_id=goal.task_id if goal else "None",
            action_name=goal.action if goal else "",
            seq=self._seq,
            stamp=self.engine_now(),
            beat=self._beat,
            epoch=self._epoch,
            epoch_ignored=self._ignored_epoch,
            engine_id=self._engine_id,
            site=self._site.version if self._site is not None else "",
        )
