"""What agents are told of a site, and the preflight check of what flies."""

from msgspec.structs import replace

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Region
from formiga_bt.lang.model import AgentType, Port, Site, Station
from formiga_bt.safety.site_message import site_message, with_site
from formiga_bt.transport.codec import decode_site, encode
from formiga_bt.transport.messages import PreflightCheck, SitePoint

MARK = Mark("", 1, 1)
CORNERS = (Place(0.0, 0.0), Place(9.0, 0.0), Place(9.0, 9.0))
SITE = Site(
    "hill", 66.5, 25.7, 120.0, fence=Region(CORNERS), no_fly=(Region(CORNERS),), no_go=(Region(CORNERS),),
    ports={"p1": Port("p1", Place(1.0, 2.0))}, stations={"s1": Station("s1", Place(3.0, 4.0), 90.0, True, ("rover",))},
    layers_m=(60.0, 75.0),
)  # fmt: skip


def test_it_holds_what_an_agent_needs_to_act_by_itself() -> None:
    told = site_message(SITE)
    outline = tuple(SitePoint(one.east_m, one.north_m) for one in CORNERS)
    assert (told.site, told.base.ground_msl_m, told.datum) == ("hill", 120.0, "local")
    assert (told.fence, told.no_fly, told.no_go) == (outline, (outline,), (outline,))
    assert (told.transit_m, told.return_m) == ((60.0, 75.0), 75.0)
    assert (told.ports["p1"], told.stations["s1"].charges) == (SitePoint(1.0, 2.0), True)
    assert decode_site(encode(told)) == told


def test_the_way_home_is_low_enough_for_each_type_that_flies() -> None:
    def home(**limits: float) -> float | None:
        types = [AgentType("hwd", MARK, mobility="air", limits={"max_height_m": 120.0})]
        types += [AgentType(name, MARK, mobility="air", limits={"max_height_m": most}) for name, most in limits.items()]
        return site_message(
            SITE, [*types, AgentType("van", MARK, mobility="ground", limits={"max_height_m": 1.0})]
        ).return_m

    assert (home(), home(crane=75.0), home(crane=70.0)) == (75.0, 75.0, 60.0)
    assert home(kite=50.0) == 60.0  # it may fly in none, and takes off for no task


def test_equal_sites_have_one_version_and_each_change_makes_another() -> None:
    version = site_message(SITE).version
    assert site_message(replace(SITE, digest="another file", agents={}, separation_m=30.0)).version == version
    changed = [
        replace(SITE, no_fly=()), replace(SITE, ground_msl_m=121.0), replace(SITE, ports={}), replace(SITE, layers_m=(60.0,))
    ]  # fmt: skip
    assert len({version, *(site_message(one).version for one in changed)}) == len(changed) + 1


def test_the_check_says_whether_an_agent_has_the_site_as_it_is() -> None:
    own = (PreflightCheck("gnss", True),)
    assert with_site((), "", "v") == ()
    assert [(one.check, one.ok) for one in with_site(own, "v", "v")] == [("gnss", True), ("site", True)]
    assert [(one.check, one.ok) for one in with_site((*own, PreflightCheck("site", True)), "", "v")] == [
        ("gnss", True), ("site", False),
    ]  # fmt: skip
