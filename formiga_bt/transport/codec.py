"""JSON in and out, with the checks every wire needs: size, shape, bounds, and that an agent speaks of itself only.

Why here: what one wire refuses all wires must refuse. Called by the transports and by the agents' links. Nothing here
raises anything but `WireError`, whatever an agent sends (NaN and infinity are no JSON and fail the decoding), and nothing
that passes is more than the engine and its journal can reckon with (`bounds`).

A request is answered by `serve_request` at the agent and read by `read_reply` at the engine.
"""

import math
from typing import Any, Final, Literal, TypeVar

import msgspec
from msgspec import Struct

from formiga_bt.base.bounds import ID_LIMIT, MOST, MOST_INT, are_within, fault_of
from formiga_bt.base.errors import TransportError
from formiga_bt.base.geo import Position
from formiga_bt.transport.agent_side import AgentSide
from formiga_bt.transport.cards import read_card
from formiga_bt.transport.messages import (
    AgentCard,
    AgentEvent,
    AgentStatus,
    ClockBeat,
    GoalEvent,
    GoalReported,
    GoalRequest,
    QueryReplied,
    SiteMessage,
    TransportEvent,
    UpdateAnswered,
    UpdateReply,
    UpdateRequest,
)

Asked = Literal["goal", "cancel", "query", "update"]
"""The requests an engine makes of an agent."""

FRAME_LIMIT: Final = 256 * 1024
"""The most bytes one message may have."""
CHECKS_LIMIT: Final = 32
"""The most preflight checks, and the most errors, that a status may hold."""
FIELDS_LIMIT: Final = 200
"""The most fields of its type that a status may hold."""

MOST_SPEED: Final = 1000.0
"""Engine seconds per wall second, as a beat may say."""

_T = TypeVar("_T")


class WireError(TransportError):
    """A message that cannot be read, is too long, or lies. The engine's side makes a BadMessage of it."""


class UnsentReplyError(WireError):
    """A request was carried out but its reply cannot be written: whoever asked must think "outcome unknown"."""


class CancelRequest(Struct, frozen=True):
    """The body of a cancel."""

    goal_id: str


class GoalsRequest(Struct, frozen=True):
    """The body of a query of goals."""

    goal_ids: tuple[str, ...]


class GoalsReply(Struct, frozen=True):
    """The answer to a query of goals; `boot_id` is the agent's present one."""

    boot_id: str
    goals: tuple[GoalEvent, ...]


_encoder: Final = msgspec.json.Encoder()


def encode(message: Any) -> bytes:
    """Return a message as JSON.

    Raises:
        WireError: it is longer than `FRAME_LIMIT`, or holds what JSON cannot.
    """
    try:
        raw = _encoder.encode(message)
    except (TypeError, msgspec.MsgspecError) as error:
        raise WireError(f"cannot be written as JSON: {error}") from error
    check_size(len(raw))
    return raw


def decode(raw: bytes, kind: type[_T]) -> _T:
    """Return a message of type `kind`.

    Raises:
        WireError: the bytes are too many, no JSON, or of another shape.
    """
    check_size(len(raw))
    try:
        return msgspec.json.decode(raw, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise WireError(f"{kind.__name__}: {error}") from error


def decode_card(raw: bytes) -> AgentCard:
    """Return a card; what cannot be read of it stands in its `faults`, and one of another version has no actions.

    Raises:
        WireError: the card as a whole cannot be read.
    """
    check_size(len(raw))
    try:
        return read_card(msgspec.json.decode(raw))
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise WireError(f"AgentCard: {error}") from error


def check_size(size: int) -> None:
    """Refuse a message of more than `FRAME_LIMIT` bytes.

    Raises:
        WireError: it is too long.
    """
    if size > FRAME_LIMIT:
        raise WireError(f"a message of {size} bytes; the most is {FRAME_LIMIT}")


def check_card(agent: str, card: AgentCard) -> AgentCard:
    """Return the card if it is this agent's and usable.

    Raises:
        WireError: it is another's, has no boot_id, or a limit is no finite number, or beyond `MOST`.
    """
    if card.id != agent:
        raise WireError(f"a card of {card.id!r} came from {agent!r}")
    if not card.boot_id:
        raise WireError("a card without boot_id")
    if not all(math.isfinite(limit) for limit in card.limits.values()):
        raise WireError("a card with a limit that is no finite number")
    if not are_within(card.limits.values()):
        raise WireError(f"a card with a limit beyond {MOST:g}")
    return card


def check_status(agent: str, status: AgentStatus) -> AgentStatus:
    """Return the status if it is this agent's and all its numbers are finite.

    Raises:
        WireError: it is another agent's, has no boot_id, holds NaN or infinity (possible without JSON in between) or a number
            that is out of bounds, half a wind, more than `CHECKS_LIMIT` preflight checks, or one without a name or twice.
    """
    if status.id != agent:
        raise WireError(f"a status of {status.id!r} came from {agent!r}")
    if not status.boot_id:
        raise WireError("a status without boot_id")
    numbers = [status.battery, status.payload_kg, status.quality, status.lat or 0.0, status.lng or 0.0]
    numbers += [status.wind_east_m_s or 0.0, status.wind_north_m_s or 0.0]
    for point in (status.position, status.initial_deployment):
        numbers += _numbers(point)
    if not all(math.isfinite(number) for number in numbers):
        raise WireError("a status with a number that is not finite")
    if not are_within(numbers):
        raise WireError(f"a status with a number beyond {MOST:g}")
    _check_more(status)
    counts = (status.seq, status.stamp, status.age_us, status.beat, status.epoch, status.epoch_ignored)
    if not are_within(counts, MOST_INT):
        raise WireError("a status with a whole number beyond 2**61")
    if (status.wind_east_m_s is None) != (status.wind_north_m_s is None):
        raise WireError("a status with half a wind: east and north, or neither")
    names = [check.check for check in status.checks]
    if len(names) > CHECKS_LIMIT or not all(names) or len(set(names)) < len(names):
        raise WireError(f"a status with preflight checks that are more than {CHECKS_LIMIT}, nameless, or named twice")
    return status


def _check_more(status: AgentStatus) -> None:
    """Check what a status of a machine that is no drone says besides: looked at only where it is said."""
    link = status.link
    for name, number, most in (
        ("heading_deg", status.heading_deg, 360.0),
        ("speed_m_s", status.speed_m_s, MOST),
        ("link.rtt_ms", link.rtt_ms if link is not None else None, MOST),
        ("link.loss", link.loss if link is not None else None, 1.0),
    ):
        if number is not None and not 0.0 <= number <= most:
            raise WireError(f"a status with {name} {number!r}: 0 to {most:g}, or null")
    if status.altitude_m is not None and not -MOST <= status.altitude_m <= MOST:
        raise WireError(f"a status with altitude_m beyond {MOST:g}")
    if len(status.errors) > CHECKS_LIMIT or not all(error.code for error in status.errors):
        raise WireError(f"a status with errors that are more than {CHECKS_LIMIT}, or without a code")
    if status.fields:
        if len(status.fields) > FIELDS_LIMIT:
            raise WireError(f"a status with more than {FIELDS_LIMIT} fields")
        _check_values("a status whose fields hold", status.fields)


def check_event(agent: str, event: GoalEvent) -> GoalEvent:
    """Return the event if it, and the status it carries, are this agent's.

    Raises:
        WireError: it is another agent's, its id is too long, its count or a value in its result out of bounds, or its status
            bad.
    """
    if event.agent != agent:
        raise WireError(f"an event of {event.agent!r} came from {agent!r}")
    _check_goal_id(event.goal_id)
    if not are_within((event.n,), MOST_INT):
        raise WireError("an event with a whole number beyond 2**61")
    if not all(math.isfinite(number) for number in (event.progress or 0.0, event.eta_s or 0.0)):
        raise WireError("an event with a number that is not finite")
    if event.result:
        _check_values("an event whose result holds", event.result)
    if event.status is not None:
        check_status(agent, event.status)
    return event


def check_agent_event(agent: str, event: AgentEvent) -> AgentEvent:
    """Return an event of an agent's own if it is this agent's and told apart from its others.

    Raises:
        WireError: it is another agent's, has no name, boot_id or number, or a number out of bounds.
    """
    if event.agent != agent:
        raise WireError(f"an event of {event.agent!r} came from {agent!r}")
    if not event.event or not event.boot_id or event.n < 1:
        raise WireError("an event without name, boot_id or n")
    if not are_within((event.n, event.stamp), MOST_INT):
        raise WireError("an event with a whole number beyond 2**61")
    _check_values("an event whose fields hold", event.fields)
    return event


def check_request(request: GoalRequest) -> GoalRequest:
    """Return the goal if its link silence can be kept.

    Raises:
        WireError: `link_silence_s` is not above 0 s or not finite.
    """
    silence_s = request.link_silence_s
    if silence_s is not None and not 0.0 < silence_s < math.inf:
        raise WireError(f"a goal with link_silence_s {silence_s!r}: seconds above 0, or null")
    return request


def check_update(update: UpdateRequest) -> UpdateRequest:
    """Return the update if it can be counted.

    Raises:
        WireError: `n` is not from 1 to 2**61, or there are no fields.
    """
    if not 1 <= update.n <= MOST_INT:
        raise WireError(f"an update with n {update.n!r}: from 1 to 2**61")
    if not update.fields:
        raise WireError("an update without fields")
    return update


def decode_site(raw: bytes) -> SiteMessage:
    """Return a site message.

    Raises:
        WireError: it cannot be read, has no version, or a number beyond `MOST`.
    """
    message = decode(raw, SiteMessage)
    if not message.version:
        raise WireError("a site message without version")
    points = [*message.fence, *message.ports.values(), *(one.at for one in message.stations.values())]
    points += [corner for region in (*message.no_fly, *message.no_go) for corner in region]
    numbers = [number for point in points for number in (point.east_m, point.north_m)]
    if not are_within((*numbers, *message.transit_m, message.return_m or 0.0)):
        raise WireError(f"a site message with a number beyond {MOST:g}")
    return message


def check_clock(beat: ClockBeat) -> ClockBeat:
    """Return a beat of an engine's clock if an agent can reckon with it.

    Raises:
        WireError: a whole number beyond 2**61, or a speed that is negative, not finite or above `MOST_SPEED`.
    """
    if not are_within((beat.wall_us, beat.engine_us, beat.beat), MOST_INT):
        raise WireError("a beat with a whole number beyond 2**61")
    if not 0.0 <= beat.speed <= MOST_SPEED:
        raise WireError(f"a beat with speed {beat.speed!r}: 0 to {MOST_SPEED:g} engine seconds a second")
    return beat


def _check_goal_id(goal_id: str) -> None:
    size = len(goal_id.encode())
    if size > ID_LIMIT:
        raise WireError(f"a goal id of {size} bytes; the most is {ID_LIMIT}")


def _check_values(what: str, values: dict[str, Any]) -> None:
    fault = fault_of(values)
    if fault:
        raise WireError(f"{what} {fault}")


def _numbers(point: Position | None) -> list[float]:
    return [] if point is None else [point.east_m, point.north_m, point.up_m]


def serve_request(side: AgentSide, what: Asked, raw: bytes) -> bytes:
    """Return an agent's reply to a request: the whole of the agent's end of it.

    Raises:
        UnsentReplyError: the request was carried out, but its reply is too long.
        WireError: the request cannot be read; nothing was done.
    """
    reply: GoalEvent | GoalsReply | UpdateReply
    if what == "goal":
        reply = side.on_goal(check_request(decode(raw, GoalRequest)))
    elif what == "cancel":
        reply = side.on_cancel(decode(raw, CancelRequest).goal_id)
    elif what == "update":
        reply = side.on_update(check_update(decode(raw, UpdateRequest)))
    else:
        reply = GoalsReply(side.card.boot_id, side.on_query(decode(raw, GoalsRequest).goal_ids))
    try:
        return encode(reply)
    except WireError as error:
        raise UnsentReplyError(str(error)) from error


def read_reply(agent: str, what: Asked, goal_id: str, raw: bytes) -> TransportEvent:
    """Return what an agent's reply to a request says.

    Raises:
        WireError: it cannot be read, or speaks of another agent or another goal than the one asked for.
    """
    if what == "query":
        reply = decode(raw, GoalsReply)
        return QueryReplied(agent, reply.boot_id, tuple(check_event(agent, event) for event in reply.goals))
    if what == "update":
        return UpdateAnswered(_check_reply(agent, goal_id, decode(raw, UpdateReply)))
    event = check_event(agent, decode(raw, GoalEvent))
    if event.goal_id != goal_id:
        raise WireError(f"an answer for goal {event.goal_id!r} to a {what} of {goal_id!r}")
    return GoalReported(event)


def _check_reply(agent: str, goal_id: str, reply: UpdateReply) -> UpdateReply:
    if reply.agent != agent or reply.goal_id != goal_id:
        raise WireError(f"an answer of {reply.agent!r} for {reply.goal_id!r} to an update of {goal_id!r}")
    if not are_within((reply.n, reply.stands), MOST_INT):
        raise WireError("an answer to an update with a whole number beyond 2**61")
    return reply
