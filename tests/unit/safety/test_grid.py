"""The grid finds every box that meets a question, and none twice."""

import random

from formiga_bt.safety.grid import NOWHERE, Box, Grid, box_of, grown


def meet(a: Box, b: Box) -> bool:
    return a[0] <= b[1] and a[1] >= b[0] and a[2] <= b[3] and a[3] >= b[2]


def a_box(dice: random.Random, most: float) -> Box:
    west, south = dice.uniform(-1000, 1000), dice.uniform(-1000, 1000)
    return west, west + dice.uniform(0, most), south, south + dice.uniform(0, most)


def test_it_finds_what_a_walk_over_all_finds_whatever_is_put_and_dropped() -> None:
    dice = random.Random(3)
    grid: Grid[str] = Grid()
    boxes: dict[str, Box] = {}
    for turn in range(3000):
        key = f"d{dice.randrange(150)}"
        if dice.random() < 0.2:
            grid.drop(key)
            boxes.pop(key, None)
        else:
            boxes[key] = a_box(dice, 1500.0 if dice.random() < 0.1 else 60.0)
            grid.put(key, boxes[key], key)
        if turn % 10 == 0:
            asked = a_box(dice, dice.choice([10.0, 300.0, 2000.0]))
            assert sorted(grid.near(asked)) == sorted(key for key, box in boxes.items() if meet(box, asked))
    assert len(grid) == len(boxes)


def test_what_is_nowhere_is_never_near() -> None:
    grid: Grid[str] = Grid()
    grid.put("d1", (0.0, 1.0, 0.0, 1.0), "d1")
    grid.put("d1", NOWHERE, "d1")

    assert grid.near((-9.0, 9.0, -9.0, 9.0)) == []
    assert grid.near(NOWHERE) == []
    assert grown(box_of([(1.0, 2.0)]), 3.0) == (-2.0, 4.0, -1.0, 5.0)
