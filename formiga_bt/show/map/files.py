"""A map as the bytes of a file."""

from collections.abc import Sequence

from formiga_bt.show.facts import Chart
from formiga_bt.show.picture import Format

TEXT_COLUMNS = 120


def made(chart: Chart, form: Format, *, whole: bool = False, ids: Sequence[str] = ()) -> bytes:
    """Return a map.

    Args:
        chart: the site and the ways.
        form: as what.
        whole: show all of the site.
        ids: the tasks whose agents are shown, for the title.
    """
    if form == "txt":
        from formiga_bt.show.map.text import drawn

        return "".join(line.plain + "\n" for line in drawn(chart, TEXT_COLUMNS, whole=whole, ids=ids)).encode()
    from formiga_bt.show.map.figure import figure
    from formiga_bt.show.picture import Tips, as_page, as_png, as_svg, fixed_style

    with fixed_style():
        tips = Tips()
        drawing = figure(chart, tips, whole=whole, ids=tuple(ids))
        if form == "png":
            return as_png(drawing)
        svg = as_svg(drawing, tips)
    names = ", ".join(ids[:4]) + (" and others" if len(ids) > 4 else "")
    return (
        svg if form == "svg" else as_page(svg, f"{chart.site}: {names}" if ids else chart.site, tips.owners)
    ).encode()
