"""A picture as PNG: its SVG, painted by the wheel `resvg-py` with the font that the widths are of, which matplotlib brings."""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

from formiga_bt.base.errors import FormigaError
from formiga_bt.base.extras import need_charts
from formiga_bt.show.facts import Drawing
from formiga_bt.show.tree.legend import legend_of
from formiga_bt.show.tree.outline import outline_of
from formiga_bt.show.tree.svg import Steps, SvgPage

DPI: Final = 144
LEAST_DPI: Final = 60
TALLEST_PX: Final = 32_000
"""Viewers show no taller ones, and it takes 130 MB to paint one."""
FONTS: Final = ("DejaVuSans", "DejaVuSans-Bold", "DejaVuSans-Oblique", "DejaVuSansMono", "DejaVuSansMono-Bold")


def png_of(drawing: Drawing, steps: Steps | None = None, title: str = "") -> bytes:
    """Return a picture as PNG.

    Args:
        drawing: the task.
        steps: how its steps stand, by path; None = it does not run.
        title: what stands above it instead of the task's name.

    Raises:
        FormigaError: the tree is too long for a PNG.
    """
    outline = outline_of(drawing, steps, title)
    page = SvgPage(drawing, outline, legend_of(outline, steps is not None))
    dpi = min(DPI, int(TALLEST_PX * 72 / page.height))
    if dpi < LEAST_DPI:
        raise FormigaError(
            f"the tree is too long for a PNG: {page.height / 72:.0f} inches",
            help="draw an svg or html, or less of it: --depth N, --collapse NAME",
        )
    return painted(page.text(), dpi)


def painted(svg: str, dpi: int = DPI) -> bytes:
    """Return an SVG as PNG, the same on every machine as long as its letters are in the font.

    Args:
        svg: the text of the file.
        dpi: pixels of an inch, that is of 72 points.

    Raises:
        UnusableFile: what paints, or the font, is not installed.
    """
    need_charts("PNG files of trees", "draw an svg or html")
    import resvg_py

    return bytes(
        resvg_py.svg_to_bytes(
            svg_string=svg, dpi=dpi, font_files=[str(path) for path in _fonts()], sans_serif_family="DejaVu Sans"
        )
    )


def _fonts() -> list[Path]:
    spec = find_spec("matplotlib")  # found, not imported: that takes a second
    assert spec is not None, "need_charts has looked"
    assert spec.origin is not None, "a package of files"
    folder = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf"
    return [path for path in (folder / f"{name}.ttf" for name in FONTS) if path.exists()]
