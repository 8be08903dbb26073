"""The catalogue: merged types, actions with units, the way home."""

from pathlib import Path

from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.model import Catalogue

LIMITS_OF_FLIGHT = {"speed_m_s", "climb_m_s", "cruise_drain_pct_s", "hover_drain_pct_s", "charge_pct_s", "payload_kg"}


class TestShippedCatalogue:
    def test_types_take_over_what_they_extend(self, catalogue: Catalogue) -> None:
        lwd, hwd = catalogue.types["lwd"], catalogue.types["hwd"]

        assert lwd.actions == ("TakeOff", "GoTo", "LandIn", "Explore")
        assert hwd.actions == ("TakeOff", "GoTo", "LandIn", "CutMotors")
        assert (lwd.extends, lwd.rest, lwd.label) == (("drone",), "grounded_at_port", "light drone")
        assert (lwd.limits["speed_m_s"], hwd.limits["speed_m_s"], hwd.limits["reserve_pct"]) == (8.0, 10.0, 25.0)
        assert (hwd.lost_after_us, hwd.suspect_after_us) == (30_000_000, 3_000_000)

    def test_drones_have_a_way_home_and_people_need_none(self, catalogue: Catalogue) -> None:
        recover = catalogue.types["hwd"].recover

        assert recover is not None
        assert recover.name == "ReturnHome"
        assert catalogue.types["picker"].recover is None
        assert (catalogue.types["picker"].human, catalogue.types["picker"].shared) == (True, True)

    def test_actions_say_what_they_need_and_change(self, catalogue: Catalogue) -> None:
        takeoff, goto, land = (catalogue.actions[name] for name in ("TakeOff", "GoTo", "LandIn"))

        assert (takeoff.requires, takeoff.effect, takeoff.starts_rotors) == ("grounded", "airborne", True)
        assert (goto.requires, goto.effect, goto.moves_to, goto.typical_us) == ("airborne", "", "to", 60_000_000)
        assert (land.requires, land.effect, land.lands, land.moves_to) == ("airborne", "grounded", True, "at")
        assert takeoff.fields["altitude"].max == 120.0
        assert takeoff.fields["altitude"].default is not None
        repeatable = {name for name, action in catalogue.actions.items() if action.repeatable}
        assert repeatable == {"TakeOff", "GoTo", "LandIn", "CutMotors", "Confirm", "MiniFinder"}
        assert [name for name, action in catalogue.actions.items() if action.cuts] == ["CutMotors"]

    def test_drones_can_be_fetched_and_landed(self, catalogue: Catalogue) -> None:
        lwd = catalogue.types["lwd"]

        assert lwd.fetch is not None
        assert lwd.land is not None
        assert (lwd.fetch.name, list(lwd.fetch.params)) == ("FetchHome", ["drone"])
        assert (lwd.land.name, list(lwd.land.params)) == ("LandNear", ["drone", "at"])
        assert (catalogue.types["picker"].fetch, catalogue.types["picker"].land) == (None, None)

    def test_limits_of_the_envelope_stand_among_the_limits(self, catalogue: Catalogue) -> None:
        limits = catalogue.types["hwd"].limits

        assert {key: limits[key] for key in limits if key not in LIMITS_OF_FLIGHT} == {
            "reserve_pct": 25.0,
            "max_height_m": 120.0,
            "terrain_clearance_m": 5.0,
            "people_clearance_m": 15.0,
            "link_silence_s": 10.0,
            "wind_max_m_s": 10.0,
            "daylight_only": 0.0,
        }
        assert catalogue.types["hwd"].on_breach == {
            "reserve": "return",
            "max_height": "hold",
            "terrain_clearance": "hold",
            "keep_in": "return",
            "keep_out": "hold",
            "wind_max": "return",
            "daylight_only": "return",
        }


def test_several_files_make_one_catalogue(tmp_path: Path, catalogue: Catalogue) -> None:
    winch = tmp_path / "winch.yaml"
    winch.write_text(
        "types:\n  crane: {extends: hwd, actions: [Winch], shared: false, lost_after: 1 min}\n"
        "actions:\n  Winch: {fields: {down: distance}, result: {held: {type: mass}}, concurrency: 2}\n"
    )
    base = Path(__file__).parents[3] / "actions" / "base.yaml"
    found, problems, sources = load_catalogue([base, winch])

    assert problems == []
    assert found.types["crane"].extends == ("hwd", "drone")
    assert found.types["crane"].actions[-1] == "Winch"
    assert found.types["crane"].lost_after_us == 60_000_000
    assert found.types["crane"].recover is not None
    assert found.actions["Winch"].concurrency == 2
    assert str(found.actions["Winch"].result["held"]) == "mass"
    assert str(winch) in sources
    assert found.digest != catalogue.digest


def test_a_name_is_defined_once(tmp_path: Path) -> None:
    one = tmp_path / "one.yaml"
    one.write_text("types:\n  hwd: {mobility: air}\n")
    two = tmp_path / "two.yaml"
    two.write_text("types:\n  hwd: {mobility: air, label: other}\n")
    _, problems, _ = load_catalogue([one, two, tmp_path / "three.yaml"])

    assert sorted(d.code for d in problems) == ["E008", "E018"]


def test_a_type_changes_single_limits_and_reactions_of_what_it_extends(tmp_path: Path) -> None:
    kite = tmp_path / "kite.yaml"
    kite.write_text(
        "types:\n  kite: {extends: hwd, envelope: {max_height: 40 m, daylight_only: true}, on_breach: {reserve: hold}}\n"
    )
    base = Path(__file__).parents[3] / "actions" / "base.yaml"
    found, problems, _ = load_catalogue([base, kite])
    limits, on_breach = found.types["kite"].limits, found.types["kite"].on_breach

    assert problems == []
    assert (limits["max_height_m"], limits["reserve_pct"], limits["daylight_only"]) == (40.0, 25.0, 1.0)
    assert (on_breach["reserve"], on_breach["keep_in"]) == ("hold", "return")
