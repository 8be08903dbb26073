"""Clearance: a person's word that people stand clear of a start or landing away from ports.

The engine asks by itself when the machine is there: first the people of the task's own questions, then the site's watchers.
`clear` lets the goal go within 60 s and 5 m of the spot asked about, unless the machine is started anew, moved, lands or
takes off meanwhile: then the word, or the question for it, is over. `wait` asks again after 30 s; `refuse`, or no word
within 5 min, ends it: a machine on the ground stays there and its task ends `no_clearance`; one in the air keeps asking until
its reserve and 3 min are near, then its step fails and it recovers. An `ask` with `clears` gives the same word, for the spot
where the machine stands or hovers.
"""

from collections.abc import Iterable

from formiga_bt.base.clock import SECOND, micros
from formiga_bt.base.energy import CALM, hover_pct
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.engine.goals.people import People
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.causes import ClearanceHold
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.holds import hold, unhold
from formiga_bt.engine.kernel.inputs import Alarm
from formiga_bt.engine.kernel.news import ClearanceDenied
from formiga_bt.engine.kernel.records import AgentRecord, ClearanceRecord, GoalRecord, Question
from formiga_bt.engine.kernel.timers import ClearanceAgain, ClearanceDue
from formiga_bt.lang import model
from formiga_bt.lang.walk import children
from formiga_bt.nodes.run import AskOrder
from formiga_bt.safety.charge import way_home
from formiga_bt.safety.gate import CLEARANCE_LIFE_US, CLEARED_M, is_cleared
from formiga_bt.transport.messages import Clearance

ANSWER_US = 300 * SECOND
AGAIN_US = 30 * SECOND
ESCALATE_US = 60 * SECOND
MARGIN_S = 180.0
STRAYED_M = 15.0
"""One that hovers, and is this far from where it was asked about, is elsewhere: wind moves it less."""
LONGEST_S = 86_400.0
"""What hardly drains waits no longer than that, either."""
OPTIONS = ("clear", "wait", "refuse")


class Clearances:
    """All clearances; at most one under way for each machine."""

    def __init__(self, core: Core, people: People) -> None:
        self._core = core
        self._people = people

    # -- for the gate ---------------------------------------------------------------------------------------------
    def given(self, agent_id: str) -> Clearance | None:
        """Return the word that stands for a machine, however old."""
        record = self._core.state.clearances.get(agent_id)
        if record is None or record.state != "given" or record.given_at is None:
            return None
        return Clearance(record.by, record.given_at)

    def place(self, agent_id: str) -> Place | None:
        """Return the spot that the word is, or is asked, for."""
        record = self._core.state.clearances.get(agent_id)
        return record.place if record is not None else None

    def take(self, goal: GoalRecord) -> Clearance | None:
        """Return the word that goes along with a goal that leaves now, and use it up."""
        spec = self._core.action(goal.action)
        if not (spec.starts_rotors or spec.lands):
            return None
        clearance, place = self.given(goal.agent), self.place(goal.agent)
        if clearance is not None:
            self._end(self._core.state.clearances[goal.agent])
        self.withdraw(goal)  # it goes without the word that it waited for: the machine was carried to a port meanwhile
        return clearance if is_cleared(clearance, place, self._spot(goal), self._core.now) else None

    def _spot(self, goal: GoalRecord) -> Place | None:
        """Return where a goal starts rotors or lands: what the word must be for."""
        core = self._core
        spec = core.action(goal.action)
        target = goal.fields.get(spec.moves_to) if spec.lands else core.state.agents[goal.agent].position
        return target.ground if isinstance(target, Position) else target

    def need(self, goal: GoalRecord) -> None:
        """A goal waits for the word: ask for it, unless it is being asked for."""
        core = self._core
        record = core.state.clearances.get(goal.agent)
        spot = self._spot(goal)
        if record is not None and record.state in ("asked", "waiting"):
            if record.goal == goal.id and _near(record.place, spot):
                return
            self._end(record)  # of another goal, or it has moved meanwhile: the word would be for another spot
        agent = core.state.agents[goal.agent]
        core.emit(
            ch.ClearancePut(
                goal.agent,
                ClearanceRecord(
                    agent=goal.agent, task=goal.task, goal=goal.id, n=0, state="asked", opened_at=core.now, place=spot,
                    here=_ground(agent), landed=agent.landed,
                ),
            )
        )  # fmt: skip
        hold(core, goal.task, ClearanceHold(goal.agent))
        core.set_deadline(ClearanceDue(goal.agent), core.now + self.patience_us(core.state.agents[goal.agent]))
        self._ask(goal.agent)

    def patience_us(self, agent: AgentRecord) -> int:
        """Return how long a machine may wait where it is: 5 min on the ground, until reserve and 3 min in the air."""
        if agent.landed == "grounded":
            return ANSWER_US
        core = self._core
        power = core.power(agent)
        if power is None or agent.battery is None:
            return ANSWER_US
        home, charge = core.site.ports.get(agent.home), agent.battery
        if agent.position is not None:
            wind, load = agent.wind or CALM, agent.payload_kg
            place = home.at if home is not None else None
            charge -= way_home(place, agent.layer_m, power, wind, load, core.airspace)(agent.position, False)
        left_s = (charge - core.rules(agent, agent.task).reserve_pct) / hover_pct(1.0, power, agent.payload_kg)
        return micros(max(0.0, min(left_s - MARGIN_S, LONGEST_S)))

    def _ask(self, agent_id: str) -> None:
        core = self._core
        record = core.state.clearances[agent_id]
        number = core.count("clearance")
        core.emit(ch.ClearancePut(agent_id, _with(record, n=number, state="asked")))
        goal = core.state.goals[record.goal]
        patience = core.state.deadlines[ClearanceDue(agent_id)]
        verb = "start here" if core.action(goal.action).starts_rotors else "land here"
        first = self._task_people(record.task)
        watchers = tuple(p for p in self._people.of_role("watchers") if p not in first)
        tiers = tuple(tier for tier in (first, watchers) if tier)
        if not tiers:
            core.effect(
                Alarm("nobody_to_ask", f"nobody can say that people stand clear of {agent_id}", record.task, agent_id)
            )
        self._people.open(
            record.task,
            AskOrder(
                id=f"clear/{agent_id}/{number}",
                text=f"{agent_id} is about to {verb}: do people stand 15 m clear?",
                note="clear: go ahead within 60 s; wait: ask again in 30 s; refuse: do not",
                options=OPTIONS,
                tiers=tiers or ((),),
                policy="any",
                escalate_us=ESCALATE_US,
                expires_at=patience.at,
                if_no_answer=f"{agent_id} does not {verb}",
                clears="",
                clears_on=(),
                owner="",
            ),
            kind="clearance",
        )

    def _task_people(self, task_id: str) -> tuple[str, ...]:
        core = self._core
        task = core.state.tasks[task_id]
        found: dict[str, None] = {}
        model = core.library.of(task)
        if model is not None:
            for step in asks_of(model):
                for who in step.of:
                    ids = self._people.of_role(who.name) if who.site_role else task.agents.roles.get(who.name, ())
                    found.update(dict.fromkeys(ids))
        return tuple(found)

    # -- answers and time ----------------------------------------------------------------------------------------
    def on_answer(self, question: Question) -> None:
        """Take the answer to one of the engine's own questions."""
        core = self._core
        agent_id = question.id.split("/")[1]
        record = core.state.clearances.get(agent_id)
        assert question.reply is not None
        answer, by = question.reply["answer"], question.reply["by"]
        self._people.close(question.id)
        if record is None or record.state != "asked":
            return
        if answer == "clear":
            self._given(agent_id, by, record.place)
        elif answer == "wait":
            core.emit(ch.ClearancePut(agent_id, _with(record, state="waiting")))
            core.set_deadline(ClearanceAgain(agent_id), core.now + AGAIN_US)
        else:
            self._denied(record, f"{by} refused")

    def grant(self, agent_id: str, by: str) -> None:
        """A person said in a tree that people stand clear of this machine: of the spot where it stands, or hovers over."""
        self._given(agent_id, by, _ground(self._core.state.agents[agent_id]))

    def _given(self, agent_id: str, by: str, place: Place | None) -> None:
        core = self._core
        old = core.state.clearances.get(agent_id)
        agent = core.state.agents[agent_id]
        if old is not None:
            self._end(old)
        core.emit(
            ch.ClearancePut(
                agent_id,
                ClearanceRecord(
                    agent=agent_id, task=agent.task, goal="", n=0, state="given",
                    opened_at=core.now, by=by, given_at=core.now, place=place,
                    here=_ground(agent), landed=agent.landed,
                ),
            )
        )  # fmt: skip
        core.set_deadline(ClearanceDue(agent_id), core.now + CLEARANCE_LIFE_US)

    def on_deadline(self, due: ClearanceDue | ClearanceAgain) -> None:
        """Ask again after `wait`, or give up."""
        agent_id = due.agent
        record = self._core.state.clearances.get(agent_id)
        if record is None:
            return
        if record.state == "given":
            self._end(record)
        elif isinstance(due, ClearanceAgain):
            self._ask(agent_id)
        else:
            late = "" if self._core.state.agents[agent_id].landed == "grounded" else " before its reserve was near"
            self._denied(record, f"nobody said that people stand clear{late}")

    def _denied(self, record: ClearanceRecord, why: str) -> None:
        core = self._core
        self._end(record)
        agent = core.state.agents[record.agent]
        goal = core.state.goals.get(record.goal)
        if goal is None:
            return
        core.put_goal(goal.id, state="gate_refused", code="no_clearance", text=why)
        if agent.landed == "grounded":
            core.effect(Alarm("no_clearance", f"{agent.id} stays on the ground: {why}", record.task, agent.id))
            core.report(ClearanceDenied(record.task, why))
        core.wake(
            goal.task, goal.owner
        )  # in recover, which no failure of the task stops, or in the air: the step fails

    def withdraw(self, goal: GoalRecord) -> None:
        """The goal that waits for a word is gone."""
        record = self._core.state.clearances.get(goal.agent)
        if record is not None and record.goal == goal.id:
            self._end(record)

    # -- what the machine does meanwhile -------------------------------------------------------------------------
    def review(self, agent_id: str) -> None:
        """A machine has told how it is: a word, or a question for one, ends when what it is for is so no more.

        It has landed or taken off meanwhile, or is elsewhere: its pilot, its own failsafe, an order, or people moved it.
        """
        record = self._core.state.clearances.get(agent_id)
        if record is None:
            return
        agent = self._core.state.agents[agent_id]
        here = _ground(agent)
        limit_m = CLEARED_M if agent.landed == "grounded" else STRAYED_M
        moved = here is not None and record.here is not None and horizontal_m(here, record.here) > limit_m
        if moved or {record.landed, agent.landed} == {"grounded", "airborne"}:
            self._end(record)

    def forget(self, agent_id: str) -> None:
        """The process of a machine was started anew: no word for it counts any more, and none is asked for."""
        record = self._core.state.clearances.get(agent_id)
        if record is not None:
            self._end(record)

    def _end(self, record: ClearanceRecord) -> None:
        core = self._core
        self._people.close(f"clear/{record.agent}/{record.n}")
        core.clear_deadline(ClearanceDue(record.agent))
        core.clear_deadline(ClearanceAgain(record.agent))
        core.emit(ch.ClearancePut(record.agent, None))
        unhold(core, record.task, ClearanceHold(record.agent))


def _ground(agent: AgentRecord) -> Place | None:
    return agent.position.ground if agent.position is not None else None


def _near(a: Place | None, b: Place | None) -> bool:
    return a == b or (a is not None and b is not None and horizontal_m(a, b) <= CLEARED_M)


def _with(record: ClearanceRecord, **fields: object) -> ClearanceRecord:
    from msgspec.structs import replace

    return replace(record, **fields)


def asks_of(task: model.Task) -> list[model.Ask]:
    """Return every `ask` of a task, subtrees included, in file order."""
    found: list[model.Ask] = []

    def walk(steps: Iterable[model.Step]) -> None:
        for step in steps:
            if isinstance(step, model.Ask):
                found.append(step)
            walk(step.subtree.steps if isinstance(step, model.Call) else children(step))

    for section in (task.steps, task.on_failure, task.on_abort, task.finally_):
        walk(section)
    return found
