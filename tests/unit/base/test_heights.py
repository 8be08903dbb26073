"""Ground heights from an ESRI ASCII grid."""

import math
import random
import re

import pytest

from formiga_bt.base.geo import Place
from formiga_bt.base.heights import HeightGrid, parse_heights

HILL = """\
ncols 3
nrows 3
xllcenter -10
yllcenter -10
cellsize 10
NODATA_value -9999
100 100 -9999
100 130 100
100 100 100
"""


def hill() -> HeightGrid:
    return parse_heights(HILL, 100.0)


class TestGround:
    def test_heights_are_over_the_bases_ground_and_the_first_row_is_the_northernmost(self) -> None:
        grid = parse_heights("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n107 108\n105 106\n", 100.0)

        assert [grid.ground_m(5, 5), grid.ground_m(15, 5), grid.ground_m(5, 15), grid.ground_m(15, 15)] == [5, 6, 7, 8]

    def test_between_the_middles_of_cells_the_ground_is_bilinear(self) -> None:
        assert hill().ground_m(0, 0) == 30.0
        assert hill().ground_m(-5, 0) == 15.0
        assert hill().ground_m(-5, -5) == 7.5

    def test_a_grid_reaches_to_the_edges_of_its_cells(self) -> None:
        assert hill().ground_m(-15, -15) == 0.0
        assert hill().ground_m(-15.01, 0) is None
        assert hill().ground_m(0, 15.01) is None

    def test_ground_without_data_is_unknown(self) -> None:
        assert hill().ground_m(9, 9) is None
        assert hill().ground_m(10, 0) == 0.0

    def test_one_cell_is_a_grid(self) -> None:
        grid = parse_heights("NCOLS 1\nNROWS 1\nxllcorner -5\nyllcorner -5\ncellsize 10\n3\n", 1.0)

        assert (grid.ground_m(4, -4), grid.ground_m(6, 0)) == (2.0, None)
        assert grid.highest_m(Place(-1, 0), Place(4, 4)) == 2.0


class TestLegs:
    def test_a_leg_over_a_hill_has_its_top(self) -> None:
        assert hill().highest_m(Place(-10, 0), Place(10, 0)) == 30.0
        assert hill().highest_m(Place(-10, -10), Place(0, 0)) == 30.0
        assert hill().highest_m(Place(-10, -5), Place(10, -5)) == 15.0
        assert hill().highest_m(Place(2, 0), Place(2, 0)) == 24.0

    def test_the_top_of_a_saddle_lies_between_two_lines(self) -> None:
        grid = parse_heights("ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 10\n10 0\n0 10\n", 0.0)

        assert grid.highest_m(Place(0, 10), Place(10, 0)) == 10.0
        assert grid.highest_m(Place(10, 10), Place(0, 0)) == 5.0

    def test_a_leg_that_leaves_the_grid_or_crosses_a_hole_is_unknown(self) -> None:
        assert hill().highest_m(Place(0, 0), Place(30, 0)) is None
        assert hill().highest_m(Place(-60, 0), Place(60, 0)) is None
        assert hill().highest_m(Place(0, 10), Place(10, 0)) is None

    def test_no_point_of_a_leg_lies_above_its_highest(self) -> None:
        random_ = random.Random(7)
        rows = "\n".join(" ".join(str(random_.randint(0, 50)) for _ in range(9)) for _ in range(7))
        grid = parse_heights(f"ncols 9\nnrows 7\nxllcorner -20\nyllcorner -9\ncellsize 5\n{rows}\n", 0.0)
        for _ in range(60):
            a, b = (Place(random_.uniform(-20, 25), random_.uniform(-9, 26)) for _ in range(2))
            along = [
                grid.ground_m(a.east_m + k / 200 * (b.east_m - a.east_m), a.north_m + k / 200 * (b.north_m - a.north_m))
                for k in range(201)
            ]
            highest = grid.highest_m(a, b)

            assert highest is not None
            assert max(h for h in along if h is not None) == pytest.approx(highest, abs=1.0)
            assert all(h is not None and h <= highest + 1e-9 for h in along)
            assert not math.isnan(highest)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HILL.replace("ncols 3\n", ""), "line 6: before the heights ncols is missing"),
        (HILL.replace("xllcenter -10\n", ""), "line 6: before the heights xllcorner or xllcenter is missing"),
        (HILL.replace("cellsize 10", "cellsize 0"), "line 5: cellsize must be above 0, this is 0"),
        (HILL.replace("nrows 3", "nrows 2.5"), "line 2: nrows must be a whole number above 0, this is 2.5"),
        (HILL.replace("nrows 3", "nrows 4"), "the file has 3 rows of heights, nrows is 4"),
        (HILL.replace("nrows 3", "nrows three"), "line 2: nrows needs one number"),
        (HILL.replace("nrows 3", "nrows 3\nnrows 3"), "line 3: nrows stands here twice; first at line 2"),
        (HILL.replace("cellsize", "xllcorner -10\ncellsize"), "line 3: give xllcorner or xllcenter, not both"),
        (HILL.replace("cellsize", "size"), "line 5: 'size' is no key of an ESRI ASCII grid"),
        (HILL.replace("100 130 100", "100 130"), "line 8: this row has 2 heights, ncols is 3"),
        (HILL.replace("130", "high"), "line 8: 'high' is no height"),
        (HILL.replace("130", "nan"), "line 8: 'nan' is no height"),
        (HILL.replace("130", "-32768"), "line 8: no ground lies -32768 m over the sea; is NODATA_value missing?"),
        (
            HILL.replace("ncols 3", "ncols 3000000"),
            "3000000 times 3 cells are more than 4000000; take larger cells or a smaller area",
        ),
        ("", "line 1: before the heights ncols is missing"),
    ],
)
def test_what_is_no_grid_is_told_with_its_line(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"{re.escape(message)}$"):
        parse_heights(text, 0.0)
