"""Site files: places in metres and degrees, ports, people, agents."""

from itertools import combinations

import pytest

from formiga_bt.geo import Place, Position, horizontal_m
from formiga_bt.lang.model import Site
from formiga_bt.lang.site import load_site_text

HEAD = "formiga_site: 1\nname: north\nbase: {lat: 66.5, lng: 25.7, ground_msl: 120 m}\n"


def read(text: str) -> Site:
    found, problems, _ = load_site_text(HEAD + text, "site.yaml")

    assert problems == []
    assert found is not None
    return found


class TestDemoSite:
    def test_ports_are_at_least_20_m_apart(self, demo_site: Site) -> None:
        assert len(demo_site.ports) == 8
        for one, other in combinations(demo_site.ports.values(), 2):
            assert horizontal_m(one.at, other.at) >= 20.0
            assert horizontal_m(one.waiting, other.waiting) >= 15.0

    def test_every_drone_has_a_port_of_its_own(self, demo_site: Site) -> None:
        homes = [agent.home for agent in demo_site.agents.values() if agent.type in ("lwd", "hwd")]

        assert len(homes) == len(set(homes)) == 4
        assert demo_site.people == {"watchers": ("watcher_1",)}
        assert demo_site.layers_m == (60.0, 75.0, 90.0)

    def test_fields_lie_150_to_300_m_away(self, demo_site: Site) -> None:
        base = Place(0.0, 0.0)

        assert all(150 <= horizontal_m(base, at) <= 300 for name, at in demo_site.places.items() if "field" in name)


class TestPlaces:
    def test_degrees_become_metres(self) -> None:
        found = read("places:\n  far: {lat: 66.501, lng: 25.7}\n")

        assert found.places["far"].east_m == pytest.approx(0.0, abs=0.01)
        assert found.places["far"].north_m == pytest.approx(111.5, abs=0.2)

    def test_a_place_may_be_another_one_in_any_order(self) -> None:
        found = read("places:\n  two: one\n  one: {east: 5 m, north: -1 km}\n  zero: base\n")

        assert found.places == {"two": Place(5.0, -1000.0), "one": Place(5.0, -1000.0), "zero": Place(0.0, 0.0)}

    def test_regions_fences_and_waiting_points(self) -> None:
        found = read(
            "places: {a: {east: 0 m, north: 0 m}}\n"
            "regions:\n  field: [a, {east: 9 m, north: 0 m}, {east: 9 m, north: 9 m}]\n"
            "fence: field\nno_fly:\n  - [{east: 7 m, north: 1 m}, {east: 8 m, north: 1 m}, {east: 8 m, north: 2 m}]\n"
            "ports: {p1: {at: a, waiting: {east: 5 m, north: 0 m, height: 40 m}}}\n"
            "terrain: {flat: true, relief: 5 m}\nmode: real\npilots: [{id: anna, max_airborne: 3}, {id: ben}]\n"
            "transports: {zenoh: {listen: [tcp/127.0.0.1:7447]}}\n"
        )

        assert found.fence == found.regions["field"]
        assert len(found.no_fly) == 1
        assert found.ports["p1"].waiting == Position(5.0, 0.0, 40.0)
        assert (found.relief_m, found.mode) == (5.0, "real")
        assert found.pilots == {"anna": 3, "ben": 1}
        assert found.transports == {"zenoh": {"listen": ["tcp/127.0.0.1:7447"]}}

    def test_defaults(self) -> None:
        found = read("")

        assert (found.layers_m, found.separation_m, found.mode) == ((60.0, 75.0, 90.0), 15.0, "simulation")
        assert found.ground_msl_m == 120.0
