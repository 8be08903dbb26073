"""Agents that people add to the fleet while the engine runs (`mode: real`), and take out of it."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.kernel.inputs import AddAgent, RemoveAgent
from formiga_bt.engine.kernel.records import Member
from formiga_bt.lang.model import Port
from formiga_bt.rehearsal.testing import folded
from formiga_bt.safety.approval import approval_digest
from tests.reloading import reloaded
from tests.unit.engine.test_authority import GOOD, Field, real


def field() -> Field:
    """A real site with a port that is nobody's."""
    site = real()
    first = next(iter(site.ports.values()))
    homes = {agent.home for agent in site.agents.values()}
    ports = {name: port for name, port in site.ports.items() if name in homes}
    spare = Port("spare", replace(first.at, north_m=first.at.north_m + 30.0))
    return Field(replace(site, ports={**ports, "spare": spare}))


def refused(field: Field, agent: str) -> str:
    return field.record(agent).refused


def test_an_agent_that_nobody_lists_is_admitted_once_a_person_adds_it() -> None:
    bench = field()
    bench.agent("lwd_9", "lwd")
    bench.run_for(1)
    assert refused(bench, "lwd_9") == "unlisted"

    bench.ask(AddAgent("lwd_9", by="ann"))
    bench.run_for(2)

    assert refused(bench, "lwd_9") == ""
    assert bench.record("lwd_9").home == "spare"
    assert bench.engine.state.members["lwd_9"] == Member(
        type="lwd", home="spare", by="ann", at=bench.engine.state.members["lwd_9"].at
    )


def test_an_agent_may_be_added_before_it_announces_itself() -> None:
    bench = field()
    bench.ask(AddAgent("lwd_9", kind="lwd", home="spare", by="ann"))

    bench.agent("lwd_9", "lwd")
    bench.run_for(1)

    assert (refused(bench, "lwd_9"), bench.record("lwd_9").home) == ("", "spare")


def test_a_task_gets_the_new_agent_and_its_approval_stands() -> None:
    bench = field()
    bench.ready("pia", "pete")
    before = [bench.begin() for _ in range(3)]
    assert bench.task(before[-1]).status == "PENDING"  # both drones are taken
    digest = approval_digest(bench.models["Wait"], bench.site)

    bench.agent("lwd_9", "lwd", at=bench.site.ports["spare"].at).say(checks=GOOD)
    bench.ask(AddAgent("lwd_9", by="ann"))
    bench.run_for(3)

    assert bench.task(before[-1]).agents.roles == {"drone": ("lwd_9",)}
    assert digest in bench.engine.state.approvals


def test_a_removed_agent_is_let_go_when_it_rests() -> None:
    bench = field()
    bench.ready("pia", "pete")
    bench.agent("lwd_9", "lwd", at=bench.site.ports["spare"].at).say(checks=GOOD)
    bench.ask(AddAgent("lwd_9", by="ann"))
    bench.run_for(1)
    tasks = [bench.begin() for _ in range(3)]
    bench.run_for(3)
    mine = next(one for one in tasks if bench.task(one).agents.roles["drone"] == ("lwd_9",))

    bench.ask(RemoveAgent("lwd_9", by="ann"))

    assert refused(bench, "lwd_9") == ""
    assert bench.record("lwd_9").refused_at_rest == "unlisted"
    bench.abort(mine)
    bench.run_for(3)
    assert refused(bench, "lwd_9") == "unlisted"
    assert bench.engine.state.members == {}


@pytest.mark.parametrize(
    ("given", "code"),
    [
        (AddAgent("lwd_9"), "not_approver"),
        (AddAgent("lwd_9", by="eve"), "not_approver"),
        (RemoveAgent("lwd_9", by="eve"), "not_approver"),
        (AddAgent("lwd_1", by="ann"), "in_site_file"),
        (RemoveAgent("lwd_1", by="ann"), "in_site_file"),
        (AddAgent("nobody", by="ann"), "unknown_agent"),
        (AddAgent("new", kind="blimp", by="ann"), "unknown_type"),
        (AddAgent("new", kind="lwd", home="moon", by="ann"), "unknown_home"),
        (AddAgent("new", kind="lwd", home="s1", by="ann"), "home_taken"),
        (AddAgent("lwd_9", kind="hwd", by="ann"), "other_type"),
        (RemoveAgent("lwd_9", by="ann"), "not_member"),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(given: AddAgent | RemoveAgent, code: str) -> None:
    bench = field()
    bench.agent("lwd_9", "lwd")
    bench.run_for(1)
    if given.agent == "new" and isinstance(given, AddAgent) and given.home == "s1":
        given = replace(given, home=bench.record("lwd_1").home)
    with pytest.raises(TaskError) as told:
        bench.ask(given)
    assert told.value.code == code


def test_no_port_is_given_twice() -> None:
    bench = field()
    bench.ask(AddAgent("lwd_8", kind="lwd", home="spare", by="ann"))
    for given in (AddAgent("lwd_9", kind="lwd", home="spare", by="ann"), AddAgent("lwd_9", kind="lwd", by="ann")):
        with pytest.raises(TaskError) as told:
            bench.ask(given)
        assert told.value.code in ("home_taken", "no_port")


def test_members_are_part_of_what_the_journal_keeps() -> None:
    bench = field()
    bench.ask(AddAgent("lwd_9", kind="lwd", home="spare", by="ann"))
    assert folded(bench.steps).members == bench.engine.state.members
    assert reloaded(bench.engine.state).members == bench.engine.state.members
