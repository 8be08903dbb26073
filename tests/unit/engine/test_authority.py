"""Who may let a task fly (`mode: real`): approvals, pilots on duty, preflight checks; and what no grant gets past."""

import re
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import TaskError
from formiga_bt.base.geo import Place
from formiga_bt.engine.kernel.inputs import Alarm, Approve, Duty, Serve, Submit
from formiga_bt.engine.kernel.records import Lockdown
from formiga_bt.engine.kernel.replies import Refusal
from formiga_bt.lang.model import Site
from formiga_bt.rehearsal.testing import Bench, effects, packaged_world, task_of
from formiga_bt.safety.approval import approval_digest
from formiga_bt.safety.drafted import drafted
from formiga_bt.transport.messages import PreflightCheck
from tests.golden import Wording
from tests.reloading import reloaded

GOOD = (PreflightCheck("gnss", True, "14 satellites"),)
BAD = (PreflightCheck("gnss", True), PreflightCheck("storage", False, "no card"))
HOP = """\
imports: [lib/flying.yaml]
agents: {drone: {type: lwd}}
steps:
  - do: drone.TakeOff
  - call: ReturnHome
    with: {drone: '${drone}'}
"""
WAIT = "agents: {drone: {type: lwd}}\nsteps: [{wait: 1 h}]\n"
NEAR = """\
params: {target: place}
agents: {drone: {type: lwd, near: '${target}'}}
steps: [{wait: 1 h}]
"""
PAIR = "agents: {one: {type: lwd}, two: {type: lwd}}\nsteps: [{wait: 1 h}]\n"
DRILL = "priority: high\nagents: {drones: {type: lwd, count: all, preempt: true}}\nsteps: [{wait: 1 h}]\n"
FAR = """\
params: {target: {type: place, default: camp}}
agents: {drone: {type: lwd}}
steps:
  - do: drone.TakeOff
  - do: drone.LandIn
    with: {at: '${target}'}
"""


def real(**more: Any) -> Site:
    site = packaged_world()[0]
    people = {**site.people, "approvers": ("ann", "bob")}
    return replace(site, **{"mode": "real", "people": people, "pilots": {"pia": 1, "pete": 2}, **more})


class Field(Bench):
    """Two light drones of a site in `mode: real`, ready to fly; tasks Hop (home), Wait, Far (lands away)."""

    def __init__(self, site: Site | None = None, checks: tuple[PreflightCheck, ...] = GOOD) -> None:
        world, catalogue = packaged_world()
        texts = {"Hop": HOP, "Wait": WAIT, "Far": FAR, "Near": NEAR, "Pair": PAIR, "Drill": DRILL}
        self.models = {name: task_of(text, world, catalogue, name=name) for name, text in texts.items()}
        super().__init__(site or real(), catalogue, self.models.values())
        self.drones = [self.agent(name, "lwd") for name in ("lwd_1", "lwd_2")]
        for drone in self.drones:
            drone.say(checks=checks)
        self.run_for(1)

    def digest(self, name: str) -> str:
        return approval_digest(self.models[name], self.site)

    def approve(self, name: str, by: str = "ann", **more: Any) -> None:
        self.ask(Approve(self.digest(name), name, by, **more))

    def ready(self, *pilots: str, name: str = "Wait") -> None:
        self.approve(name)
        for pilot in pilots:
            self.ask(Duty(pilot, True))

    def begin(self, name: str = "Wait", **more: Any) -> str:
        found = self.submit(name, {}, **{"by": "rita@desk", **more})
        self.run_for(1)
        return found

    def codes(self, task_id: str) -> dict[str, str]:
        return {v.agent: v.code for v in self.engine.state.explanations[task_id] if v.role == "drone"}

    def blocked(self, task_id: str) -> tuple[str, str]:
        (verdict,) = [v for v in self.engine.state.explanations[task_id] if not v.role]
        return verdict.code, verdict.detail


# -- approval ----------------------------------------------------------------------------------------------------------
def test_a_task_that_nobody_approved_is_refused_and_the_refusal_says_what_to_do(wording: Wording) -> None:
    field = Field()
    with pytest.raises(TaskError) as refused:
        field.submit("Hop", by="rita")
    assert refused.value.code == "not_approved"
    wording(str(refused.value))
    assert field.engine.state.tasks == {}


def test_an_approved_task_starts() -> None:
    field = Field()
    field.ready("pia")
    assert field.task(field.begin()).status == "ACTIVE"


def test_only_approvers_approve(wording: Wording) -> None:
    field = Field()
    with pytest.raises(TaskError) as refused:
        field.approve("Hop", by="rita")
    wording(refused.value)
    assert field.engine.state.approvals == {}


def test_an_approval_is_for_this_version_on_this_site_only(wording: Wording) -> None:
    field = Field()
    other = replace(field.models["Hop"], covered="changed by one letter")
    field.ask(Approve(approval_digest(other, field.site), "Hop", "ann"))
    with pytest.raises(TaskError) as refused:
        field.submit("Hop")
    wording(refused.value)


def test_an_approval_can_be_taken_back_and_then_waiting_tasks_wait_for_another(wording: Wording) -> None:
    field = Field()
    field.approve("Wait")
    task_id = field.begin()  # no pilot yet
    field.approve("Wait", by="bob", revoke=True)
    field.ask(Duty("pia", True))
    field.run_for(1)

    assert field.task(task_id).status == "PENDING"
    assert field.blocked(task_id)[0] == "not_approved"
    with pytest.raises(TaskError) as refused:
        field.approve("Wait", revoke=True)
    wording(refused.value)
    field.approve("Wait")
    field.run_for(1)
    assert field.task(task_id).status == "ACTIVE"


def test_who_requests_a_task_that_lands_away_needs_the_word_of_another(wording: Wording) -> None:
    field = Field()
    field.approve("Far")
    for requester in ("ann", "Ann@desk"):
        with pytest.raises(TaskError) as refused:
            field.submit("Far", by=requester)
        wording(refused.value)
    with pytest.raises(TaskError) as refused:
        field.submit("Far", by="http")
    wording(refused.value)
    assert field.submit("Far", by="bob") == "Far-1"
    field.approve("Far", by="bob")
    assert field.submit("Far", by="ann") == "Far-2"


def test_one_that_lands_at_home_may_be_approved_by_its_requester() -> None:
    field = Field()
    field.approve("Hop")
    assert field.submit("Hop", by="ann") == "Hop-1"


# -- what a model wrote ------------------------------------------------------------------------------------------------
def written(field: Field, name: str = "Hop", *by: str) -> None:
    wrote = drafted(by or ("eve",), "local qwen", ["bob@desk"])
    field.ask(Serve(name, field.models[name].bundle, "", wrote))


def test_what_a_model_wrote_needs_the_word_of_one_who_neither_asked_for_it_nor_requests_it(wording: Wording) -> None:
    field = Field(real(people={"approvers": ("ann", "eve", "bob")}))
    written(field)
    with pytest.raises(TaskError) as refused:
        field.submit("Hop", by="rita")
    assert refused.value.code == "not_approved"
    wording(str(refused.value))
    for by in ("eve", "bob"):  # bob was logged in
        with pytest.raises(TaskError) as refused:
            field.approve("Hop", by=by)
        assert refused.value.code == "not_approver"
        wording(str(refused.value))
    field.approve("Hop")
    with pytest.raises(TaskError) as refused:
        field.submit("Hop", by="Ann@desk")
    wording(str(refused.value))
    with pytest.raises(TaskError) as refused_2:
        field.submit("Hop", by="http")
    wording(refused_2.value)
    assert field.submit("Hop", by="eve") == "Hop-1"


def test_an_approval_of_who_asked_for_it_that_stands_already_does_not_count(wording: Wording) -> None:
    field = Field(real(people={"approvers": ("ann", "eve")}))
    field.approve("Hop", by="eve")
    written(field)
    with pytest.raises(TaskError) as refused:
        field.submit("Hop", by="rita")
    wording(str(refused.value))
    field.ask(Approve(field.digest("Hop"), "Hop", "eve", at=5))  # an engine that starts tells what stands
    with pytest.raises(TaskError) as refused_2:
        field.submit("Hop", by="rita")
    wording(refused_2.value)
    field.approve("Hop")
    assert field.submit("Hop", by="rita") == "Hop-1"


def test_a_waiting_request_of_what_turns_out_to_be_drafted_waits_on() -> None:
    field = Field()
    field.approve("Wait")
    task_id = field.begin(by="ann")  # no pilot yet
    written(field, "Wait")
    field.ask(Duty("pia", True))
    field.run_for(1)
    assert field.blocked(task_id)[0] == "not_approved"
    field.approve("Wait", by="ann", revoke=True)
    assert "another approver" in field.blocked(task_id)[1]


def test_that_a_model_wrote_it_is_never_taken_back_and_is_part_of_the_state() -> None:
    field = Field()
    written(field)
    bundle = field.models["Hop"].bundle
    field.ask(Serve("Hop", bundle))
    written(field, "Hop", "ann")
    assert field.engine.state.drafted == {bundle: drafted(["eve", "ann"], "local qwen", ["bob@desk"])}
    assert reloaded(field.engine.state).drafted == field.engine.state.drafted


def test_in_a_simulation_nothing_of_this_binds() -> None:
    field = Field(packaged_world()[0], checks=())
    task_id = field.begin("Far", by="")
    assert (field.task(task_id).status, field.task(task_id).agents.pilot) == ("ACTIVE", "")


# -- pilots ------------------------------------------------------------------------------------------------------------
def test_a_grant_names_a_pilot_on_duty() -> None:
    field = Field()
    field.ready("pia")
    assert field.task(field.begin()).agents.pilot == "pia"


def test_without_a_pilot_on_duty_a_request_waits_and_says_so(wording: Wording) -> None:
    field = Field()
    field.approve("Wait")
    task_id = field.begin()

    assert field.task(task_id).status == "PENDING"
    code, text = field.blocked(task_id)
    assert code == "no_pilot"
    wording(text)
    assert field.codes(task_id)["lwd_1"] == "fits"
    field.run_for(30)  # when all of the fleet counts as seen, it does not count as hopeless either
    assert field.task(task_id).status == "PENDING"
    field.ask(Duty("pete", True))
    field.run_for(1)
    assert field.task(task_id).agents.pilot == "pete"


def test_a_pilot_has_so_many_machines_at_once_until_they_are_released(wording: Wording) -> None:
    field = Field()
    field.ready("pia")
    first, second = field.begin(), field.begin()

    code, text = field.blocked(second)
    assert code == "no_pilot"
    wording(text)
    field.abort(first)
    field.run_until_ended(first)
    field.run_for(1)
    assert field.task(second).agents.pilot == "pia"


def test_two_grants_of_one_look_do_not_share_the_last_room() -> None:
    field = Field()
    field.approve("Wait")
    first, second = field.begin(), field.begin()
    field.ask(Duty("pia", True))
    field.run_for(1)

    assert sorted(field.task(t).status for t in (first, second)) == ["ACTIVE", "PENDING"]
    assert field.blocked(second)[0] == "no_pilot"


def test_the_pilot_with_the_most_room_is_taken() -> None:
    field = Field()
    field.ready("pia", "pete")
    assert [field.task(field.begin()).agents.pilot for _ in range(2)] == ["pete", "pia"]


def test_a_pilot_who_leaves_gets_no_more_and_an_alarm_tells_what_is_still_out(wording: Wording) -> None:
    field = Field()
    field.ready("pete")
    field.begin()
    field.ask(Duty("pete", False))
    second = field.begin()

    assert field.blocked(second)[0] == "no_pilot"
    (alarm,) = [a for a in effects(field, Alarm) if a.code == "pilot_off_duty"]
    wording(alarm.text)


def test_a_high_task_preempts_for_a_pilots_room_and_nobody_takes_it_meanwhile(wording: Wording) -> None:
    field = Field()
    field.ready("pia")
    low = field.begin(priority="low")
    waiting = field.begin()
    sos = field.begin(priority="high")

    assert field.task(low).restart.why == "preempted" or field.task(low).run == 2
    field.run_for(5)
    assert [field.task(t).status for t in (low, waiting, sos)] == ["PENDING", "PENDING", "ACTIVE"]
    wording(field.task(low).restart.past)
    assert field.task(sos).agents.pilot == "pia"


def test_a_high_task_that_no_pilot_on_duty_may_ever_take_preempts_nobody() -> None:
    field = Field(real(pilots={"pia": 1}))
    field.ready("pia", name="Wait")
    field.approve("Pair")
    low = field.begin(priority="low")
    pair = field.begin("Pair", priority="high")
    field.run_for(10)

    assert (field.task(low).run, field.task(low).status) == (1, "ACTIVE")
    assert field.blocked(pair)[0] == "no_pilot"


@pytest.mark.parametrize(("room", "taken"), [(2, 2), (1, 1)])
def test_a_seizure_takes_no_more_than_a_pilot_may_have(room: int, taken: int) -> None:
    field = Field(real(pilots={"pia": room, "pete": 1}))
    field.ready("pia" if room > 1 else "pete")
    field.approve("Drill")
    low = field.begin(priority="low")

    drill = field.begin("Drill")
    field.run_for(5)

    assert (len(field.task(drill).agents.granted), field.task(low).run) == (taken, 2)


def test_only_pilots_of_the_site_go_on_duty(wording: Wording) -> None:
    with pytest.raises(TaskError) as refused:
        Field().ask(Duty("ann", True))
    wording(refused.value)


# -- before a flight ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("checks", "code", "detail"), [(BAD, "preflight", "storage: no card"), ((), "no_checks", "")], ids=["bad", "none"]
)
def test_a_machine_is_granted_only_when_its_checks_are_all_ok(
    checks: tuple[PreflightCheck, ...], code: str, detail: str
) -> None:
    field = Field(checks=checks)
    field.ready("pia")
    task_id = field.begin()

    verdict = next(v for v in field.engine.state.explanations[task_id] if v.agent == "lwd_1")
    assert (verdict.code, verdict.detail) == (code, detail)
    field.drones[0].say(checks=GOOD)
    field.run_for(2)
    assert field.task(task_id).agents.roles == {"drone": ("lwd_1",)}


def test_a_simulated_site_may_ask_for_checks_too() -> None:
    field = Field(replace(packaged_world()[0], preflight=True), checks=BAD)
    assert field.codes(field.begin())["lwd_1"] == "preflight"


def test_a_machine_that_was_taken_over_is_not_granted() -> None:
    field = Field(packaged_world()[0])
    for drone in field.drones:
        field.engine.core.put_agent(drone.id, taken=True)
    assert field.codes(field.begin())["lwd_1"] == "control"


def test_a_machine_that_cannot_go_there_and_come_home_is_passed_over_with_the_numbers(wording: Wording) -> None:
    field = Field(packaged_world()[0])
    field.drones[0].say(battery=30.0)
    field.drones[1].say(battery=30.0, wind_east_m_s=9.0, wind_north_m_s=0.0)
    field.run_for(1)
    task_id = field.submit("Near", {"target": Place(500.0, 300.0)})
    field.run_for(1)

    found = {v.agent: (v.code, v.detail) for v in field.engine.state.explanations[task_id]}
    code, detail = found["lwd_1"]
    assert code == "energy"
    told = re.fullmatch(
        r"30 % less 1\d\.\d % there and back leaves less than its reserve of 25 %; (\d\d) % is enough", detail
    )
    assert told is not None, detail
    enough = float(told[1])
    assert found["lwd_2"][0] == "energy"
    wording(found["lwd_2"][1])
    field.drones[0].say(battery=enough - 1.0)
    field.run_for(2)
    assert field.task(task_id).status == "PENDING"
    field.drones[0].say(battery=enough)
    field.run_for(2)
    assert field.task(task_id).agents.roles == {"drone": ("lwd_1",)}


# -- lockdown ----------------------------------------------------------------------------------------------------------
def test_under_lockdown_nothing_is_admitted_and_nothing_granted(wording: Wording) -> None:
    field = Field(replace(packaged_world()[0], preflight=True), checks=BAD)
    waiting = field.begin()
    field.engine.state.lockdown = Lockdown("return", "olga", field.now)
    for drone in field.drones:
        drone.say(checks=GOOD)
    field.run_for(1)

    code, text = field.blocked(waiting)
    assert code == "lockdown"
    wording(text)
    reply = field.driver.feed(Submit("Wait")).reply
    assert isinstance(reply, Refusal)
    assert reply.code == "lockdown"
    wording(reply.text)
    field.engine.state.lockdown = None
    field.run_for(2)
    assert field.task(waiting).status == "ACTIVE"
