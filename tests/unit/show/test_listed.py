"""How agents are listed: numbers count as numbers, machines before people, a port or a station by its name."""

import pytest
from msgspec.structs import replace

from formiga_bt.base.geo import Position
from formiga_bt.base.machines import Mobility
from formiga_bt.lang.model import Station
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.show.facts import AgentFact, Point
from formiga_bt.show.listed import listing, natural, port_of, where_words
from tests.unit.services.fakes import machine


def test_numbers_in_names_count_as_numbers() -> None:
    names = ["hwd_10", "hwd_2", "hwd_1b", "hwd_1", "HWD_3", "7", "hwd_02", "hwd", "\u0661x"]
    assert sorted(names, key=natural) == [
        "7",
        "hwd",
        "hwd_1",
        "hwd_1b",
        "hwd_02",
        "hwd_2",
        "HWD_3",
        "hwd_10",
        "\u0661x",
    ]


def test_machines_come_before_people() -> None:
    people = [machine("adam", mobility="people")]
    assert [one.id for one in sorted([*people, machine("hwd_10"), machine("hwd_9")], key=listing)] == [
        "hwd_9", "hwd_10", "adam",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("landed", "off_m", "is_there"), [("grounded", 0.5, True), ("grounded", 40.0, False), ("airborne", 0.5, False)]
)
def test_a_machine_that_stands_at_a_port_is_at_that_port(landed: str, off_m: float, is_there: bool) -> None:
    site, _ = packaged_world()
    port = next(iter(site.ports.values()))
    at = Position(port.at.east_m, port.at.north_m + off_m, 0.0)
    assert port_of(site, replace(machine("hwd_1"), landed=landed, position=at)) == (port.name if is_there else "")


def test_a_ground_robot_stands_at_a_station_and_never_at_a_port() -> None:
    site, _ = packaged_world()
    port = next(iter(site.ports.values()))
    site = replace(site, stations={"s1": Station("s1", port.at)})
    at = Position(port.at.east_m, port.at.north_m, 0.0)
    rover = replace(machine("rover_1", mobility="ground"), landed="grounded", position=at)
    door = replace(machine("door_1", mobility="fixed"), landed="grounded", position=at)
    assert port_of(site, rover) == "s1"
    assert port_of(site, door) == ""


@pytest.mark.parametrize(
    ("mobility", "charge", "where"),
    [
        ("air", "40 %", "12 E -3 N 30 up"),
        ("ground", "40 %", "12 E -3 N"),
        ("fixed", "", "12 E -3 N"),
        ("none", "", "12 E -3 N"),
        ("people", "", "12 E -3 N"),
    ],
)
def test_only_what_flies_has_a_height_and_only_what_moves_a_charge(mobility: Mobility, charge: str, where: str) -> None:
    fact = AgentFact(id="one", type="one", mobility=mobility, battery=40.2, at=Point(12.1, -3.2, 30.0))
    assert (fact.charge, where_words(fact)) == (charge, where)
