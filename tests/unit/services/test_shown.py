"""What the API shows of agents."""

import pytest

from formiga_bt.base.geo import Frame
from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.rehearsal.testing import packaged_world
from formiga_bt.services.replies.shown import agent_out
from tests.unit.services.fakes import NOW, machine


@pytest.mark.parametrize(("refused", "at_rest"), [("unlisted", ""), ("", "unlisted")])
def test_one_that_the_site_lists_no_more_is_shown_so_also_while_it_flies(refused: str, at_rest: str) -> None:
    site, catalogue = packaged_world()
    shown = machine("hwd_1", refused=refused, refused_at_rest=at_rest)
    frame = Frame(site.lat, site.lng, site.ground_msl_m)
    assert agent_out(EngineState(), shown, frame, (), NOW, catalogue).refused == "unlisted"
