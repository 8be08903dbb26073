"""Quantities from text and back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formiga_bt.base.units import LIKELY, UNITS, format_quantity, parse_quantity, too_large


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("15 s", ("duration", 15.0)),
        ("15s", ("duration", 15.0)),
        (" 2 min ", ("duration", 120.0)),
        ("250 ms", ("duration", 0.25)),
        ("1.5 h", ("duration", 5400.0)),
        ("3.5 km", ("distance", 3500.0)),
        ("1.1 km", ("distance", 1100.0)),
        ("-4 m", ("distance", -4.0)),
        ("30 %", ("percent", 30.0)),
        ("90 deg", ("angle", 90.0)),
        ("4 m/s", ("speed", 4.0)),
        ("36 km/h", ("speed", 10.0)),
        ("2 kg", ("mass", 2.0)),
        ("250 g", ("mass", 0.25)),
    ],
)
def test_quantities_are_read_into_si(text, read):
    assert parse_quantity(text) == read


def test_radians_become_degrees():
    assert parse_quantity("1 rad") == ("angle", pytest.approx(math.degrees(1)))


@pytest.mark.parametrize(
    "text", ["15", "s", "15 parsec", "1 2 m", "", "15 S", "m 15", "1e400 m", "nan m", "٣ m", "1_0 m"]
)
def test_anything_else_is_no_quantity(text):
    assert parse_quantity(text) is None


@pytest.mark.parametrize(
    ("text", "is_so"),
    [
        ("1e308 m", True),
        ("-1e16 m", True),
        ("1e14 km", True),
        ("1e400 m", True),
        ("9e15 m", False),
        ("1e308 parsec", False),
        ("1e308 s", False),
    ],
)
def test_a_number_out_of_bounds_is_told_from_a_unit_that_is_none(text, is_so):
    assert too_large(text, "distance") is is_so


@pytest.mark.parametrize(
    ("type_name", "si", "text"),
    [
        ("distance", 60.0, "60 m"),
        ("distance", 2000.0, "2 km"),
        ("distance", 2.5, "2.5 m"),
        ("duration", 15.0, "15 s"),
        ("duration", 90.0, "90 s"),
        ("duration", 1800.0, "30 min"),
        ("duration", 7200.0, "2 h"),
        ("duration", 0.25, "250 ms"),
        ("duration", 0.0, "0 s"),
        ("percent", 40.0, "40 %"),
        ("angle", 90.0, "90 deg"),
        ("speed", 4.0, "4 m/s"),
        ("mass", 2.0, "2 kg"),
        ("number", 3.0, "3"),
    ],
)
def test_quantities_are_written_in_the_largest_whole_unit(type_name, si, text):
    assert format_quantity(type_name, si) == text


@given(st.sampled_from(sorted(UNITS)), st.integers(0, 10**6), st.integers(0, 999))
def test_every_unit_is_read(unit, whole, thousandths):
    number = f"{whole}.{thousandths:03}"
    type_name, factor = UNITS[unit]
    assert parse_quantity(f"{number} {unit}") == (type_name, pytest.approx(float(number) * factor, rel=1e-12))


@given(st.sampled_from(sorted(LIKELY)), st.integers(-(10**9), 10**9))
def test_what_is_written_is_read_back(type_name, thousandths):
    si = thousandths / 1000
    assert parse_quantity(format_quantity(type_name, si)) == (type_name, pytest.approx(si, rel=1e-12))
