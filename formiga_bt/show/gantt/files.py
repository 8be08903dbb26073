"""A Gantt chart as the bytes of a file."""

from datetime import UTC, tzinfo

from formiga_bt.base.clock import Micros
from formiga_bt.show.facts import Timeline
from formiga_bt.show.picture import Format

TEXT_COLUMNS = 120


def made(
    timeline: Timeline,
    form: Format,
    *,
    clock: bool = False,
    zone: tzinfo = UTC,
    from_us: Micros | None = None,
    to_us: Micros | None = None,
    page: int = 1,
) -> bytes:
    """Return a chart.

    Args:
        timeline: what happened.
        form: as what.
        clock: the time of the day instead of the time since the first request.
        zone: of the clock.
        from_us: where it begins, counted from the first request.
        to_us: where it ends, likewise.
        page: which page, from 1.

    Raises:
        UnusableFile: there is no such page, or the span is empty.
    """
    if form == "txt":
        from formiga_bt.show.gantt.text import drawn

        lines = drawn(timeline, TEXT_COLUMNS, clock=clock, zone=zone, from_us=from_us, to_us=to_us, page=page)
        return "".join(line.plain + "\n" for line in lines).encode()
    from formiga_bt.show.gantt.figure import figure
    from formiga_bt.show.picture import Tips, as_page, as_png, as_svg, fixed_style

    with fixed_style():
        tips = Tips()
        chart = figure(timeline, tips, clock=clock, zone=zone, from_us=from_us, to_us=to_us, page=page)
        if form == "png":
            return as_png(chart)
        svg = as_svg(chart, tips)
    names = ", ".join(task.id for task in timeline.tasks[:4]) + (" and others" if len(timeline.tasks) > 4 else "")
    return (svg if form == "svg" else as_page(svg, f"Actions of {names}", tips.owners)).encode()
