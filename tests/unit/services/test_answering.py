"""An answer at the desk is told to be there when the engine has it, on disk; in virtual time."""

from collections.abc import Callable

import pytest

from formiga_bt.base.clock import SECOND, VirtualScheduler
from formiga_bt.engine.drivers.virtual import VirtualDriver
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.engine.kernel.replies import Accepted, Done
from formiga_bt.rehearsal.testing import packaged_world, task_of
from formiga_bt.services.answering import Answering
from formiga_bt.services.refused import Refused
from formiga_bt.transport.desk import DeskTransport, OpenQuestion
from tests.golden import Wording

ASK = """
agents: {w: {type: watcher}}
steps:
  - {ask: Shall it land?, of: [w], options: ['yes', 'no'], timeout: 10 min}
"""


class Room:
    """An engine, and a person at its desk who is asked."""

    def __init__(self) -> None:
        site, catalogue = packaged_world()
        self.scheduler = VirtualScheduler(10**12)
        self.desk = DeskTransport(now=self.scheduler.now, boot_id="desk-1")
        self.desk.add_person("watcher_1", "watcher")
        self.engine = Engine(site, catalogue, {"Try": task_of(ASK, site, catalogue)})
        self.kept = 10**9
        self.answering = Answering(self.desk, lambda: self.kept, within_s=0.0)
        self.driver = VirtualDriver(self.engine, [self.desk], self.scheduler, listeners=[self.answering.feed_step])
        self.driver.start()
        self.run(1.5)
        reply = self.driver.feed(inp.Submit("Try", {})).reply
        assert isinstance(reply, Accepted)
        self.task = reply.task
        self.run(2.0)

    def run(self, seconds: float) -> None:
        self.driver.drain()
        limit = self.scheduler.now() + round(seconds * SECOND)
        while self.driver.run_one(limit):
            pass
        self.scheduler.advance_to(limit)
        self.driver.drain()

    def asked(self) -> OpenQuestion:
        (question,) = self.desk.open_questions()
        return question

    def once_answered(self, *do: Callable[[], object]) -> None:
        """Do this when the desk has the answer, in the place of the driver's thread."""

        def wake() -> None:
            self.desk.open(lambda: None)
            for one in do:
                one()

        self.desk.open(wake)


@pytest.fixture
def room() -> Room:
    return Room()


def test_who_answers_is_told_once_the_engine_has_it(room: Room) -> None:
    room.once_answered(room.driver.drain)
    assert room.answering.answer(room.asked(), "yes") == Done()
    assert room.engine.state.tasks[room.task].status == "SUCCEEDED"


def test_an_answer_that_is_not_on_disk_is_told_to_be_unkept(room: Room) -> None:
    room.kept = 0
    room.once_answered(room.driver.drain)
    assert room.answering.answer(room.asked(), "yes") == Done(kept=False)
    assert room.engine.state.tasks[room.task].status == "SUCCEEDED"


def test_an_answer_that_came_too_late_is_refused(room: Room, wording: Wording) -> None:
    room.once_answered(lambda: room.driver.feed(inp.Abort(room.task)), room.driver.drain)
    with pytest.raises(Refused) as told:
        room.answering.answer(room.asked(), "yes")
    wording(told.value)
    assert told.value.code == "answer_late"


def test_an_answer_that_the_engine_does_not_take_is_not_told_to_be_there(room: Room, wording: Wording) -> None:
    with pytest.raises(Refused) as told:
        room.answering.answer(room.asked(), "yes")
    wording(told.value)
    assert told.value.code == "no_reply"
    wording(told.value.help)


def test_nothing_wrong_is_handed_in(room: Room, wording: Wording) -> None:
    with pytest.raises(Refused) as told:
        room.answering.answer(room.asked(), "maybe")
    wording(told.value)
    assert told.value.code == "bad_option"
    question = room.asked()
    assert not room.answering._waiting
    room.answering.close()
    with pytest.raises(Refused) as told:
        room.answering.answer(question, "yes")
    wording(told.value)
    assert told.value.code == "stopped"
    assert room.asked() == question


def test_who_waits_when_the_engine_stops_is_told(room: Room, wording: Wording) -> None:
    room.once_answered(room.answering.close)
    with pytest.raises(Refused) as refused:
        room.answering.answer(room.asked(), "yes")
    wording(refused.value)
