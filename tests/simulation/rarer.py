"""Plays the rarer faults of `more`: goals that fail or hang, machines that are carried, a second engine, words of people."""

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from agents_sim.drone import Drone
from formiga_bt.base.clock import SECOND, Micros
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.safety.approval import approval_digest
from formiga_bt.transport.messages import ClockBeat, GoalRequest
from tests.simulation.more import APPROVER, PILOTS
from tests.simulation.plan import Deed

if TYPE_CHECKING:
    from tests.simulation.world import World

HANG_S: Final = 0.3
SPACE_M: Final = 3.0
BESIDE: Final = (Place(14.2, 14.2), Place(16.0, 26.0))
"""Where people put a machine of the yard down: on no lane, with the no-go region in the straight way to one."""
CARRIED_APART_M: Final = 6.0


class Rarer:
    """What a world does to its agents beside what `SimFleet` can."""

    def __init__(self, world: "World") -> None:
        self.world = world
        self.rival: int = 0
        """Epoch of the other engine, while there is one."""
        self._hangs: Counter[str] = Counter()
        self._hang_s: dict[str, float] = {}
        self._spoils: Counter[str] = Counter()

    def watch(self, agent: str) -> None:
        """Stand between a machine's process and its body."""
        front = self.world.sim[agent].front
        start: Callable[[GoalRequest], str] = front.start
        cancel: Callable[[str], bool] = front.cancel

        def begin(request: GoalRequest) -> str:
            code = start(request)
            if not code and self._hangs[agent] > 0:
                self._hangs[agent] -= 1
                self._body(agent).stop()
                self._fail_later(agent, request.goal_id, self._hang_s[agent])
            return code

        def stop(goal_id: str) -> bool:
            body = self._body(agent)
            if self._spoils[agent] <= 0:
                return cancel(goal_id)
            self._spoils[agent] -= 1
            before, body.confirms_cancel = body.confirms_cancel, False
            done = cancel(goal_id)
            body.confirms_cancel = before
            if done:
                self._fail_later(agent, goal_id, HANG_S)
            return done

        front.start, front.cancel = begin, stop  # type: ignore[method-assign]

    def do(self, deed: Deed) -> None:
        """Let one of these things happen."""
        who, world = deed.whom, self.world
        match deed.what:
            case "fail":
                self.fail(who)
            case "hang":
                self._hangs[who] += deed.count
                self._hang_s[who] = deed.much
            case "spoil":
                self._spoils[who] += deed.count
            case "carry":
                self.carry(who, deed.how or who)
            case "beside":
                self.put_beside(who, BESIDE[int(deed.much)])
            case "duty":
                world.order(inp.Duty(who, deed.how == "on", APPROVER))
            case "approve" | "revoke":
                self.approve(who, revoke=deed.what == "revoke")
            case "rival" if not self.rival and world.alive:
                self.rival = world.engine.state.epoch + 1
                self._beat()
            case "rival_off" if self.rival and world.alive:
                world.die_now()

    def mend(self) -> None:
        """End all of it."""
        self._hangs.clear()
        self._spoils.clear()
        for agent in self.world.machines:
            self.carry(agent, agent)

    # -- goals ---------------------------------------------------------------------------------------------------------
    def _body(self, agent: str) -> Any:
        return self.world.sim[agent].body

    def fail(self, agent: str) -> None:
        """All that an agent (`?`: a person who is asked something) does now fails."""
        if agent == "?":
            people = [one for name, one in self.world.sim.agents.items() if name not in self.world.machines]
            asked = [one.spec.id for one in people if one.side is not None and one.side.active]
            if not asked:
                return
            agent = asked[0]
        side = self.world.sim[agent].side
        goals = [] if side is None else [request.goal_id for request in side.active]
        if side is not None and goals:
            self._body(agent).stop()
            self._body(agent).set_status()  # its news tell where it stopped
            for goal_id in goals:
                side.finish(goal_id, "failed", code="broken")

    def _fail_later(self, agent: str, goal_id: str, after_s: float) -> None:
        world = self.world

        def fail() -> None:
            side = world.sim[agent].side
            if side is not None:
                self._body(agent).set_status()
                side.finish(goal_id, "failed", code="broken")

        world.scheduler.call_at(world.now + round(after_s * SECOND) + 1, fail)

    # -- people --------------------------------------------------------------------------------------------------------
    def carry(self, agent: str, to: str) -> None:
        """Somebody carries a machine that stands (`?`: any) to a free port: its own, or another's (`?`: of one that flies)."""
        world = self.world
        flies = {name: drone.is_airborne for name, drone in world.machines.items()}
        agent = next((name for name in flies if not flies[name]), "") if agent == "?" else agent
        to = next((name for name in reversed(flies) if flies[name]), "") if to == "?" else to
        if not agent or not to:
            return
        body, site = self._body(agent), world.plan.site
        if not isinstance(body, Drone):
            return
        port = site.ports[site.agents[to].home].at
        here: Position = body.position()
        if body.is_airborne or horizontal_m(here, port) < SPACE_M:
            return
        if any(horizontal_m(drone.position(), port) < SPACE_M for drone in world.machines.values()):
            return
        body.carry(port)

    def put_beside(self, agent: str, spot: Place) -> None:
        """Somebody puts a machine that stands, and that nobody sends anywhere, beside the lanes."""
        world, body, record = self.world, self._body(agent), self.world.engine.state.agents.get(agent)
        if record is None or record.task or record.goal or body._flight is not None:
            return
        others = [one.position() for name, one in world.machines.items() if name != agent]
        if all(horizontal_m(at, spot) > CARRIED_APART_M for at in others):
            body.carry(spot)

    def approve(self, task: str, *, revoke: bool = False) -> None:
        """An approver's word on a task."""
        model = self.world.engine.core.models[self.world.name_of(task)]
        digest = approval_digest(model, self.world.plan.site)
        self.world.order(inp.Approve(digest, model.name, APPROVER, revoke))

    def let_fly(self) -> None:
        """On a site in mode real: all pilots are on duty, all tasks are approved."""
        if self.world.plan.real and self.world.alive:
            for pilot in PILOTS:
                self.world.order(inp.Duty(pilot, True, APPROVER))
            for task in self.world.names:
                self.approve(task)

    # -- another engine --------------------------------------------------------------------------------------------------
    def _beat(self) -> None:
        """The other engine's clock, each second until this one was started again."""
        world = self.world
        now: Micros = world.now
        if not self.rival:
            return
        beat = ClockBeat(wall_us=now, engine_us=now, speed=1.0, epoch=self.rival, beat=now // SECOND)
        for agent in world.sim.agents.values():
            if agent.side is not None and not world.hub.is_frozen(agent.spec.id):
                agent.side.on_clock(beat)
        world.scheduler.call_at(now + SECOND, self._beat)
