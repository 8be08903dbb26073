"""Site files: places in metres and degrees, ports, people, agents."""

from itertools import combinations
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position, horizontal_m
from formiga_bt.lang.expressions import Scope, compile_expr
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Catalogue, EvalError, Site
from formiga_bt.lang.request.binding import SiteEnv
from formiga_bt.lang.site import load_site, load_site_text
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import POSITION
from tests.golden import Wording

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

        assert len(homes) == len(set(homes)) == 5
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
            "transports: {zenoh: {listen: tcp/127.0.0.1:7447}}\n"
        )

        assert found.fence == found.regions["field"]
        assert len(found.no_fly) == 1
        assert found.ports["p1"].waiting == Position(5.0, 0.0, 40.0)
        assert (found.relief_m, found.mode) == (5.0, "real")
        assert found.pilots == {"anna": 3, "ben": 1}
        assert found.transports == {"zenoh": {"listen": "tcp/127.0.0.1:7447"}}

    def test_defaults(self) -> None:
        found = read("")

        assert (found.layers_m, found.separation_m, found.mode) == ((60.0, 75.0, 90.0), 15.0, "simulation")
        assert found.ground_msl_m == 120.0
        assert (found.min_spacing_m, found.preflight, found.heights) == (3.0, False, None)
        assert (found.envelope, found.on_breach, found.pilots) == ({}, {}, {})
        assert found.resume_hold_after_us == 30_000_000


class TestSafety:
    def test_limits_reactions_pilots_and_preflight(self) -> None:
        found = read(
            "envelope: {reserve: 30 %, max_height: 100 m, wind_max: 28.8 km/h, daylight_only: true, keep_in: fence}\n"
            "on_breach: {reserve: return, keep_out: hold}\n"
            "preflight: required\nmin_spacing: 6 m\n"
            "people: {approvers: [dora]}\nmode: real\npilots: [{id: anna, max_airborne: 3}]\n"
        )

        assert found.envelope == {"reserve_pct": 30.0, "max_height_m": 100.0, "wind_max_m_s": 8.0, "daylight_only": 1.0}
        assert found.on_breach == {"reserve": "return", "keep_out": "hold"}
        assert (found.preflight, found.min_spacing_m) == (True, 6.0)
        assert (found.pilots, found.people) == ({"anna": 3}, {"approvers": ("dora",)})

    @pytest.mark.parametrize(
        ("text", "policy"),
        [("", "closest"), ("allocator: {policy: closest}\n", "closest"), ("allocator: {policy: optimal}\n", "optimal")],
    )
    def test_how_agents_are_chosen(self, text: str, policy: str) -> None:
        found = read(text)

        assert found.policy == policy
        assert found.covered == read("").covered, "an approval covers what a task does, not who does it"

    def test_a_policy_that_there_is_not(self) -> None:
        _, (said,), _ = load_site_text(f"{HEAD}allocator: {{policy: best}}\n", "site.yaml")

        assert (said.code, said.mark.col) == ("E008", 21)

    @pytest.mark.parametrize(("text", "us"), [("0 s", 0), ("5 s", 5_000_000), ("10 min", 600_000_000)])
    def test_after_how_long_an_outage_tasks_wait(self, text: str, us: int) -> None:
        assert read(f"resume_hold_after: {text}\n").resume_hold_after_us == us

    @pytest.mark.parametrize("text", ["-1 s", "11 min", "1 h"])
    def test_an_outage_of_more_than_ten_minutes_always_waits(self, text: str, wording: Wording) -> None:
        _, (said,), _ = load_site_text(f"{HEAD}resume_hold_after: {text}\n", "site.yaml")
        assert said.code == "E062"
        wording(said.message, said.help)

    def test_a_limit_looser_than_all_types_of_the_site_changes_nothing_and_is_told(
        self, catalogue: Catalogue, wording: Wording
    ) -> None:
        text = HEAD + "envelope: {max_height: 120 m, reserve: 10 %}\n"
        found, problems, _ = load_site_text(text, "site.yaml", catalogue)

        assert found is not None
        assert [(d.code, d.mark.col) for d in problems] == [("W081", 40)]
        wording(problems[0].message)

    def test_a_limit_that_binds_one_of_several_types_is_no_mistake(self, tmp_path: Path, catalogue: Catalogue) -> None:
        kite = replace(
            catalogue.types["lwd"], name="kite", limits={**catalogue.types["lwd"].limits, "max_height_m": 95.0}
        )
        both = replace(catalogue, types={**catalogue.types, "kite": kite})
        text = HEAD + (
            "envelope: {max_height: 100 m}\n"
            "ports: {p1: {at: base}, p2: {at: {east: 20 m, north: 0 m}}}\n"
            "agents: {k: {type: kite, home: p1}, h: {type: hwd, home: p2}}\n"
        )
        found, problems, _ = load_site_text(text, str(tmp_path / "site.yaml"), both)

        assert found is not None
        assert problems == []


class TestHeightFile:
    def site(self, folder: Path, relief: str = "2 m") -> Site:
        (folder / "hill.asc").write_text(
            "ncols 3\nnrows 3\nxllcenter -100\nyllcenter -100\ncellsize 100\n140 140 140\n140 120 160\n140 140 -9999\n"
        )
        file = folder / "site.yaml"
        file.write_text(HEAD + f"terrain: {{file: hill.asc, relief: {relief}}}\n")
        found, problems, _ = load_site(file)
        assert problems == []
        assert found is not None
        return found

    def test_heights_are_over_the_bases_ground(self, tmp_path: Path) -> None:
        site = self.site(tmp_path)

        assert site.heights.ground_m(100.0, 0.0) == 40.0
        assert site.relief_m == 2.0

    def test_above_a_place_is_over_the_ground_there(self, tmp_path: Path, wording: Wording) -> None:
        env = SiteEnv(self.site(tmp_path))

        assert env.ground_up_m(Place(50.0, 0.0)) == 20.0
        with pytest.raises(EvalError) as refused:
            env.ground_up_m(Place(100.0, -100.0))
        wording(refused.value)

    def test_the_helper_above_follows_the_ground_and_at_height_does_not(self, tmp_path: Path) -> None:
        env = SiteEnv(self.site(tmp_path))
        for helper, up_m in (("above", 50.0), ("at_height", 30.0)):
            text = f"{helper}(offset(base, east=50 m), 30 m)"
            expr, problems = compile_expr(text, Scalar(text, Mark("t.yaml", 1, 1)), 0, Scope({}), POSITION)
            assert problems == []
            assert expr.run(env) == Position(50.0, 0.0, up_m)

    def test_a_changed_height_file_is_another_site(self, tmp_path: Path) -> None:
        one = self.site(tmp_path)
        before = one.digest
        file = tmp_path / "hill.asc"
        file.write_text(file.read_text().replace("160", "161"))
        other, _, _ = load_site(tmp_path / "site.yaml")

        assert other is not None
        assert other.digest != before

    def test_a_file_that_is_much_too_large_is_not_read(self, tmp_path: Path) -> None:
        self.site(tmp_path)
        with (tmp_path / "hill.asc").open("wb") as file:
            file.truncate(100_000_001)  # a hole, which takes no room on the disk
        _, (problem,), _ = load_site(tmp_path / "site.yaml")

        assert problem.code == "E086"
        assert "100 MB" in problem.message


class TestTasksOnASite:
    TASK = (
        "formiga: 1\ntask: Look\nimports: [lib/flying.yaml]\n{more}"
        'agents:\n  drone: {{type: hwd, near: "${{base}}"}}\n'
        "steps:\n  - do: drone.TakeOff\n    with: {{altitude: 70 m}}\n"
        "  - call: ReturnHome\n    with:\n      drone: ${{drone}}\n"
    )

    def problems(self, more: str, site: str, catalogue: Catalogue) -> list[str]:
        text = self.TASK.format(more=more)
        loaded = load_task_text(text, "look.yaml", catalogue=catalogue, site=read(site))
        return [f"{d.code}: {d.message}" for d in loaded.diagnostics]

    def test_the_ceiling_of_the_site_counts(self, catalogue: Catalogue, wording: Wording) -> None:
        site = "layers: [40 m]\nenvelope: {max_height: 65 m}\n"

        wording(self.problems("", site, catalogue))

    def test_a_task_below_all_layers_could_not_cross(self, catalogue: Catalogue, wording: Wording) -> None:
        wording(self.problems("envelope: {max_height: 72 m}\n", "layers: [75 m, 90 m]\n", catalogue))

    def test_a_task_may_tighten_what_the_site_has(self, catalogue: Catalogue) -> None:
        site = "envelope: {max_height: 100 m, reserve: 30 %}\n"

        assert self.problems("envelope: {max_height: 80 m, reserve: 30 %}\n", site, catalogue) == []

    def test_a_task_may_not_loosen_what_the_site_has(self, catalogue: Catalogue, wording: Wording) -> None:
        site = "envelope: {max_height: 100 m, daylight_only: true}\n"

        wording(self.problems("envelope: {max_height: 110 m, daylight_only: false}\n", site, catalogue))

    def test_the_task_keeps_what_it_tightens(self, catalogue: Catalogue) -> None:
        text = self.TASK.format(more="envelope: {reserve: 40 %, wind_max: 5 m/s}\n")
        loaded = load_task_text(text, "look.yaml", catalogue=catalogue)
        without = load_task_text(self.TASK.format(more=""), "look.yaml", catalogue=catalogue)

        assert loaded.task is not None
        assert without.task is not None
        assert loaded.task.envelope == {"reserve_pct": 40.0, "wind_max_m_s": 5.0}
        assert loaded.task.bundle != without.task.bundle

    def test_drones_of_one_task_keep_the_spacing_of_the_site(self, catalogue: Catalogue, wording: Wording) -> None:
        text = (
            "formiga: 1\ntask: Pair\nimports: [lib/flying.yaml]\n"
            'agents:\n  one: {type: lwd, near: "${base}"}\n  two: {type: lwd, near: "${base}"}\n'
            "steps:\n  - do: one.TakeOff\n  - do: two.TakeOff\n  - parallel:\n"
            "      - do: one.GoTo\n        with: {to: {east: 0 m, north: 0 m, height: 40 m}}\n"
            "      - do: two.GoTo\n        with: {to: {east: 5 m, north: 0 m, height: 40 m}}\n"
            "  - call: ReturnHome\n    with: {drone: '${one}'}\n  - call: ReturnHome\n    with: {drone: '${two}'}\n"
        )

        def messages(site: str) -> list[str]:
            loaded = load_task_text(text, "pair.yaml", catalogue=catalogue, site=read(site))
            return [d.message for d in loaded.diagnostics]

        assert messages("") == []
        wording(messages("min_spacing: 6 m\n"))
