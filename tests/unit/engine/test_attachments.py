"""Files that agents name: beside the step, with the question; what is wrong with one costs that one only."""

from typing import Any

from msgspec.structs import replace

from formiga_bt.engine.kernel.files import MOST_FILES
from formiga_bt.engine.kernel.inputs import Alarm, GoalEventInput
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, effects, packaged_world, task_of
from formiga_bt.show.history.records import file_facts, question_fact
from formiga_bt.transport.attachments import Attachment, attachment_of
from formiga_bt.transport.messages import GoalEvent
from tests.reloading import reloaded

SITE, CATALOGUE = packaged_world()
LOOK = task_of(
    """
agents: {drone: {type: hwd}, watcher: {type: watcher}}
steps:
  - do: drone.TakeOff
  - ask: Is that it?
    of: [watcher]
    options: [yes_it_is, no_it_is_not]
    timeout: 10 min
  - do: drone.LandIn
    with: {at: "${drone.home}"}
""",
    SITE,
    CATALOGUE,
)
PHOTO = attachment_of("roof.jpg", b"photo", "image/jpeg")


def flying() -> tuple[Bench, ScriptedAgent, str]:
    made = Bench(SITE, CATALOGUE, [LOOK])
    drone = made.agent("hwd_1", "hwd")
    made.agent("watcher_1", "watcher")
    made.run_for(2)
    task = made.submit("Try", {})
    made.run_for(10)
    return made, drone, task


def ends(made: Bench, drone: ScriptedAgent, *files: Attachment) -> None:
    drone._fields["position"] = replace(drone._fields["position"], up_m=30.0)
    drone._fields["landed"] = "airborne"
    drone.side.set_status(**drone._fields)
    drone.side.finish(drone.goal.goal_id, "succeeded", attachments=files)
    made.run_for(3)


def test_a_file_stands_beside_the_step_and_with_the_question() -> None:
    made, drone, task = flying()
    ends(made, drone, PHOTO)
    record = made.task(task)
    (fact,) = file_facts(record)
    assert (fact.agent, fact.what, fact.name, fact.size) == ("hwd_1", "TakeOff", "roof.jpg", 5)
    assert fact.path == "steps/steps[0]"
    assert PHOTO.sha256 in fact.url
    (question,) = made.engine.state.questions.values()
    assert [one.name for one in question_fact(made.engine.state, question).files] == ["roof.jpg"]
    shown = next(one for one in made.engine.state.goals.values() if one.action == "Confirm")
    assert shown.fields["attachments"][0]["sha256"] == PHOTO.sha256
    made.check()


def test_what_is_wrong_with_a_file_costs_that_file_only() -> None:
    made, drone, task = flying()
    ends(made, drone, replace(PHOTO, name="../../etc/passwd"), PHOTO, replace(PHOTO, sha256="short"))
    assert [one.file.name for one in made.task(task).files.found] == ["roof.jpg"]
    (said,) = [one.text for one in effects(made, Alarm) if one.code == "attachment_refused"]
    assert "passwd" in said
    assert "sha256" in said
    assert made.record("hwd_1").bad == 0
    assert made.task(task).status == "ACTIVE"


def test_a_repeated_result_names_a_file_once_and_the_oldest_are_forgotten() -> None:
    made, drone, task = flying()
    goal = drone.goal.goal_id

    def news(n: int, *files: Attachment) -> None:
        event = GoalEvent(goal_id=goal, agent="hwd_1", state="running", n=n, attachments=files)
        made.driver.feed(GoalEventInput(event, made.now, made.now))

    news(10, PHOTO)
    news(11, PHOTO)
    assert len(made.task(task).files.found) == 1
    for n in range(12, 12 + MOST_FILES // 10 + 1):
        news(n, *(replace(PHOTO, name=f"{n}-{k}.jpg") for k in range(10)))
    found = made.task(task).files.found
    assert len(found) == MOST_FILES
    assert "roof.jpg" not in [one.file.name for one in found]


def test_files_outlive_a_snapshot() -> None:
    made, drone, task = flying()
    ends(made, drone, PHOTO)
    state: Any = reloaded(made.engine.state)
    state = state[0] if isinstance(state, tuple) else state
    assert state.tasks[task].files == made.task(task).files
