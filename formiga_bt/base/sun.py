"""Whether the sun is up at a place and time, and when it rises and sets there: for daylight limits and for task files.

Formulae: NOAA Global Monitoring Laboratory, "Solar Calculation Details" (after J. Meeus, Astronomical Algorithms), the low
accuracy part "General Solar Position Calculations": good to about a minute of sunrise and sunset between 1950 and 2050.
Up = its centre is higher than -0.833 degrees (refraction and the sun's radius); from the ground at sea level, no hills.
"""

import math
from datetime import UTC, datetime, timedelta
from typing import Final

from formiga_bt.base.clock import SECOND, Micros

HORIZON_DEG: Final = -0.833

_HALF_DAY: Final = 12 * 3600 * SECOND
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def sun_elevation_deg(lat: float, lng: float, now: Micros) -> float:
    """Return the height of the sun's centre over the horizon, degrees, without refraction.

    Args:
        lat: degrees north.
        lng: degrees east.
        now: microseconds of UTC since 1970.
    """
    time_equation_min, declination, hour = _sun(now)
    solar_time_min = hour * 60 + time_equation_min + 4 * lng
    hour_angle = math.radians(solar_time_min / 4 - 180)
    north = math.radians(lat)
    up = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(hour_angle)
    return math.degrees(math.asin(min(1.0, max(-1.0, up))))


def _sun(now: Micros) -> tuple[float, float, float]:
    """Return the equation of time (minutes), the declination (radians), and the hour of the day in UTC."""
    at = _EPOCH + timedelta(microseconds=now)
    day, hour = at.timetuple().tm_yday, at.hour + at.minute / 60 + at.second / 3600
    days = 366 if at.year % 4 == 0 and (at.year % 100 != 0 or at.year % 400 == 0) else 365
    g = 2 * math.pi / days * (day - 1 + (hour - 12) / 24)
    time_equation_min = 229.18 * (
        0.000075
        + 0.001868 * math.cos(g)
        - 0.032077 * math.sin(g)
        - 0.014615 * math.cos(2 * g)
        - 0.040849 * math.sin(2 * g)
    )
    declination = (
        0.006918
        - 0.399912 * math.cos(g)
        + 0.070257 * math.sin(g)
        - 0.006758 * math.cos(2 * g)
        + 0.000907 * math.sin(2 * g)
        - 0.002697 * math.cos(3 * g)
        + 0.00148 * math.sin(3 * g)
    )
    return time_equation_min, declination, hour


def sun_is_up(lat: float, lng: float, now: Micros) -> bool:
    """Return whether the sun is up; see `sun_elevation_deg` for the arguments."""
    return sun_elevation_deg(lat, lng, now) > HORIZON_DEG


def daylight(lat: float, lng: float, noon: Micros, day: tuple[Micros, Micros]) -> tuple[Micros, Micros]:
    """Return when the sun rises and sets around the solar noon that is nearest to `noon`, to whole seconds.

    Where it stays up these are the ends of `day`; where it stays down both are the solar noon: no instant is between them.
    """
    middle = _solar_noon(lng, _solar_noon(lng, noon))
    if not sun_is_up(lat, lng, middle):
        return middle, middle
    rise, fall = _crossing(lat, lng, middle, -_HALF_DAY), _crossing(lat, lng, middle, _HALF_DAY)
    return day[0] if rise is None else rise, day[1] if fall is None else fall


def _solar_noon(lng: float, near: Micros) -> Micros:
    time_equation_min, _, hour = _sun(near)
    past_min = (hour * 60 + time_equation_min + 4 * lng) % 1440 - 720
    return round((near - past_min * 60 * SECOND) / SECOND) * SECOND


def _crossing(lat: float, lng: float, noon: Micros, way: Micros) -> Micros | None:
    """Return when the sun passes the horizon between its noon and the midnight before or after; None if it does not."""
    up, down = noon, noon + way
    if sun_is_up(lat, lng, down):
        return None
    while abs(down - up) > SECOND:
        middle = (up + down) // 2 // SECOND * SECOND
        if middle in (up, down):
            break
        if sun_is_up(lat, lng, middle):
            up = middle
        else:
            down = middle
    return down if way > 0 else up
