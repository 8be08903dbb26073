"""Actions that agents announce and that no catalogue has: usable at once in a simulation, else after an approver's word."""

from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import AgentSeenInput, Learn
from formiga_bt.lang.growing import growing
from formiga_bt.lang.model import Site, Task
from formiga_bt.rehearsal.testing import Bench, alarms, folded, packaged_world, task_of
from formiga_bt.transport.cards import AgentCard, CardAction, CardField
from tests.reloading import reloaded
from tests.unit.engine.test_authority import real

SPRAY = CardAction(
    name="Spray",
    fields={"amount": CardField(type="mass", default=2.0, min=0.5, max=8.0), "what": CardField(type="text")},
    result={"left": CardField(type="mass")},
    requires="airborne",
    typical_s=20.0,
    help="Spray something.",
)
TASK = """\
imports: [lib/flying.yaml]
agents: {drone: {type: hwd, capabilities: [Spray]}}
steps:
  - do: drone.TakeOff
  - do: drone.Spray
    with: {what: water, amount: 3 kg}
    save_as: found
  - check: found.left > 0 kg
finally:
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


class Shed(Bench):
    """A site with a heavy drone that announces Spray."""

    def __init__(self, site: Site | None = None, tasks: tuple[Task, ...] = ()) -> None:
        world, catalogue = packaged_world()
        super().__init__(site or world, growing(catalogue), tasks)
        self.run_for(1)

    def card(self, agent: str = "hwd_1", kind: str = "hwd", *actions: Any) -> None:
        new = actions or (SPRAY,)
        found = (*(one for one in self.catalogue.types[kind].actions if one != new[0].name), *new)
        given = AgentCard(id=agent, type=kind, boot_id=f"{agent}-1", actions=found)
        self.driver.feed(AgentSeenInput(given, 1))


def test_in_a_simulation_tasks_use_it_at_once() -> None:
    shed = Shed()
    shed.card()

    assert "Spray" in shed.record("hwd_1").actions
    spec = shed.catalogue.actions["Spray"]
    assert (spec.typical_us, spec.requires, str(spec.result["left"])) == (20_000_000, "airborne", "mass")
    assert (spec.fields["amount"].min, spec.fields["amount"].max) == (0.5, 8.0)
    assert "Spray" in shed.catalogue.types["hwd"].actions
    assert "Spray" not in shed.catalogue.types["lwd"].actions
    task_of(TASK, shed.engine.core.site, shed.catalogue)  # it checks


def test_what_flies_and_announces_one_counts_as_starting_rotors_and_landing() -> None:
    shed = Shed()
    shed.card()
    spec = shed.catalogue.actions["Spray"]
    assert (spec.starts_rotors, spec.lands, spec.cuts) == (True, True, False)


def test_where_it_is_real_it_waits_for_an_approver() -> None:
    shed = Shed(real())
    shed.card()
    assert "Spray" not in shed.catalogue.actions
    assert "Spray" not in shed.record("hwd_1").actions
    assert "action_unknown" in alarms(shed)
    for by in ("", "rita"):
        with pytest.raises(TaskError) as told:
            shed.ask(Learn("Spray", by))
        assert told.value.code == "not_approver"

    shed.ask(Learn("Spray", "ann"))

    assert "Spray" in shed.catalogue.actions
    assert "Spray" in shed.record("hwd_1").actions
    assert shed.engine.state.discovered["Spray"].by == "ann"


def test_what_cuts_motors_is_never_taken_from_a_card() -> None:
    shed = Shed()
    shed.card("hwd_1", "hwd", CardAction(name="Drop", cuts=True))
    assert "Drop" not in shed.catalogue.actions
    assert shed.engine.state.discovered["Drop"].fault
    with pytest.raises(TaskError) as told:
        shed.ask(Learn("Drop"))
    assert told.value.code == "bad_action"


def test_who_contradicts_the_first_announcement_is_refused_it() -> None:
    shed = Shed()
    shed.card()
    other = replace(SPRAY, result={"left": CardField(type="text")})
    shed.card("hwd_2", "hwd", other)
    assert "Spray" in shed.record("hwd_1").actions
    assert "Spray" not in shed.record("hwd_2").actions
    assert "text" in shed.record("hwd_2").refused_actions["Spray"]
    assert "mass" in shed.record("hwd_2").refused_actions["Spray"]


def test_two_that_differ_before_anybody_said_yes_bind_nobody() -> None:
    shed = Shed(real())
    shed.card()
    shed.card("hwd_2", "hwd", replace(SPRAY, typical_s=5.0))
    with pytest.raises(TaskError) as told:
        shed.ask(Learn("Spray", "ann"))
    assert told.value.code == "bad_action"
    assert {"hwd_1", "hwd_2"} <= set(told.value.text.replace(":", "").split())


def test_an_action_of_another_type_of_the_catalogue_is_not_given_away() -> None:
    shed = Shed()
    shed.card("hwd_1", "hwd", CardAction(name="Explore", typical_s=1.0))
    assert "Explore" not in shed.catalogue.types["hwd"].actions
    assert shed.engine.state.discovered == {}


@pytest.mark.parametrize(
    "odd",
    [
        CardAction(name="Dig", fields={"deep": CardField(type="banana")}),
        CardAction(name="Dig", moves_to="nowhere"),
        CardAction(name="Dig", fields={"two words": CardField(type="text")}),
        CardAction(name="Dig", requires="hungry"),
    ],
)
def test_what_cannot_be_read_is_shown_with_its_reason_and_binds_nobody(odd: CardAction) -> None:
    shed = Shed()
    shed.card("hwd_1", "hwd", odd)
    assert "Dig" not in shed.catalogue.actions
    assert shed.engine.state.discovered["Dig"].fault


def test_the_journal_keeps_it_and_an_engine_that_goes_on_knows_it() -> None:
    shed = Shed()
    shed.card()
    state = reloaded(shed.engine.state)
    assert state.discovered == folded(shed.steps).discovered == shed.engine.state.discovered

    site, catalogue = packaged_world()
    again = Engine(site, catalogue, {}, state=state)

    assert "Spray" in again.core.catalogue.types["hwd"].actions
    assert "Spray" not in catalogue.actions
