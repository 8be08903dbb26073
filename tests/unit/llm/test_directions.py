"""A spot beside a place lies on the side of it that the request says."""

import pytest

from tests.unit.llm.scripted import fly_to, home
from tests.unit.llm.test_teams import errors, judged

DRONE = [{"name": "drone", "type": "lwd"}]
WRONG = 'the request says "60 m south of the camp", and the task goes to another side of camp'


@pytest.mark.parametrize(
    ("spot", "wrong"),
    [
        ("offset(camp, north=60 m)", [WRONG]),
        ("offset(camp, east=60 m)", [WRONG]),
        ("offset(camp, north=-60 m)", []),
        ("offset(camp, south=60 m)", []),
        ("offset(camp, north=-60 m, east=40 m)", []),
        ("toward(camp, base, 60 m)", []),
    ],
)
def test_the_side_is_compared(spot: str, wrong: list[str]) -> None:
    request = "A light drone hovers 60 m south of the camp at 30 m and comes home."

    assert errors(judged(request, fly_to(spot, "30 m"), home(), agents=DRONE)) == wrong


def test_the_side_is_compared_in_spanish_and_for_each_place() -> None:
    request = "Un dron ligero mira 60 m al oeste del campamento, a 30 m, y vuelve a casa."
    wrong = 'the request says "60 m al oeste del campamento", and the task goes to another side of camp'

    assert errors(judged(request, fly_to("offset(camp, east=60 m)", "30 m"), home(), agents=DRONE)) == [wrong]
    assert errors(judged(request, fly_to("offset(camp, west=60 m)", "30 m"), home(), agents=DRONE)) == []
    apart = "Two light drones land 5 m apart, 5 m north of the camp."
    row = "[offset(camp, north=5 m), offset(camp, north=5 m, east=5 m)]"
    team = [{"name": "drones", "type": "lwd", "count": 2}]
    assert errors(judged(apart, {"do": "FlyAndLand", "agent": "drones", "at": row}, agents=team)) == []
