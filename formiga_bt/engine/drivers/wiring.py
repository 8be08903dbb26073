"""What both drivers share: transport events become inputs, effects become calls on the transport that has the agent."""

from collections.abc import Callable, Sequence

from msgspec.structs import replace

from formiga_bt.base.clock import Micros
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.wires import missing
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.transport import messages as msg
from formiga_bt.transport.base import AgentTransport, Hearing, TellsSite


def to_input(event: msg.TransportEvent, wall: Micros, clock: Micros, of: AgentTransport | None = None) -> inp.Input:
    """Return the engine input for a transport event that came in at wall time `wall` and engine time `clock`.

    `of` is the wire that an announced agent is on.
    """
    match event:  # the frequent ones first
        case msg.StatusArrived(status):
            return inp.AgentStatusInput(status, wall, clock)
        case msg.GoalReported(goal):
            return inp.GoalEventInput(goal, wall, clock)
        case msg.AgentSeen(card):
            return inp.AgentSeenInput(card, wall, *((of.name, missing(of.guarantees)) if of is not None else ()))
        case msg.AgentGone(agent):
            return inp.AgentGoneInput(agent)
        case msg.EventArrived(told):
            return inp.AgentEventInput(told)
        case msg.QueryReplied(agent, boot_id, goals):
            return inp.QueryReplyInput(agent, boot_id, goals, clock)
        case msg.UpdateAnswered(reply):
            return inp.UpdateReplyInput(reply)
        case msg.SendFailed(agent, what, goal_id, outcome, text):
            return inp.EffectFailed(agent, what, goal_id, outcome, text)
        case msg.BadMessage(agent, text):
            return inp.BadStatusInput(agent, text)


class Switchboard:
    """Knows which transport has which agent, and carries out effects.

    Args:
        transports: the wires.
        engine_id: which engine this is, for goals.
    """

    def __init__(self, transports: Sequence[AgentTransport], engine_id: str = "") -> None:
        self._engine_id = engine_id
        self.transports = list(transports)
        self._of: dict[str, AgentTransport] = {}
        self._hearing = {id(one): one for one in self.transports if isinstance(one, Hearing)}
        """Looked at for each agent every few seconds, so told apart once."""

    def open(self, wake: Callable[[], None]) -> None:
        """Open all transports, or none.

        Raises:
            TransportError: one cannot be opened.
        """
        try:
            for transport in self.transports:
                transport.open(wake)
        except FormigaError:
            self.close()
            raise

    def close(self) -> None:
        """Close all transports."""
        for transport in self.transports:
            transport.close()

    def poll(self) -> list[msg.TransportEvent]:
        """Return what came in on all wires, wire by wire in order."""
        events: list[msg.TransportEvent] = []
        for transport in self.transports:
            news = transport.poll()
            if news:
                events += news
                for event in news:
                    if type(event) is msg.AgentSeen:
                        self._of[event.card.id] = transport
        return events

    def read(self, event: msg.TransportEvent, wall: Micros, clock: Micros) -> inp.Input:
        """Return the engine input for an event that `poll` returned."""
        return to_input(event, wall, clock, self._of.get(event.card.id) if type(event) is msg.AgentSeen else None)

    def heard(self, agent: str) -> Micros:
        """Return when the wire that has an agent last heard it, where it knows that besides its statuses; else 0."""
        hearing = self._hearing.get(id(self._of.get(agent)))
        return hearing.heard(agent) if hearing is not None else 0

    def publish_site(self, message: msg.SiteMessage, epoch: int) -> None:
        """Tell the agents of all wires of the site."""
        message = replace(message, engine_id=self._engine_id, epoch=epoch)
        for transport in self.transports:
            if isinstance(transport, TellsSite):
                transport.publish_site(message)

    def carry_out(self, effect: inp.Effect, beat: int) -> inp.EffectFailed | None:
        """Carry out one effect; an agent that no wire has is unreachable. Notices and alarms are the listeners'."""
        match effect:
            case inp.SendGoal():
                return self._send(effect, beat)
            case inp.CancelGoal(goal_id, agent):
                return self._try(agent, "cancel", goal_id, lambda t: t.cancel_goal(agent, goal_id))
            case inp.QueryGoal(agent, goal_ids):
                return self._try(agent, "query", "", lambda t: t.query_goals(agent, goal_ids))
            case inp.UpdateGoalFields():
                return self._update(effect, beat)
            case inp.NotifyPeople() | inp.Alarm() | inp.PublishState():
                return None

    def _send(self, effect: inp.SendGoal, beat: int) -> inp.EffectFailed | None:
        request = msg.GoalRequest(
            goal_id=effect.goal_id,
            agent=effect.agent,
            action=effect.action,
            fields=effect.fields,
            engine_id=self._engine_id,
            epoch=effect.epoch,
            beat=beat,
            ttl_beats=effect.ttl_beats,
            safety=effect.safety,
            clearance=effect.clearance,
            link_silence_s=effect.link_silence_s,
            task_id=effect.task or "None",
        )
        return self._try(effect.agent, "goal", effect.goal_id, lambda t: t.send_goal(request))

    def _update(self, effect: inp.UpdateGoalFields, beat: int) -> inp.EffectFailed | None:
        update = msg.UpdateRequest(
            goal_id=effect.goal_id,
            agent=effect.agent,
            action=effect.action,
            n=effect.n,
            fields=effect.fields,
            engine_id=self._engine_id,
            epoch=effect.epoch,
            beat=beat,
            ttl_beats=effect.ttl_beats,
        )
        return self._try(effect.agent, "update", effect.goal_id, lambda t: t.send_update(update))

    def _try(
        self, agent: str, what: str, goal_id: str, call: Callable[[AgentTransport], None]
    ) -> inp.EffectFailed | None:
        transport = self._of.get(agent)
        if transport is None:
            return inp.EffectFailed(agent, what, goal_id, "unreachable", "no transport has this agent")  # type: ignore[arg-type]
        try:
            call(transport)
        except FormigaError as error:
            return inp.EffectFailed(agent, what, goal_id, "unknown", str(error))  # type: ignore[arg-type]
        return None
