"""The seam for policies, and three: `closest_charged` and `optimal`, which sites name, and the paper's `closest`.

A policy sees all waiting requests (in order of service) and all agents at one instant, and returns grants and, for every
request, a verdict on every agent. All roles of a request are granted together or none.

`closest` (the paper's choose_closest_mex, section 3.3): highest priority first, then first come first served; each role gets
the nearest agent that fits; a role with several places gets the best one-to-one assignment. A role that takes as many as
there are is filled up after all roles have what they need.

`closest_charged` differs in one thing: nearness is weighed with the charge that the job leaves (`allocator.cost`).

`optimal` has the costs of that and serves the same requests in the same order, but gives all requests of one priority their
agents together, so that all costs together are least (`allocator.together`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple, Protocol

from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.cost import CostOf, far, far_and_low, in_words
from formiga_bt.engine.allocator.filters import refused_there
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.allocator.teams import Costs, Roles, assign, fill_up, roles_of, slots_of
from formiga_bt.engine.allocator.together import batches, share
from formiga_bt.engine.kernel.records import PRIORITIES, AgentRequest, Verdict


class Grant(Struct, frozen=True):
    """Agents for the roles of one task, in the order of the roles' places."""

    task: str
    roles: dict[str, tuple[str, ...]]


class Decision(Struct, frozen=True):
    """What a policy decided."""

    grants: tuple[Grant, ...]
    verdicts: dict[str, tuple[Verdict, ...]]


class Policy(Protocol):
    """Chooses agents for requests. Deterministic: equal inputs, equal decision."""

    def __call__(self, requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
        """Return the decision."""
        ...


def closest(requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
    """Grant the nearest fitting agents, request by request in the given order."""
    return _decide(requests, agents, far)


def closest_charged(requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
    """Grant the nearest fitting agents whose charge lasts, request by request in the given order."""
    return _decide(requests, agents, far_and_low)


def optimal(requests: Sequence[AgentRequest], agents: Sequence[Candidate]) -> Decision:
    """Grant so that the requests of one priority together have the nearest agents whose charge lasts."""
    return _decide(requests, agents, far_and_low, batches)


POLICIES: Final[Mapping[str, Policy]] = MappingProxyType({"closest": closest_charged, "optimal": optimal})
"""What a site file may name (`lang.site.keys`)."""

Batches = Callable[[Sequence[AgentRequest]], Iterable[Sequence[AgentRequest]]]
"""Requests in their order, those that are served together in one list."""


def one_by_one(requests: Sequence[AgentRequest]) -> Iterable[Sequence[AgentRequest]]:
    """Yield each request by itself."""
    return ([request] for request in requests)


def _decide(
    requests: Sequence[AgentRequest], agents: Sequence[Candidate], cost_of: CostOf, batched: Batches = one_by_one
) -> Decision:
    roster = agents if isinstance(agents, Roster) else Roster(agents)
    taken: dict[str, str] = {}
    grants: list[Grant] = []
    verdicts: dict[str, tuple[Verdict, ...]] = {}
    machines = {agent.id: place for place, agent in enumerate(roster) if not agent.shared}
    given = _given_by_hand(requests)
    for batch in batched(requests):
        aways = [{**_kept_from(request, given), **taken} if given else taken for request in batch]
        if len(batch) == 1:
            served = [_serve(batch[0], roster, aways[0], machines, cost_of)]
        else:
            served = _serve_together(batch, roster, aways, machines, cost_of)
        for request, (roles, seen) in zip(batch, served, strict=True):
            verdicts[request.task] = roster.shared(request.roles, seen)
            if roles is not None:
                grants.append(Grant(request.task, roles))
                taken.update({agent: request.task for group in roles.values() for agent in group if agent in machines})
            elif request.reserves:
                taken.update(_reserved(request, seen))
    return Decision(tuple(grants), verdicts)


def _given_by_hand(requests: Sequence[AgentRequest]) -> dict[str, AgentRequest]:
    """Return machine -> the request to which a person gave it."""
    return {
        agent: request for request in requests for role in request.roles if not role.shared for agent in role.by_hand
    }


def _kept_from(request: AgentRequest, given: Mapping[str, AgentRequest]) -> dict[str, str]:
    """Return the machines that persons gave to others, which keep them from all but a more urgent request."""
    rank = PRIORITIES[request.priority]
    return {
        agent: holder.task
        for agent, holder in given.items()
        if holder.task != request.task and PRIORITIES[holder.priority] <= rank
    }


def _reserved(request: AgentRequest, verdicts: Sequence[Verdict]) -> dict[str, str]:
    """Return the agents that an incomplete team keeps for itself: for each role the nearest that fit."""
    kept: dict[str, str] = {}
    for role in request.roles:
        if role.shared:
            continue
        fits = sorted((v.cost or 0.0, v.agent) for v in verdicts if v.role == role.role and v.code == "fits")
        kept.update({agent: request.task for _, agent in [f for f in fits if f[1] not in kept][: role.count]})
    return kept


class _Seen(NamedTuple):
    """What a request thinks of all agents."""

    costs: Costs
    verdicts: list[Verdict]
    fits: list[int]
    """Where the verdicts on those that fit are."""


def _serve(
    request: AgentRequest, agents: Roster, taken: dict[str, str], machines: Mapping[str, int], cost_of: CostOf
) -> tuple[Roles | None, list[Verdict]]:
    seen = _look(request, agents, taken, machines, cost_of)
    costs = seen.costs
    counts = {role.role: role.count for role in request.roles}
    chosen = assign(slots_of(request, counts), agents, costs, cost_of)
    if chosen is None:
        return None, seen.verdicts
    for role in request.roles:
        if role.more:
            chosen = fill_up(request, role, counts, chosen, agents, costs, cost_of)
    roles = roles_of(request, slots_of(request, counts), chosen)
    _mark(seen, roles)
    return roles, seen.verdicts


def _serve_together(
    requests: Sequence[AgentRequest],
    agents: Roster,
    taken: Sequence[dict[str, str]],
    machines: Mapping[str, int],
    cost_of: CostOf,
) -> list[tuple[Roles | None, list[Verdict]]]:
    looks = [_look(one, agents, away, machines, cost_of) for one, away in zip(requests, taken, strict=True)]
    shares = share(requests, [seen.costs for seen in looks], agents, cost_of)
    given = [
        {} if roles is None else _machines_of(request, roles) for request, roles in zip(requests, shares, strict=True)
    ]
    before: dict[str, str] = {}
    every = {agent: task for some in given for agent, task in some.items()}
    for request, seen, roles, own in zip(requests, looks, shares, given, strict=True):
        before.update(own)
        away = before if roles is None else every  # who gets nothing may keep what only later ones took
        for place in seen.fits:
            verdict = seen.verdicts[place]
            if away.get(verdict.agent, request.task) != request.task:
                seen.verdicts[place] = agents.verdict(verdict.role, verdict.agent, "busy", away[verdict.agent])
        if roles is not None:
            _mark(seen, roles)
    return [(roles, seen.verdicts) for roles, seen in zip(shares, looks, strict=True)]


def _machines_of(request: AgentRequest, roles: Roles) -> dict[str, str]:
    """Return the agents that a grant takes away from others -> its task."""
    return {agent: request.task for role in request.roles if not role.shared for agent in roles[role.role]}


def _mark(seen: _Seen, roles: Roles) -> None:
    """Say of the chosen ones that they are."""
    for place in seen.fits:
        verdict = seen.verdicts[place]
        if verdict.agent in roles[verdict.role]:
            seen.verdicts[place] = replace(verdict, code="chosen")


def _look(
    request: AgentRequest, agents: Roster, taken: dict[str, str], machines: Mapping[str, int], cost_of: CostOf
) -> _Seen:
    costs: Costs = {}
    verdicts: list[Verdict] = []
    fits: list[int] = []
    for role in request.roles:
        looked = agents.look(role)
        seen: list[Any] = looked.verdicts.copy()
        for agent_id, by in taken.items():
            if machines[agent_id] in looked.types:
                seen[machines[agent_id]] = agents.verdict(role.role, agent_id, "busy", by)
        for place in looked.fit:
            if seen[place] is not None:
                continue
            agent = agents[place]
            refused = refused_there(agent, role)
            if refused is not None:
                seen[place] = agents.verdict(role.role, agent.id, *refused)
                continue
            ways = max(1, min(role.count + role.more, len(role.near)))
            cost = cost_of(agent, role, 0) if ways == 1 else min(cost_of(agent, role, index) for index in range(ways))
            costs[role.role, agent.id] = cost.metres, agent.order
            told = in_words(agent, role, cost)
            seen[place] = Verdict(role.role, agent.id, "fits", cost.metres, told, cost.short)
            fits.append(len(verdicts) + place)
        verdicts += seen
    return _Seen(costs, verdicts, fits)
