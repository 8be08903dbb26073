"""Matplotlib figures as files: SVG and PNG that are the same each time, and a page of its own to zoom, point and choose in.

Letters are drawn as paths, so that nothing depends on the fonts of whoever looks. An artist with a `gid` made by `Tips` carries
a text that is shown when it is pointed at, and the name of what it belongs to, which the page can hide.
"""

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.extras import need_charts
from formiga_bt.show.clean import cleaned

if TYPE_CHECKING:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

Format = Literal["svg", "png", "html", "txt"]
FORMATS: Final[dict[str, Format]] = {".svg": "svg", ".png": "png", ".html": "html", ".htm": "html", ".txt": "txt"}
DPI: Final = 130
_FIXED: Final[dict[str, Any]] = {
    "svg.hashsalt": "formiga",
    "svg.fonttype": "path",
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "hatch.linewidth": 0.6,
    "text.parse_math": False,
    "axes.unicode_minus": False,
}
INKS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#7a5c00", "#56b4e9", "#000000", "#e69f00")
"""Colours that people who see few colours tell apart (Okabe and Ito); each goes with a line style or hatch of its own."""


class Tips:
    """Texts that are shown when something is pointed at, by the ids of what carries them."""

    def __init__(self) -> None:
        self._texts: list[tuple[str, int]] = []
        self.owners: list[str] = []
        """Whom the page can hide: agents, tasks."""

    def add(self, text: str, owner: str = "") -> str:
        """Return the id for an artist (`set_gid`)."""
        number = -1
        if owner:
            if owner not in self.owners:
                self.owners.append(owner)
            number = self.owners.index(owner)
        self._texts.append((text, number))
        return f"tip{len(self._texts) - 1}"

    def into(self, svg: str) -> str:
        """Return an SVG with the texts in it."""
        return re.sub(r'<g id="tip(\d+)">', self._opened, svg)

    def _opened(self, found: "re.Match[str]") -> str:
        text, owner = self._texts[int(found[1])]
        of = f' data-of="{owner}"' if owner >= 0 else ""
        lines = "\n".join(cleaned(line) for line in text.split("\n"))
        title = f"<title>{escape(lines)}</title>" if text else ""
        return f'<g id="tip{found[1]}"{of}>{title}'


def format_of(path: Path) -> Format:
    """Return what a file's name asks for.

    Raises:
        UnusableFile: it ends in something else.
    """
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise UnusableFile(
            f"{path} has no ending that is known", help="say a name that ends in .svg, .png, .html or .txt"
        )
    return found


@contextmanager
def fixed_style() -> Iterator[None]:
    """Draw the same whatever the user's matplotlib is set to; characters that the font lacks are boxes.

    Raises:
        UnusableFile: matplotlib is not installed.
    """
    need_charts("charts")
    import matplotlib as mpl

    settings: Any = _FIXED
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        mpl.rcParams.update(settings)
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        yield


def agg(figure: "Figure") -> "FigureCanvasAgg":
    """Return a canvas of a figure that measures texts."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    return FigureCanvasAgg(figure)


def extent(text: "Text", canvas: "FigureCanvasAgg") -> "Bbox":
    """Return how much room a text takes, in pixels."""
    renderer: Any = canvas.get_renderer  # without types
    return text.get_window_extent(renderer())


def as_svg(figure: "Figure", tips: Tips) -> str:
    """Return a figure as SVG text; within `fixed_style`."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": "formiga", "Type": None, "Format": None})
    return tips.into(_smaller(stream.getvalue()))


def _smaller(svg: str) -> str:
    """Return an SVG in fewer bytes: no indentation, a tenth of a point as its grid, letters with short names."""
    names: dict[str, str] = {}
    svg = "\n".join(line.strip() for line in svg.splitlines()) + "\n"
    svg = re.sub(r' (?:d|x|y)="[^"]*"|translate\([^)]*\)', _rounded, svg)
    svg = re.sub(r"DejaVuSans[A-Za-z]*-[0-9a-f]+", lambda found: names.setdefault(found[0], f"l{len(names)}"), svg)
    svg = re.sub(r'(<use [^>]*)transform="translate\((\S+) 0\)"', r'\1x="\2"', svg)
    svg = re.sub(r'(<path id="l\d+" d=")([^"]*)(" transform="scale\()0\.015625\)', _coarse, svg)
    return re.sub(r' d="([^"]*)"', lambda found: f' d="{_close(found[1])}"', svg)


def _close(outline: str) -> str:
    """Return the commands of a path without needless spaces."""
    return re.sub(r"\s*([A-Za-z])\s*", r"\1", outline).strip()


def _rounded(found: "re.Match[str]") -> str:
    return re.sub(r"(\.\d)\d+", r"\1", found[0])


def _coarse(letter: "re.Match[str]") -> str:
    """Return the outline of a letter with a tenth of its units: 0.04 points of 8."""
    outline = re.sub(r"-?\d+", lambda number: str(round(int(number[0]) / 10)), letter[2])
    return f"{letter[1]}{outline}{letter[3]}0.15625)"


def as_png(figure: "Figure") -> bytes:
    """Return a figure as PNG; within `fixed_style`."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI, metadata={"Software": "formiga"})
    return stream.getvalue()


def as_page(svg: str, title: str, owners: list[str]) -> str:
    """Return an SVG as a page that needs nothing else: wheel zooms, dragging moves, pointing tells, boxes hide."""
    drawn = svg[svg.index("<svg") :]
    boxes = "".join(
        f'<label><input type="checkbox" checked data-hides="{i}"> {escape(cleaned(name))}</label>\n'
        for i, name in enumerate(owners)
    )
    return _PAGE.replace("{{title}}", escape(cleaned(title))).replace("{{boxes}}", boxes).replace("{{drawn}}", drawn)


_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>{{title}}</title>
<style>
body { margin: 0; font: 14px sans-serif; background: #fff; color: #111; }
header { padding: 8px 12px; border-bottom: 1px solid #ccc; }
header b { margin-right: 12px; }
label { display: inline-block; margin-right: 10px; white-space: nowrap; }
#all svg { display: block; width: 100%; max-width: 1200px; height: auto; margin: 0 auto; cursor: grab; touch-action: none; }
#tip { position: fixed; display: none; padding: 4px 8px; max-width: 60ch; background: #222; color: #fff;
       white-space: pre-wrap; pointer-events: none; border-radius: 3px; }
</style>
</head>
<body>
<header><b>{{title}}</b> <small>wheel: zoom, drag: move, double click: all</small><br>
{{boxes}}</header>
<div id="all">
{{drawn}}</div>
<div id="tip"></div>
<script>
"use strict";
const svg = document.querySelector("#all svg"), tip = document.getElementById("tip");
const whole = svg.getAttribute("viewBox").split(" ").map(Number);
let box = whole.slice(), held = null;
svg.removeAttribute("width"); svg.removeAttribute("height");
const show = () => svg.setAttribute("viewBox", box.join(" "));
const at = e => { const r = svg.getBoundingClientRect();
  return [(e.clientX - r.left) / r.width, (e.clientY - r.top) / r.height]; };
svg.addEventListener("wheel", e => { e.preventDefault();
  const [x, y] = at(e), f = Math.min(Math.max(Math.exp(e.deltaY / 500), 0.5), 2);
  const w = Math.min(Math.max(box[2] * f, whole[2] / 200), whole[2]), h = w * whole[3] / whole[2];
  box = [box[0] + x * (box[2] - w), box[1] + y * (box[3] - h), w, h]; show(); }, {passive: false});
svg.addEventListener("pointerdown", e => { held = [e.clientX, e.clientY, box.slice()]; });
window.addEventListener("pointerup", () => { held = null; });
window.addEventListener("pointermove", e => { if (!held) return;
  const r = svg.getBoundingClientRect(), b = held[2];
  box = [b[0] - (e.clientX - held[0]) / r.width * b[2], b[1] - (e.clientY - held[1]) / r.height * b[3], b[2], b[3]];
  show(); });
svg.addEventListener("dblclick", () => { box = whole.slice(); show(); });
for (const title of svg.querySelectorAll("g > title")) {
  const text = title.textContent; title.parentNode.dataset.tip = text; title.remove(); }
svg.addEventListener("mousemove", e => { const g = e.target.closest("[data-tip]");
  if (!g) { tip.style.display = "none"; return; }
  tip.textContent = g.dataset.tip; tip.style.display = "block";
  tip.style.left = Math.max(0, Math.min(e.clientX + 12, innerWidth - tip.offsetWidth - 4)) + "px";
  tip.style.top = Math.max(0, Math.min(e.clientY + 16, innerHeight - tip.offsetHeight - 4)) + "px"; });
svg.addEventListener("mouseleave", () => { tip.style.display = "none"; });
for (const check of document.querySelectorAll("input[data-hides]")) check.addEventListener("change", () => {
  for (const g of svg.querySelectorAll('[data-of="' + check.dataset.hides + '"]'))
    g.style.display = check.checked ? "" : "none"; });
</script>
</body>
</html>
"""
