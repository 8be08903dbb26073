"""The policy `optimal`: the order says who is served, and all who are have the least ways together. Pure functions."""

from itertools import permutations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.base.geo import Place
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.policy import Decision, closest_charged, optimal
from formiga_bt.engine.allocator.together import MOST_PLACES
from formiga_bt.engine.kernel.records import AgentRequest
from tests.unit.engine.test_allocator_policy import drone, request, role


def at(east_m: float, **fields: Any) -> Any:
    return role(near=(Place(east_m, 0.0),), **fields)


def given_to(decision: Decision) -> dict[str, tuple[str, ...]]:
    return {grant.task: grant.roles["drone"] for grant in decision.grants}


def test_two_tasks_together_have_the_shorter_ways() -> None:
    """The first alone would take d1, by ten metres, and send d2 the whole way to the second."""
    agents = [drone("d1", 45.0), drone("d2", -55.0)]
    requests = [request("A-1", at(0.0)), request("B-2", at(100.0), order=2)]

    assert given_to(closest_charged(requests, agents)) == {"A-1": ("d1",), "B-2": ("d2",)}
    assert given_to(optimal(requests, agents)) == {"A-1": ("d2",), "B-2": ("d1",)}


def test_the_first_leaves_a_later_one_the_only_agent_that_it_can_have() -> None:
    agents = [drone("d1", 0.0), drone("d2", 900.0, actions=("GoTo", "Winch"))]
    requests = [request("A-1", at(900.0)), request("B-2", at(900.0, actions=("Winch",)), order=2)]

    assert given_to(closest_charged(requests, agents)) == {"A-1": ("d2",)}
    assert given_to(optimal(requests, agents)) == {"A-1": ("d1",), "B-2": ("d2",)}


def test_who_came_first_is_served_though_a_later_one_is_nearer() -> None:
    decision = optimal([request("Far-1", at(9000.0)), request("Near-2", at(0.0), order=2)], [drone("d1", 0.0)])

    assert given_to(decision) == {"Far-1": ("d1",)}
    assert [(v.code, v.detail) for v in decision.verdicts["Near-2"]] == [("busy", "Far-1")]


def test_a_more_urgent_task_gives_nothing_up_for_others() -> None:
    agents = [drone("d1", 45.0), drone("d2", -55.0)]
    high = AgentRequest(holder="A-1", priority="high", order=1, at=0, roles=(at(0.0),))

    assert given_to(optimal([high, request("B-2", at(100.0), order=2)], agents)) == {"A-1": ("d1",), "B-2": ("d2",)}


def test_the_explanation_says_who_got_the_nearer_one() -> None:
    agents = [drone("d1", 45.0), drone("d2", -55.0)]
    decision = optimal([request("A-1", at(0.0)), request("B-2", at(100.0), order=2)], agents)

    assert [(v.agent, v.code, v.detail) for v in decision.verdicts["A-1"]] == [
        ("d1", "busy", "B-2"),
        ("d2", "chosen", ""),
    ]


def test_equal_costs_go_to_the_agents_known_first_whatever_their_order_here() -> None:
    agents = [drone(f"d{n}", 9.0) for n in (3, 1, 4, 2)]
    requests = [request(f"T-{n}", order=n) for n in (1, 2, 3)]

    assert given_to(optimal(requests, agents)) == {"T-1": ("d1",), "T-2": ("d2",), "T-3": ("d3",)}


def test_more_places_than_are_dealt_out_together_are_served_too() -> None:
    agents = [drone(f"d{n}", 10.0 * n) for n in range(1, MOST_PLACES + 11)]
    requests = [request(f"T-{n}", at(10.0 * n), order=n) for n in range(1, MOST_PLACES + 11)]

    assert given_to(optimal(requests, agents)) == {f"T-{n}": (f"d{n}",) for n in range(1, MOST_PLACES + 11)}


@st.composite
def instances(draw: st.DrawFn) -> tuple[list[AgentRequest], list[Candidate]]:
    """Up to five agents of two types, up to four requests of one or two places."""
    easts = draw(st.lists(st.integers(-9, 9), max_size=5))
    agents = [
        drone(f"d{n}", 100.0 * east, type=draw(st.sampled_from(["lwd", "ugv"]))) for n, east in enumerate(easts, 1)
    ]
    requests = []
    for number in range(1, draw(st.integers(1, 4)) + 1):
        count = draw(st.integers(1, 2))
        near = tuple(Place(100.0 * draw(st.integers(-9, 9)), 0.0) for _ in range(count))
        types = draw(st.sampled_from([("lwd",), ("ugv",), ("lwd", "ugv")]))
        wanted = role(near=near, count=count, types=types, is_list=count > 1)
        requests.append(request(f"T-{number}", wanted, order=number))
    return requests, agents


def every_way(served: tuple[AgentRequest, ...], agents: list[Candidate]) -> list[float]:
    """Return what each way to serve these requests costs, by trying all of them."""
    slots = [(one.roles[0], place) for one in served for place in one.roles[0].near]
    return [
        sum(abs(agent.position.east_m - place.east_m) for agent, (_, place) in zip(team, slots, strict=True))  # type: ignore[union-attr]  # all stand somewhere
        for team in permutations(agents, len(slots))
        if all(agent.type in wanted.types for agent, (wanted, _) in zip(team, slots, strict=True))
    ]


@given(instances())
def test_beside_trying_all_ways(instance: tuple[list[AgentRequest], list[Candidate]]) -> None:
    """The requests served are the first that can be, whole; nobody has two; and no other way to serve them costs less."""
    requests, agents = instance
    served: tuple[AgentRequest, ...] = ()
    for one in requests:
        if every_way((*served, one), agents):
            served = (*served, one)

    decision = optimal(requests, agents)
    found = given_to(decision)

    assert list(found) == [one.task for one in served]
    assert [len(found[one.task]) for one in served] == [one.roles[0].count for one in served]
    owners = [agent for group in found.values() for agent in group]
    assert len(owners) == len(set(owners))
    where = {agent.id: agent.position.east_m for agent in agents if agent.position is not None}
    ways = [
        abs(where[agent] - place.east_m)
        for one in served
        for agent, place in zip(found[one.task], one.roles[0].near, strict=True)
    ]
    assert sum(ways) == pytest.approx(min(every_way(served, agents)))
    assert optimal(requests, agents) == decision
