"""The flight log (services.flightlog): one record a flight, over restarts too."""

import csv
import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import SiteError
from formiga_bt.base.geo import Position
from formiga_bt.base.site_folder import FLIGHTS, FLYING
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.inputs import Alarm, EngineStep, Operator, OperatorOrder, Started
from formiga_bt.engine.kernel.records import AgentRecord, StandingOrder
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import packaged_task, packaged_world, task_of
from formiga_bt.services.kept import flightlog
from formiga_bt.services.kept.flightlog import Flight, FlightLog, Flights, as_csv, as_json, flights, flying, iso
from tests.golden import Wording

HOP = """\
imports: [lib/flying.yaml]
agents: {drone: {type: lwd, id: lwd_1}}
steps:
  - do: drone.TakeOff
  - wait: 30 s
  - call: ReturnHome
    with: {drone: '${drone}'}
"""
MINUTE = 60_000_000


def flown(*texts: str, abort: bool = False, stop: OperatorOrder | None = None) -> list[Flight]:
    """Fly a task on simulated drones; return what the log says of it."""
    site, catalogue = packaged_world()
    tasks = [task_of(text, site, catalogue) for text in texts] or [packaged_task("move_task")]
    rehearsal = Rehearsal(site, catalogue, tasks, fleet_of(site, catalogue))
    rehearsal.run_for(2)
    task_id = rehearsal.submit(tasks[0].name, {}, by="rita")
    if abort:
        rehearsal.run_until(lambda: rehearsal.engine.state.agents["lwd_1"].landed == "airborne")
        rehearsal.run_for(10)
        rehearsal.abort(task_id)
    if stop is not None:
        rehearsal.run_until(lambda: rehearsal.engine.state.agents["lwd_1"].landed == "airborne")
        rehearsal.run_for(10)
        rehearsal.ask(Operator(stop, "lwd_1", "olga"))
        assert rehearsal.run_until(lambda: rehearsal.engine.state.agents["lwd_1"].landed == "grounded", 300)
        rehearsal.abort(task_id)
    assert rehearsal.run_until_ended(task_id)
    rehearsal.run_for(5)
    log = Flights(site)
    found = [flight for step in rehearsal.steps for flight in log.take(step)]
    rehearsal.close()
    assert log.flying == {}
    return found


def test_a_flight_has_its_task_places_times_and_charge() -> None:
    (flight,) = flown(HOP)

    assert (flight.agent, flight.type, flight.mode, flight.pilot) == ("lwd_1", "lwd", "simulation", "")
    assert (flight.task, flight.task_name, flight.requester) == ("Try-1", "Try", "rita")
    assert flight.take_off_utc.startswith("1970-01-12T13:46:")
    assert flight.take_off_utc < flight.landing_utc
    assert flight.duration_s is not None
    assert 60 < flight.duration_s < 300
    port = packaged_world()[0].ports["p1"].at
    assert (flight.take_off_east_m, flight.take_off_north_m) == (port.east_m, port.north_m)
    assert (flight.landing_east_m, flight.landing_north_m) == pytest.approx((port.east_m, port.north_m), abs=1)
    assert flight.landing_lat_deg == pytest.approx(66.5, abs=0.01)
    assert flight.battery_used_percent is not None
    assert 2 < flight.battery_used_percent < 20
    assert (flight.landed_by, flight.landed_why) == ("task", "LandIn")
    assert (flight.breaches, flight.orders) == ((), ())


def test_one_that_recover_brought_home_says_so() -> None:
    (flight,) = flown(HOP, abort=True)
    assert (flight.landed_by, flight.landed_why) == ("recover", "LandIn, Try-1")


@pytest.mark.parametrize("stop", ["return", "land"])
def test_one_that_an_order_brought_down_says_whose(stop: OperatorOrder) -> None:
    (flight,) = flown(HOP, stop=stop)
    assert (flight.landed_by, flight.landed_why) == ("order", f"{stop} by olga")
    assert flight.orders == (f"{stop} by olga",)


# -- steps by hand -----------------------------------------------------------------------------------------------------
class Story:
    """Steps about one drone, a minute apart."""

    def __init__(self, log: Flights) -> None:
        self.log = log
        self.at = 1_800_000_000_000_000

    def step(self, *changes: ch.Change, alarm: Alarm | None = None) -> list[Flight]:
        self.at += MINUTE
        return self.log.take(EngineStep(1, self.at, Started(1), changes, (alarm,) if alarm else ()))

    def drone(self, landed: str, battery: float = 90.0, **more: object) -> list[Flight]:
        where = Position(10.0, 20.0, 0.0 if landed == "grounded" else 40.0)
        fields = {"id": "d1", "type": "lwd", "landed": landed, "battery": battery, "position": where, **more}
        return self.step(ch.AgentPut(AgentRecord(**{"control": "engine", "liveness": "ALIVE", **fields})))


def story() -> Story:
    return Story(Flights(packaged_world()[0]))


def test_a_flight_begins_when_the_ground_is_left_and_a_doubt_alone_is_none() -> None:
    told = story()
    assert told.drone("grounded") == []
    assert told.drone("unknown") == []
    assert told.drone("grounded") == []
    told.drone("unknown")
    told.drone("airborne")
    (flight,) = told.drone("grounded", battery=85.0)
    assert (flight.duration_s, flight.battery_used_percent) == (120.0, 5.0)
    assert told.drone("grounded") == []


@pytest.mark.parametrize(
    ("more", "by"),
    [
        ({"control": "pilot"}, "pilot"),
        ({"control": "failsafe"}, "failsafe"),
        ({"taken": True}, "pilot"),
        ({}, "unknown"),
    ],
)
def test_who_else_brought_it_down(more: dict[str, object], by: str) -> None:
    told = story()
    told.drone("grounded")
    told.drone("airborne", **more)
    (flight,) = told.drone("grounded")  # on the ground the control is the engine's again
    assert flight.landed_by == by


def test_orders_and_breaches_of_the_flight_are_kept_each_once(wording: Wording) -> None:
    told = story()
    told.drone("grounded")
    told.drone("airborne")
    order = StandingOrder(agent="d1", stop="return", by="engine", scope="engine", why="envelope.reserve", at=1)
    told.step(ch.OrderPut("d1", order), alarm=Alarm("envelope.reserve", "low", "Try-1", "d1"))
    told.drone("airborne", breach="reserve")
    told.step(ch.OrderPut("d1", order))
    (flight,) = told.drone("grounded")

    assert flight.breaches == ("reserve",)
    wording(flight.orders)
    assert flight.landed_by == "order"


# -- files -------------------------------------------------------------------------------------------------------------
def log_in(folder: Path) -> tuple[FlightLog, Story]:
    log = FlightLog(folder, replace(packaged_world()[0], mode="real"), iso)
    log.start()
    told = story()
    told.log = Passing(log)
    return log, told


class Passing(Flights):
    """Hands steps to a log that writes files."""

    def __init__(self, log: FlightLog) -> None:
        self.to = log

    def take(self, step: EngineStep) -> list[Flight]:
        self.to.feed_step(step)
        return []


def test_a_flight_goes_on_over_a_restart_of_the_engine(tmp_path: Path) -> None:
    log, told = log_in(tmp_path)
    told.drone("grounded")
    told.drone("airborne", battery=85.0)
    log.stop()
    assert [f.landing_utc for f in flights(tmp_path)] == [""]

    log, told = log_in(tmp_path)
    told.at += 10 * MINUTE
    told.drone("unknown")
    told.drone("airborne", battery=70.0)
    told.drone("grounded", battery=60.0)
    log.stop()

    (flight,) = flights(tmp_path)
    assert (flight.mode, flight.battery_used_percent, flight.duration_s) == ("real", 30.0, 11 * 60.0)
    assert flying(tmp_path) == {}


def test_one_that_landed_while_no_engine_ran_is_closed(tmp_path: Path) -> None:
    log, told = log_in(tmp_path)
    told.drone("airborne")
    log.stop()
    log, told = log_in(tmp_path)
    told.drone("grounded")
    log.stop()
    (flight,) = flights(tmp_path)
    assert (flight.landed_by, bool(flight.landing_utc)) == ("unknown", True)


def test_a_line_that_a_power_cut_cut_short_is_passed_over_and_the_next_stands_alone(tmp_path: Path) -> None:
    log, told = log_in(tmp_path)
    told.drone("airborne")
    told.drone("grounded")
    told.drone("airborne")
    log.stop()
    file = tmp_path / FLIGHTS
    file.write_text(file.read_text() + '{"agent": "d1", "ty', encoding="utf-8")

    log, told = log_in(tmp_path)
    told.drone("grounded")
    log.stop()

    assert len(flights(tmp_path)) == 2


def test_a_damaged_file_of_flights_under_way_is_told(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / FLYING).write_text("nonsense", encoding="utf-8")
    with pytest.raises(SiteError) as refused:
        FlightLog(tmp_path, packaged_world()[0])
    wording(refused.value)


def test_csv_and_json_say_the_same_and_a_name_is_no_formula() -> None:
    (flight,) = flown(HOP)
    flight = Flight(**{**{n: getattr(flight, n) for n in flight.__struct_fields__}, "requester": "=1+1"})
    (row,) = csv.DictReader(as_csv([flight]).splitlines())
    (same,) = json.loads(as_json([flight]))

    assert row["requester"] == "'=1+1"
    assert row["take_off_east_m"] == str(same["take_off_east_m"])
    assert list(row) == list(Flight.__struct_fields__)
    assert {"duration_s", "battery_used_percent", "take_off_lat_deg", "take_off_utc"} <= set(row)


def test_flights_since_an_instant(tmp_path: Path) -> None:
    log, told = log_in(tmp_path)
    for _ in range(3):
        told.drone("airborne")
        told.drone("grounded")
    log.stop()
    first, second, third = flights(tmp_path)
    assert flights(tmp_path, second.take_off_utc) == [second, third]
    assert flights(tmp_path, "2027-01-15T10:00+02:00") == [first, second, third]


def test_stamps_are_of_the_wall_and_durations_of_the_engine_and_never_negative() -> None:
    wall = iter(["2026-07-01T09:00:00Z", "2026-07-01T09:00:06Z", "2026-07-01T09:00:07Z"])
    log = Flights(packaged_world()[0], utc=lambda _: next(wall))
    story = Story(log)
    story.drone("grounded")
    story.drone("airborne")
    (flight,) = story.drone("grounded")
    assert (flight.take_off_utc, flight.landing_utc, flight.duration_s) == (
        "2026-07-01T09:00:00Z",
        "2026-07-01T09:00:06Z",
        60.0,
    )

    story.drone("airborne")
    story.at -= 10 * MINUTE  # an engine that was started anew counts from before
    log._utc = lambda _: "2026-07-01T09:01:00Z"
    (flight,) = story.drone("grounded")
    assert flight.duration_s == 0.0


def test_a_full_disk_is_told_once_in_words_and_no_flight_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, wording: Wording
) -> None:
    left = [2]
    whole = flightlog.append_line

    def full(file: Path, record: dict[str, object]) -> None:
        if left[0]:
            left[0] -= 1
            raise SiteError(f"cannot write {file}: No space left on device")
        whole(file, record)

    monkeypatch.setattr(flightlog, "append_line", full)
    log, told = log_in(tmp_path)
    for landed in ("airborne", "grounded", "airborne", "grounded"):
        told.drone(landed)
    log.stop()

    assert len(flights(tmp_path)) == 2
    assert flying(tmp_path) == {}
    (line,) = [record for record in caplog.records if record.levelname == "ERROR"]
    wording(line.message)
    assert line.exc_info is None
