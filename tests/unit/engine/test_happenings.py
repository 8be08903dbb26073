"""Events that agents tell of themselves: each is taken once; lies count as bad messages; what is kept is bounded."""

from agents_sim.faults import Order
from formiga_bt.base.packaged import folder
from formiga_bt.engine.kernel.inputs import AgentEventInput, Alarm
from formiga_bt.engine.kernel.state import KEPT_EVENTS
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.transport.messages import AgentEvent
from tests.golden import Wording
from tests.reloading import reloaded
from tests.replay.missions import world

TEXT = """
formiga: 1
task: Alarm
params: {user: {type: agent, of: [picker]}}
agents:
  picker: {type: picker, id: "${user}"}
steps:
  - repeat: 2
    steps:
      - wait_for: picker.sos
        since: task
        timeout: 1 h
        save_as: told
      - notify: Alarm at ${told.at}
"""


def flight() -> Rehearsal:
    site, _, _ = world()
    catalogue, problems, _ = load_catalogue(sorted(folder("actions").glob("*.yaml")))
    assert problems == []
    loaded = load_task_text(TEXT, "alarm.yaml", catalogue=catalogue, site=site)
    assert loaded.diagnostics == []
    assert loaded.task is not None
    return Rehearsal(site, catalogue, [loaded.task], fleet_of(site, catalogue))


def tell(flown: Rehearsal, n: int, event: str = "sos", agent: str = "picker_1", boot: str = "b") -> None:
    flown.driver.feed(AgentEventInput(AgentEvent(agent=agent, event=event, boot_id=boot, n=n)))


def test_a_repeated_event_counts_once_and_a_lie_counts_as_bad() -> None:
    flown = flight()
    flown.run_for(1)
    for n, event in ((1, "sos"), (1, "sos"), (2, "dance"), (1, "geofence")):
        tell(flown, n, event)
    tell(flown, 1, boot="c")

    state = flown.engine.state
    assert [(one.boot_id, one.n) for one in state.agent_events["picker_1"]] == [("b", 1), ("c", 1)]
    assert state.agents["picker_1"].bad == 1
    assert reloaded(state).agent_events == state.agent_events
    flown.close()


def test_as_many_are_kept_as_the_bound_says() -> None:
    flown = flight()
    flown.run_for(1)
    for n in range(KEPT_EVENTS + 20):
        tell(flown, n + 1)

    kept = flown.engine.state.agent_events["picker_1"]
    assert [kept[0].n, kept[-1].n, len(kept)] == [21, KEPT_EVENTS + 20, KEPT_EVENTS]
    flown.close()


def test_a_simulated_person_raises_an_alarm() -> None:
    flown = flight()
    flown.run_for(1)
    task = flown.submit("Alarm", {"user": AgentRef("picker_1")})
    flown.run_for(2)
    for _ in range(2):
        flown.sim.order("picker_1", Order(kind="event", event="sos"))
    assert flown.run_until_ended()
    assert flown.engine.state.tasks[task].status == "SUCCEEDED"
    flown.close()


def alarms(flown: Rehearsal) -> list[str]:
    return [e.text for s in flown.steps for e in s.effects if isinstance(e, Alarm) and e.code == "events_unheard"]


def test_events_that_nobody_takes_raise_one_alarm(wording: Wording) -> None:
    flown = flight()
    flown.run_for(1)
    for n in range(2 * KEPT_EVENTS):
        tell(flown, n + 1)
    assert alarms(flown) == []
    for n in range(2 * KEPT_EVENTS, 4 * KEPT_EVENTS):
        tell(flown, n + 1)

    wording(alarms(flown))
    flown.close()


def test_events_that_a_task_took_raise_none() -> None:
    flown = flight()
    flown.run_for(1)
    for n in range(0, 3 * KEPT_EVENTS, 2):
        task = flown.submit("Alarm", {"user": AgentRef("picker_1")})
        flown.run_for(2)
        tell(flown, n + 1)
        tell(flown, n + 2)
        assert flown.run_until_ended()
        assert flown.engine.state.tasks[task].status == "SUCCEEDED"

    assert alarms(flown) == []
    assert flown.engine.state.agent_events["picker_1"][0].n == 2 * KEPT_EVENTS + 1
    flown.close()
