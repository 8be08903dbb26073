"""The roster: what a policy decides over it is what it decides over a plain list, and equal verdicts are one object."""

import random
from typing import Any

from formiga_bt.base.geo import Place
from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.filters import refusal
from formiga_bt.engine.allocator.policy import closest
from formiga_bt.engine.allocator.roster import Roster
from formiga_bt.engine.kernel.records import AgentRequest, RoleRequest
from tests.unit.engine.test_allocator_policy import drone, request, role


def fleet(draw: random.Random, count: int) -> list[Candidate]:
    """Return machines of two types, some busy, some low."""
    return [
        drone(
            f"d{number}",
            draw.uniform(0.0, 500.0),
            type=draw.choice(["lwd", "hwd"]),
            battery=draw.choice([20.0, 90.0]),
            task=draw.choice(["", "", "Other-9"]),
        )
        for number in range(count)
    ]


def wishes(draw: random.Random, count: int) -> list[AgentRequest]:
    """Return requests of one or two roles, some for one very machine."""

    def wish(name: str) -> RoleRequest:
        fields: dict[str, Any] = {"role": name, "types": draw.choice([("lwd",), ("hwd",), ("lwd", "hwd")])}
        fields |= {"id": draw.choice(["", "", "d3"]), "battery_min": draw.choice([0.0, 50.0])}
        return role(near=(Place(draw.uniform(0.0, 500.0), 0.0),), count=draw.choice([1, 1, 2]), is_list=True, **fields)

    return [
        request(f"T-{n}", *[wish(name) for name in ("one", "two")[: draw.choice([1, 2])]], order=n)
        for n in range(count)
    ]


def test_every_verdict_is_that_of_the_filters() -> None:
    for seed in range(30):
        draw = random.Random(seed)
        agents, (one,) = fleet(draw, 8), wishes(draw, 1)
        decision = closest([one], agents)
        expected = [
            (wish.role, agent.id, refusal(agent, wish) or ("fits", "")) for wish in one.roles for agent in agents
        ]
        found = [
            (v.role, v.agent, ("fits" if v.code == "chosen" else v.code, v.detail)) for v in decision.verdicts[one.task]
        ]
        assert expected == found


def test_a_roster_that_is_kept_decides_as_one_made_anew() -> None:
    for seed in range(30):
        draw = random.Random(seed)
        kept = Roster()
        agents = {agent.id: agent for agent in fleet(draw, 6)}
        for look in range(5):
            agents |= {agent.id: agent for agent in fleet(draw, 6 + look)[draw.randrange(4) :]}
            for agent in agents.values():
                kept.put(agent)
            kept.begin()
            asked = wishes(draw, 5)
            assert closest(asked, kept) == closest(asked, list(agents.values()))


def test_equal_verdicts_are_one_object_over_all_looks() -> None:
    kept = Roster()
    for agent in (drone("d1", 0.0), drone("d2", 0.0, type="hwd"), drone("d3", 0.0, task="Other-9")):
        kept.put(agent)
    first = closest([request("T-1", role(id="d3"))], kept).verdicts["T-1"]
    kept.begin()
    second = closest([request("T-2", role(id="d3"))], kept).verdicts["T-2"]
    assert [v.code for v in first] == ["not_this_one", "wrong_type", "busy"]
    assert first is second
