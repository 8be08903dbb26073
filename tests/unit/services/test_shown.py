"""What the API shows of agents."""

import pytest

from formiga_bt.engine.kernel.state import EngineState
from formiga_bt.show.history.records import agent_fact
from tests.unit.services.fakes import NOW, machine


@pytest.mark.parametrize(("refused", "at_rest"), [("unlisted", ""), ("", "unlisted")])
def test_one_that_the_site_lists_no_more_is_shown_so_also_while_it_flies(refused: str, at_rest: str) -> None:
    shown = machine("hwd_1", refused=refused, refused_at_rest=at_rest)
    assert agent_fact(EngineState(), shown, NOW).refused == "unlisted"
