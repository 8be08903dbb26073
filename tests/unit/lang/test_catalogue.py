"""The catalogue: merged types, actions with units, the way home."""

from pathlib import Path

from formiga_bt.lang.catalogue import load_catalogue
from formiga_bt.lang.model import Catalogue


class TestShippedCatalogue:
    def test_types_take_over_what_they_extend(self, catalogue: Catalogue) -> None:
        lwd, hwd = catalogue.types["lwd"], catalogue.types["hwd"]

        assert lwd.actions == ("TakeOff", "GoTo", "LandIn", "Explore")
        assert hwd.actions == ("TakeOff", "GoTo", "LandIn")
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
        assert repeatable == {"TakeOff", "GoTo", "LandIn", "Confirm", "MiniFinder"}


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
    one.write_text("types:\n  hwd:\n")
    two = tmp_path / "two.yaml"
    two.write_text("types:\n  hwd:\n")
    _, problems, _ = load_catalogue([one, two, tmp_path / "three.yaml"])

    assert sorted(d.code for d in problems) == ["E008", "E018"]
