"""`with_agents`: steps with agents of their own, granted when the block is entered and given back at its end.

It waits for the allocator, runs its steps, then releases: each machine is brought home if it is in the air, as `release` does,
before the block ends. One that is stopped releases too; the machines on their way home join the drain of whoever stopped it.

Two things stop its steps from within: the loss of a machine whose role says `fail_block`, and a machine that comes to the
charge of its `hand_over_at`. Once all are given back the block fails after the first, and begins anew after the second.
"""

from collections.abc import Sequence
from typing import ClassVar

from py_trees.common import Status

from formiga_bt.lang import model
from formiga_bt.lang.types import AgentRef
from formiga_bt.nodes import draining
from formiga_bt.nodes.base import FAILURE, RUNNING, SUCCESS, Node
from formiga_bt.nodes.composites import Chain, adopt_children
from formiga_bt.nodes.decorators import RetryNode
from formiga_bt.nodes.ends import AgentReleased, Drain, End
from formiga_bt.nodes.memory import Mem, WithMem
from formiga_bt.nodes.run import AgentsRun, Failure, Run


class WithAgentsNode(Chain):
    """`with_agents`: extra agents for a block."""

    watches: ClassVar[bool] = True
    times: ClassVar[bool] = True
    kind: ClassVar[str] = "with_agents"

    def __init__(self, step: model.WithAgents, children: Sequence[Node]) -> None:
        Node.__init__(self, step.title, step)
        self.step = step
        self.mem = WithMem()
        adopt_children(self, children)

    def memo(self) -> Mem:
        """Return the memory."""
        return WithMem("runs", self.mem.agents, self.index, self.ran, low=self.mem.low, turn=self.mem.turn)

    def place(self, index: int) -> str:
        """Return the instance path of a step; of later turns with their number."""
        turn = f".turn#{self.mem.turn}" if self.mem.turn else ""
        return f"{self.path}{turn}.{self.body()[index].seg}"

    def on_enter(self, run: Run) -> Status:
        """Ask for the agents."""
        return self._ask(run, 0)

    def _ask(self, run: Run, turn: int) -> Status:
        self._keep(run, WithMem(turn=turn))
        without = tuple(dict.fromkeys(agent for retry in self._retries() for agent in retry.mem.failed))
        until = run.want_agents(self.key, self.step.roles, run.env(self.scope, self.error_here()), without)
        run.set_deadline(self.key, until)
        self.feedback_message = "waits for agents"
        return RUNNING

    def on_proceed(self, run: Run) -> Status:
        """Take the agents, visit the steps, or look who is still on the way home."""
        if self.mem.state == "waits":
            return self._await(run)
        if self.mem.state == "releases":
            return self._released(run)
        if (gone := self._gone(run)) is not None:
            return self._stop(run, gone)
        if self._is_low(run):
            return self._stop(run, None)
        return self._ended(run, super().on_proceed(run))

    def is_quiet(self, run: Run) -> bool:
        """Return whether its steps go on with the agents that they have."""
        return self.mem.state == "runs" and self._gone(run) is None and not self._is_low(run)

    def _await(self, run: Run) -> Status:
        served = run.take_agents(self.key)
        if served is None:
            if not run.is_due(self.key):
                return RUNNING
            run.withdraw_agents(self.key)
            return self.fail("no_agent", "no fitting agents in time; see the explanation")
        run.clear_deadline(self.key)
        if served.reason:
            return self.fail("no_agent", served.reason, retryable=False)
        env = run.env(self.scope, self.error_here())
        late = {name: float(role.hand_over_at.run(env)) for name, role in self.step.roles.items() if role.hand_over_at}
        low = {agent: late[name] for name in late for agent in served.roles[name]}
        self._keep(run, WithMem("runs", served.roles, low=low, turn=self.mem.turn))
        self._watch(run)
        for name, role in self.step.roles.items():
            refs = tuple(AgentRef(agent) for agent in served.roles[name])
            run.set_var(self.scope, name, refs if role.is_list else refs[0])
        for retry in self._retries():
            retry.note_agents(run, self._agents())
        return self._ended(run, self.start_chain(run))

    def _ended(self, run: Run, status: Status) -> Status:
        """Give the agents back once the steps have ended."""
        if status is RUNNING:
            return RUNNING
        decided = WithMem("releases", self.mem.agents, 0, self.ran, self.failure, self.skipped, self.breaking)
        self._keep(run, decided)
        self._unset(run)
        self._give_back(run)
        self.failure, self.skipped, self.breaking = None, False, False
        self.feedback_message = "gives its agents back"
        return self._released(run)

    def _stop(self, run: Run, failure: Failure | None) -> Status:
        """Stop the steps from within, and give the agents back; then fail, or (without a failure) begin anew."""
        drain = draining.adopt(run, self.key, super().on_halt(run))
        run.unwatch(self.key)
        self._unset(run)
        mem = WithMem(
            "releases", self.mem.agents, failure=failure, drain=drain, anew=failure is None, turn=self.mem.turn
        )
        self._keep(run, mem)
        self._give_back(run, drain)
        self.feedback_message = "hands over" if failure is None else "gives its agents back"
        return self._released(run)

    def _give_back(self, run: AgentsRun, after: Drain = ()) -> tuple[str, ...]:
        """Release who is still held, once `after` has ended; return them."""
        held = tuple(agent for agent in self._agents() if not run.is_released(agent))
        for agent in held:
            run.release(agent, self.key, after)
        return held

    def _released(self, run: Run) -> Status:
        mem = self.mem
        if not draining.is_empty(run, mem.drain) or not all(run.is_released(agent) for agent in self._agents()):
            return RUNNING
        unconfirmed = draining.unconfirmed(run, mem.drain, self.path)
        draining.drop(run, mem.drain)
        if unconfirmed is not None:
            return self.fail_as(unconfirmed)
        if mem.anew:
            for retry in self._retries():
                retry.clear_agents(run, self._agents())
            self.unset(run, self.step.fresh)
            return self._ask(run, mem.turn + 1)
        self.failure, self.skipped, self.breaking = self.mem.failure, self.mem.skipped, self.mem.breaking
        return SUCCESS if self.failure is None else FAILURE

    def on_halt(self, run: Run) -> list[End]:
        """Stop the steps and give the agents back; whoever stops us waits for both."""
        drained: list[End] = []
        if self.mem.state == "waits":
            granted = run.withdraw_agents(self.key)
            for agent in granted:
                run.release(agent, self.key)
            return [AgentReleased(agent) for agent in granted]
        if self.mem.state == "runs":
            drained = super().on_halt(run)
            self._unset(run)
        else:
            drained = draining.move_on(run, self.mem.drain)
        return [*drained, *(AgentReleased(agent) for agent in self._give_back(run, tuple(drained)))]

    def on_restore(self, run: Run, mem: Mem) -> None:
        """Go on where it was."""
        assert isinstance(mem, WithMem)
        self.mem = mem
        if mem.state == "runs":
            self.restore_chain(run, mem.index, ran=mem.ran)
            self._watch(run)

    # -- parts ---------------------------------------------------------------------------------------------------------
    def _keep(self, run: AgentsRun, mem: WithMem) -> None:
        self.mem = mem
        self.remember(run, mem)

    def _watch(self, run: Run) -> None:
        """Be woken by what may stop the block from within."""
        fields = [(agent, "pool") for agent in self._must_stay()]
        fields += [(agent, field) for agent in self.mem.low for field in ("battery", "landed")]
        if fields:
            run.watch_agents(self.key, fields)

    def _must_stay(self) -> tuple[str, ...]:
        """Return the agents whose loss is the block's failure."""
        names = [name for name, role in self.step.roles.items() if role.if_lost == "fail_block"]
        return tuple(dict.fromkeys(agent for name in names for agent in self.mem.agents[name]))

    def _gone(self, run: AgentsRun) -> Failure | None:
        for agent in self._must_stay():
            if why := run.why_gone(agent):  # of one that may still be at it nobody begins anew
                reason = f"{agent} was lost" if why == "lost" else f"{agent} is quarantined: {why}"
                return Failure("agent_lost", reason, self.path, agent, retryable=False, by_another=why == "lost")
        return None

    def _is_low(self, run: AgentsRun) -> bool:
        return any(run.is_low(agent, percent) for agent, percent in self.mem.low.items())

    def _agents(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(agent for group in self.mem.agents.values() for agent in group))

    def _unset(self, run: AgentsRun) -> None:
        for name in self.step.roles:
            run.set_var(self.scope, name, None)

    def _retries(self) -> list[RetryNode]:
        """Return the retries around this block that want another agent each time."""
        found: list[RetryNode] = []
        node = self.parent
        while node is not None:
            if isinstance(node, RetryNode) and node.takes_another:
                found.append(node)
            node = node.parent
        return found
