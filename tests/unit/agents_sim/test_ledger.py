"""Files that outlive a process: the body's state, and the ledger that a referee can judge later."""

from pathlib import Path

import pytest

from agents_sim.ledger import BodyFile, Ledger, MotionNote, NoteTaker, Saved, judge
from agents_sim.motion import BodyState, Segment
from agents_sim.referee import Referee
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Position
from tests.golden import Wording

LEG = Segment(0, Position(0.0, 0.0, 60.0), 10 * SECOND, Position(100.0, 0.0, 60.0))
BODY = BodyState(LEG, "cruise", 80.0, 0, 0.1, Place(0.0, 0.0))


def test_a_body_is_found_hovering_where_its_process_died(tmp_path: Path) -> None:
    file = BodyFile(tmp_path, "d")
    assert file.load() is None
    file.save(Saved(body=BODY, engine_us=4 * SECOND, wall_us=0, speed=10.0))
    saved = BodyFile(tmp_path, "d").load()
    assert saved is not None
    assert saved.body == BODY

    found = saved.body.found_at(104 * SECOND, saved.engine_us, hover_percent_s=0.05)
    assert found.segment.at(104 * SECOND) == Position(40.0, 0.0, 60.0)
    assert (found.kind, found.battery) == ("hover", pytest.approx(80.0 - 4 * 0.1 - 100 * 0.05))


def test_a_drone_that_touched_down_before_it_died_stands(tmp_path: Path) -> None:
    down = Segment(0, Position(0.0, 0.0, 30.0), 10 * SECOND, Position(0.0, 0.0, 0.0))
    body = BodyState(down, "descend", 80.0, 0, 0.1)
    assert body.found_at(99 * SECOND, 11 * SECOND, hover_percent_s=0.05).kind == "rest"
    assert body.found_at(99 * SECOND, 9 * SECOND, hover_percent_s=0.05).kind == "hover"


def test_a_broken_body_file_is_named(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "d.body.json").write_text("{")
    with pytest.raises(ValueError, match="body") as refused:
        BodyFile(tmp_path, "d").load()
    wording(refused.value)


def test_a_referee_judges_ledgers_as_it_judges_live(tmp_path: Path) -> None:
    for agent, north_m in (("a", 0.0), ("b", 1.5)):
        ledger = Ledger(tmp_path, agent)
        notes = NoteTaker(ledger.write)
        notes.rotors_started(agent, 0, Place(0.0, north_m), None)
        there, back = Position(0.0, north_m, 60.0), Position(100.0, north_m, 60.0)
        ends = (there, back) if agent == "a" else (back, there)
        notes.moved(agent, Segment(0, ends[0], 10 * SECOND, ends[1]), "cruise")
        ledger.close()
    people = Ledger(tmp_path, "p")
    NoteTaker(people.write).person_at("p", 0, Place(500.0, 0.0))
    people.close()

    referee = Referee()
    verdict = referee.verdict(judge(tmp_path, referee))
    assert [(crash.at, crash.distance_m) for crash in verdict.crashes] == [(5 * SECOND, 1.5)]
    assert verdict.unsafe_starts == ()


def test_what_was_said_beyond_a_clock_that_went_back_is_void(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path, "a")
    for t0 in (0, 100, 200, 50):
        at = Position(float(t0), 0.0, 60.0)
        ledger.write(MotionNote("a", Segment(t0 * SECOND, at, t0 * SECOND, at), "hover"))
    ledger.close()
    with (tmp_path / "a.motion.jsonl").open("ab") as file:
        file.write(b'{"type":"motion","agent"')  # its writer died

    told: list[int] = []

    class Listener(Referee):
        def moved(self, agent: str, segment: Segment, kind: str) -> None:
            told.append(segment.t0 // SECOND)

    assert judge(tmp_path, Listener()) == 50 * SECOND
    assert told == [0, 50]


def test_a_drone_that_died_in_flight_and_was_not_found_hovers_for_the_referee(tmp_path: Path) -> None:
    """It was to fly through another one, but its process died before."""
    for agent in ("a", "b"):
        ledger = Ledger(tmp_path, agent)
        there = LEG if agent == "a" else Segment(0, LEG.p1, 20 * SECOND, LEG.p1)
        NoteTaker(ledger.write).moved(agent, there, "cruise" if agent == "a" else "hover")
        ledger.close()
    referee = Referee()
    assert len(referee.verdict(judge(tmp_path, referee)).crashes) == 1
    BodyFile(tmp_path, "a").save(Saved(body=BODY, engine_us=4 * SECOND, wall_us=0, speed=10.0))
    referee = Referee()
    assert referee.verdict(judge(tmp_path, referee)).crashes == ()
