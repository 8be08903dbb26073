"""States of a task and of its machine, and how a run is brought into each; orders that are then given twice.

python -m tests.safety.states "cruising" "hold the machine"        one case with its story
"""

import sys
from collections.abc import Callable

from msgspec.structs import replace

from agents_sim.world import AgentSpec
from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place, Position
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.lang.model import SiteAgent
from formiga_bt.rehearsal.testing import packaged_world
from tests.safety.runs import PERSON, Run
from tests.safety.scenes import Request, Scene

FIELD = Place(20.0, 180.0)
OVER = Position(-20.0, -60.0, 40.0)
DRONE, TASK = "hwd_1", "Linger-1"


def scene(at: Place | Position | None = None, script: tuple[dict[str, object], ...] = ()) -> Scene:
    """One heavy drone, which the task needs, a light one, and a watcher."""
    site, _ = packaged_world()
    ports = {"hwd_1": "p5", "lwd_1": "p1"}
    agents = {name: SiteAgent(name, name[:3], port) for name, port in ports.items()}
    agents[PERSON] = SiteAgent(PERSON, "watcher")
    specs = [
        AgentSpec(id=name, type=name[:3], at=site.ports[port].at, home=site.ports[port].at, kind="drone", cut=True)
        for name, port in ports.items()
    ]
    if at is not None:
        specs[0] = AgentSpec(id=DRONE, type="hwd", at=at, home=specs[0].home, kind="drone", cut=True)
    person = AgentSpec(id=PERSON, type="watcher", at=Place(40.0, -60.0), script=script, kind="person")
    return Scene(0, replace(site, agents=agents), (*specs, person), (), (), 0.0)


class Case(Run):
    """A run that is brought into a state by hand."""

    abort_after_s = 45.0
    tells = False
    """Whether cases keep their stories."""

    def __init__(self, played: Scene) -> None:
        super().__init__(played, story=self.tells)

    def until(self, what: Callable[[], bool], limit_s: float = 600.0) -> None:
        assert self.world.run_until(what, limit_s), "the state is never reached"

    def begin(self) -> "Case":
        self.world.run_for(1)
        self.submit(Request(0.0, "Linger", {"to": FIELD}))
        return self

    def wait(self, seconds: float) -> "Case":
        self.world.run_for(seconds)
        return self

    @property
    def goal(self) -> object:
        state = self.world.engine.state
        return state.goals.get(state.agents[DRONE].goal)

    def flies(self, action: str, state: str = "running", phase: str = "") -> "Case":
        def so() -> bool:
            agent = self.world.engine.state.agents[DRONE]
            goal = self.world.engine.state.goals.get(agent.goal)
            return goal is not None and (goal.action, goal.state) == (action, state) and goal.phase.startswith(phase)

        self.until(so)
        return self

    def gated(self, code: str) -> "Case":
        self.until(lambda: any(g.code == code and g.state == "gated" for g in self.world.engine.state.goals.values()))
        return self

    def section(self, name: str) -> "Case":
        self.until(lambda: self.world.task(TASK).section == name)
        return self

    def given(self, given: inp.Input) -> "Case":
        assert self.order(given), given
        return self

    def cruises(self) -> "Case":
        """In the middle of the long leg to the field."""
        drone = self.world.sim[DRONE].drone
        self.begin()
        self.until(lambda: drone.state().kind == "cruise" and drone.position().north_m > 80.0)
        return self

    def hovers(self) -> "Case":
        """Over the field, in the `wait`."""
        self.begin()
        self.until(lambda: self.world.engine.state.agents[DRONE].goal == "" and self._is_there())
        return self.wait(2)

    def _is_there(self) -> bool:
        drone = self.world.sim[DRONE].drone
        return drone.state().kind == "hover" and drone.position().north_m > 175.0 and drone.position().up_m < 55.0

    def stands(self) -> "Case":
        """On the field, away from its port."""
        self.hovers()
        self.until(lambda: self.world.engine.state.agents[DRONE].landed == "grounded")
        return self.wait(2)


def hold(target: str = DRONE) -> inp.Operator:
    return inp.Operator("hold", target, PERSON)


def aborted(case: Case) -> Case:
    return case.given(inp.Abort(TASK, "", PERSON))


def piloted(case: Case) -> Case:
    case.piloted.add(DRONE)
    case.world.sim.take_over(DRONE)
    return case.wait(1)


def frozen(case: Case) -> Case:
    case.frozen.add(DRONE)
    case.world.sim.freeze(DRONE)
    return case


def muted(case: Case) -> Case:
    case.world.sim.never_confirm_cancel(DRONE)
    return case


NEVER = ({"never": True},)
LATE = ({"match": "clear", "options": ["clear"], "after": "8 s"},)
SILENT = ({"match": "start here", "never": True}, {"match": "go on", "options": ["no"]})
"""Lets the task go on after the landing, and says nothing about its start."""

STATES: dict[str, Callable[[], Case]] = {
    "idle at the port": lambda: Case(scene()).wait(1),
    "idle away from the port": lambda: Case(scene(at=Place(-20.0, -60.0))).wait(1),
    "joined in the air": lambda: Case(scene(at=OVER)).wait(1),
    "joined in the air, unsure": lambda: unsure(Case(scene(at=OVER))).wait(1),
    "just asked for": lambda: Case(scene()).begin(),
    "task pending": lambda: Case(scene(at=Place(-20.0, -60.0))).begin().wait(1),
    "goal sent": lambda: Case(scene()).begin().flies("TakeOff", "sent"),
    "goal accepted": lambda: Case(scene()).begin().flies("TakeOff", "accepted"),
    "climbing": lambda: Case(scene()).begin().flies("TakeOff").wait(6),
    "cruising": lambda: Case(scene()).cruises(),
    "hovering in a wait": lambda: Case(scene()).hovers(),
    "question open": lambda: Case(scene(script=NEVER)).hovers().wait(25),
    "gated for clearance in the air": lambda: Case(scene(script=NEVER)).hovers().gated("clearance"),
    "descending": lambda: Case(scene()).begin().flies("LandIn", "running", "descending").wait(2),
    "last metres of a landing": lambda: Case(scene()).begin().flies("LandIn", "running", "descending").wait(16),
    "standing away from the port": lambda: Case(scene()).stands(),
    "gated for clearance on the ground": lambda: Case(scene(script=SILENT)).stands().gated("clearance"),
    "canceling": lambda: aborted(muted(Case(scene()).cruises())).flies("GoTo", "canceling"),
    "in on_abort": lambda: aborted(Case(scene()).cruises()).section("on_abort").wait(2),
    "goal of on_abort": lambda: aborted(Case(scene()).cruises()).section("on_abort").flies("GoTo"),
    "in finally": lambda: aborted(Case(scene()).cruises()).section("finally").wait(2),
    "in recover": lambda: aborted(Case(scene()).cruises()).section("recover").wait(4),
    "landing at home in recover": lambda: aborted(Case(scene()).cruises()).section("recover").flies("LandIn").wait(3),
    "held by hold": lambda: Case(scene()).cruises().given(hold()).wait(2),
    "held by hold of the task": lambda: Case(scene()).cruises().given(hold(TASK)).wait(2),
    "hold not confirmed yet": lambda: muted(Case(scene()).cruises()).given(hold()).wait(1),
    "returning on order": lambda: Case(scene()).cruises().given(inp.Operator("return", DRONE, PERSON)).wait(5),
    "returned on order": lambda: Case(scene()).cruises().given(inp.Operator("return", DRONE, PERSON)).wait(120),
    "landing on order": lambda: Case(scene()).cruises().given(inp.Operator("land", DRONE, PERSON)).wait(5),
    "landed on order": lambda: Case(scene()).cruises().given(inp.Operator("land", DRONE, PERSON)).wait(60),
    "motors cut": lambda: Case(scene()).stands().given(inp.Operator("cut", DRONE, PERSON)).wait(5),
    "locked down, holding": lambda: Case(scene()).cruises().given(inp.LockdownOrder("hold", PERSON)).wait(3),
    "locked down, returning": lambda: Case(scene()).cruises().given(inp.LockdownOrder("return", PERSON)).wait(3),
    "locked down, landing": lambda: Case(scene()).cruises().given(inp.LockdownOrder("land", PERSON)).wait(3),
    "locked down in recover": lambda: aborted(Case(scene()).cruises()).section("recover").wait(4).given(
        inp.LockdownOrder("hold", PERSON)
    ).wait(2),
    "under its pilot": lambda: piloted(Case(scene()).cruises()),
    "pilot gave back, nobody handed back": lambda: given_back(piloted(Case(scene()).cruises())),
    "under its pilot in recover": lambda: piloted(aborted(Case(scene()).cruises()).section("recover").wait(4)),
    "under its failsafe": lambda: failsafe(Case(scene()).cruises()),
    "suspect": lambda: frozen(Case(scene()).cruises()).wait(8),
    "lost": lambda: frozen(Case(scene()).cruises()).wait(50),
    "quarantined in the air": lambda: Case(scene()).cruises().given(inp.Abort(TASK, "abandon", PERSON)).wait(3),
    "quarantined on the ground": lambda: Case(scene()).stands().given(inp.Abort(TASK, "abandon", PERSON)).wait(3),
    "brought home from quarantine": lambda: Case(scene()).cruises().given(inp.Abort(TASK, "abandon", PERSON)).wait(3).given(
        inp.Operator("clear", DRONE, PERSON)
    ).wait(6),
    "started anew before it was fetched": lambda: anew(
        Case(scene(at=Place(-20.0, -60.0), script=LATE)).wait(1).given(inp.Operator("return", DRONE, PERSON)).wait(2)
    ),
    "restarting": lambda: Case(scene()).cruises().given(inp.Operator("restart", TASK, PERSON)).wait(3),
    "breached": lambda: low(Case(scene()).cruises()).wait(3),
}  # fmt: skip
"""How to bring a fresh run into each state."""


def unsure(case: Case) -> Case:
    case.world.sim[DRONE].drone.is_unsure = True
    return case


def anew(case: Case) -> Case:
    case.world.sim.kill(DRONE)
    case.wait(2).world.sim.restart(DRONE)
    return case.wait(1)


def given_back(case: Case) -> Case:
    case.piloted.discard(DRONE)
    case.world.sim.hand_back(DRONE)
    return case.wait(2)


def failsafe(case: Case) -> Case:
    case.monitor.disturbed.add(DRONE)
    case.world.sim[DRONE].drone.set_battery(4.0)
    return case.wait(2)


def low(case: Case) -> Case:
    case.monitor.disturbed.add(DRONE)
    case.world.sim[DRONE].drone.set_battery(22.0)
    return case


AGENT_ORDERS = (
    "hold",
    "return",
    "land",
    "cut",
    "continue",
    "handback_continue",
    "handback_return",
    "handback_end",
    "clear",
    "removed",
)
TASK_ORDERS = ("hold", "return", "land", "continue", "restart")

ORDERS: dict[str, inp.Input] = {
    **{f"{order} the machine": inp.Operator(order, DRONE, PERSON) for order in AGENT_ORDERS},  # type: ignore[arg-type]
    **{f"{order} the task": inp.Operator(order, TASK, PERSON) for order in TASK_ORDERS},  # type: ignore[arg-type]
    **{f"{order} all": inp.Operator(order, "", PERSON) for order in ("hold", "return", "land", "continue")},  # type: ignore[arg-type]
    **{f"lockdown {how}": inp.LockdownOrder(how, PERSON) for how in ("hold", "return", "land", "release")},  # type: ignore[arg-type]
    **{f"abort {how}".strip(): inp.Abort(TASK, how, PERSON) for how in ("", "now", "abandon")},  # type: ignore[arg-type]
    "assign the machine": inp.Assign(TASK, DRONE, by=PERSON),
    "unassign the machine": inp.Unassign(DRONE, PERSON),
    "take the machine out of service": inp.InService(DRONE, "rotor", PERSON),
    "prioritize the task": inp.Prioritize(TASK, "high", first=True, by=PERSON),
}  # fmt: skip
LATER_S = 25.0
"""From the order to the calm, in which it is lifted 40 s later: words of people are old by then."""
SAME_AGAIN = ("hold", "return", "land", "lockdown")
"""Orders that change nothing when they are given a second time at once."""


def reply_of(case: Case, given: inp.Input) -> object:
    try:
        return case.ask(given)
    except TaskError as error:
        return error.code


def give(state: str, order: str) -> list[str]:
    """Give an order twice in a state, then calm everything; return what went wrong."""
    wrong, case = play(state, order)
    return wrong + [str(v) for v in case.monitor.violations]


def play(state: str, order: str) -> tuple[list[str], Case]:
    """Play a case; return what went wrong besides the monitor's violations, and the run."""
    case = STATES[state]()
    given = ORDERS[order]
    wrong: list[str] = []
    try:
        first = reply_of(case, given)
        count = len(case.world.steps)
        second = reply_of(case, given)
        again = next(step for step in case.world.steps[count:] if step.input is given)
        if order.split()[0] in SAME_AGAIN and (first != second or again.changes or again.effects):
            wrong.append(f"the same order again: {first}, then {second} {again.changes} {again.effects}")
        case.world.run_for(LATER_S)
        case.calm()
    except Exception as error:  # noqa: BLE001  (any exception is what is looked for)
        wrong.append(f"{type(error).__name__}: {error}")
    finally:
        case.world.close()
    return wrong, case


def main() -> int:
    """Play one case from the command line."""
    Case.tells = True
    wrong, case = play(sys.argv[1], sys.argv[2])
    print(*case.lines, *wrong, *case.monitor.violations, sep="\n")
    return bool(wrong or case.monitor.violations)


if __name__ == "__main__":
    sys.exit(main())
