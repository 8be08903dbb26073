"""The ground of a site: its height file, read or refused with its line, and how high the ground is at a place.

The file is named under `terrain` and looked up beside the site file. Where expressions need the ground (`above`), an unknown
height is an error, never zero.
"""

import hashlib
from pathlib import Path
from typing import Final

from formiga_bt.base.geo import Place
from formiga_bt.base.heights import HeightGrid, parse_heights
from formiga_bt.lang.model import EvalError, Site
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.text.reading import Problems, shorten

_MOST_BYTES: Final = 100_000_000


def load_heights(at: Scalar, beside: Path, base_msl_m: float, problems: Problems) -> HeightGrid | None:
    """Read a height file.

    Args:
        at: its name, as the site file has it.
        beside: the folder of the site file.
        base_msl_m: height of the base's ground over the sea.
        problems: where to report what is wrong (E086).
    """
    name = shorten(at.text)
    try:
        path = beside / at.text
        if not path.is_file():
            problems.add("E086", at.mark, f"there is no height file '{name}'", "its path is relative to the site file")
            return None
        if path.stat().st_size > _MOST_BYTES:
            problems.add("E086", at.mark, f"'{name}' is larger than {_MOST_BYTES // 1_000_000} MB", "take larger cells")
            return None
        data = path.read_bytes()
        return parse_heights(data.decode("ascii"), base_msl_m, hashlib.sha256(data).hexdigest())
    except UnicodeDecodeError:
        problems.add(
            "E086", at.mark, f"'{name}' is not text: an ESRI ASCII grid is needed", "GeoTIFF must be converted"
        )
    except OSError as error:
        problems.add("E086", at.mark, f"'{name}' cannot be read: {error.strerror or error}")
    except ValueError as error:
        problems.add("E086", at.mark, f"'{name}': {error}", "an ESRI ASCII grid, in metres from the base")
    return None


def ground_up_m(site: Site, place: Place) -> float:
    """Return the height of the ground at a place over the base's ground, metres: 0 on a flat site.

    Raises:
        EvalError: the site's height file does not reach there, or has no data there.
    """
    if site.heights is None:
        return 0.0
    height: float | None = site.heights.ground_m(place.east_m, place.north_m)
    if height is None:
        where = f"{place.east_m:g} m east and {place.north_m:g} m north of the base"
        raise EvalError(f"the height of the ground is not known {where}")
    return height
