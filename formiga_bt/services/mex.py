"""Agents as the FORMIGA paper's Fig. 5 has them (`RobotStatus.msg`, `HumanStatus.msg`), for programs that were made for it.

What an agent says of itself (place, charge) is as it said last; status, task and action are as the engine knows them.
"""

import math
from typing import Final

from msgspec import Struct

from formiga_bt.base.clock import Micros
from formiga_bt.base.geo import Frame, Place, Position
from formiga_bt.engine.kernel.records import AgentRecord
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.listed import listing

NO_TASK: Final = "None"
"""The paper's word for "not assigned"."""


class Xyz(Struct, frozen=True):
    """A point: metres east, north and up of the base station."""

    x: float
    y: float
    z: float


class Quaternion(Struct, frozen=True):
    """A direction; `(0, 0, 0, 1)` where none is known."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Pose(Struct, frozen=True):
    """geometry_msgs/Pose."""

    position: Xyz
    orientation: Quaternion = Quaternion()


class PoseStamped(Struct, frozen=True):
    """geometry_msgs/PoseStamped; `stamp_us`: engine time of the status that said it."""

    pose: Pose
    stamp_us: Micros
    frame_id: str = "base"


class NavSatFix(Struct, frozen=True):
    """Degrees, and metres over the sea (the site's base counts, as its file has it)."""

    latitude: float
    longitude: float
    altitude: float


class Mex(Struct, frozen=True, kw_only=True):
    """A mobile executor: a machine or a person."""

    status: str
    """STANDBY, ASSIGNED or EXECUTING ACTION; of this engine besides PARKED_AWAY and QUARANTINED, which are not free either."""
    battery: float | None
    """Percent, 0..100."""
    pose: PoseStamped | None
    gps: NavSatFix | None
    id: str
    task_id: str
    type: str
    action_name: str
    initial_deployment: Pose | None
    available: bool
    """Not of the paper: it stands by, is heard of, and nothing keeps the engine from giving it to a task."""


def mex_of(state: EngineState, frame: Frame, only: str = "") -> tuple[Mex, ...]:
    """Return all agents, machines first, each by name; `only`: this one."""
    asked: dict[str, str] = {}
    for task in state.tasks.values():
        if task.section not in ("", "done"):
            asked.update({agent: task.id for agents in task.agents.roles.values() for agent in agents})
    agents = [state.agents[only]] if only else sorted(state.agents.values(), key=listing)
    return tuple(_mex(state, agent, frame, asked) for agent in agents)


def _mex(state: EngineState, agent: AgentRecord, frame: Frame, asked: dict[str, str]) -> Mex:
    task = agent.task or (asked.get(agent.id, "") if agent.shared else "")
    status = "ASSIGNED" if task and agent.pool == "STANDBY" else agent.pool
    keeps = agent.taken or agent.refused or agent.out or agent.id in state.orders or agent.control != "engine"
    at = agent.position
    gps = None
    if at is not None:
        lat, lng = frame.lat_lng(at)
        gps = NavSatFix(round(lat, 7), round(lng, 7), round(frame.ground_msl_m + at.up_m, 3))
    return Mex(
        status=status,
        battery=agent.battery,
        pose=PoseStamped(Pose(_xyz(at), _looks(agent.heading_deg)), agent.said_at) if at is not None else None,
        gps=gps,
        id=agent.id,
        task_id=task or NO_TASK,
        type=agent.type,
        action_name=agent.action,
        initial_deployment=Pose(_xyz(agent.initial)) if agent.initial is not None else None,
        available=agent.pool == "STANDBY" and agent.liveness == "ALIVE" and not keeps,
    )


def _xyz(at: Position | Place) -> Xyz:
    return Xyz(at.east_m, at.north_m, at.up_m if isinstance(at, Position) else 0.0)


def _looks(heading_deg: float | None) -> Quaternion:
    """Return the direction of a heading (clockwise from north) as a turn about the vertical, from east."""
    if heading_deg is None:
        return Quaternion()
    half = math.radians(90.0 - heading_deg) / 2.0
    return Quaternion(z=round(math.sin(half), 9), w=round(math.cos(half), 9))
