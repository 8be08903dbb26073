"""One tree with every sign in it, pinned in each format that is text; what the formats promise beside their text.

`pytest tests/unit/show/test_trees_drawn.py --update-golden` rewrites the texts in `golden/`; read the difference.
"""

import json
import os
import re
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import get_args

import pytest

from formiga_bt.cli.inputs import read_task, read_world
from formiga_bt.show.facts import Box, Drawing, FileSpot, StepFact, StyledSpan
from formiga_bt.show.tree.dot import dot_of
from formiga_bt.show.tree.drawing import cut, drawing_of, is_step, walk
from formiga_bt.show.tree.formats import SUFFIXES, UnknownFormat, as_png, as_text, format_of, json_of
from formiga_bt.show.tree.html import html_of
from formiga_bt.show.tree.looks import BoxLook
from formiga_bt.show.tree.marks import IGNORED_FAILURE, MARKS, mark_of, note_of
from formiga_bt.show.tree.mermaid import mermaid_of
from formiga_bt.show.tree.outline import WIDTH, Shape, outline_of
from formiga_bt.show.tree.png import painted, png_of
from formiga_bt.show.tree.shapes import shape_of
from formiga_bt.show.tree.svg import svg_of
from formiga_bt.show.tree.terminal import draw, legend
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
GOLDEN = Path(__file__).parent / "golden"

TEXT = """formiga: 1
task: Look
version: 2.1.0
description: Look at <b>places</b> & come home.
imports: [lib/flying.yaml]
params: {target: place, n: {type: int, default: 2}}
agents: {drone: {type: lwd, near: "${target}"}, ann: {type: watcher}}
steps:
  - do: drone.TakeOff
    timeout: 2 min
    retry: {attempts: 3}
  - fallback:
      - check: drone.battery > 30 %
      - ask: Go on & "look"?
        of: [ann]
        timeout: 5 min
        expect: result.answer == 'yes'
  - parallel:
      - wait: 5 s
      - notify: </script> looking
        to: [ann]
        ignore_failure: true
  - repeat: 2
    name: Twice
    steps:
      - do: drone.GoTo
        with: {to: "${above(target, 60 m)}"}
        when: n > 1
  - if: n > 3
    then: [{wait: 1 s}]
    else: [{wait: 2 s}]
  - call: ReturnHome
    with: {drone: "${drone}"}
on_failure:
  - notify: It failed.
"""

FACTS = (
    ("steps/steps[0]", "success", {"succeeded": 1, "failed": 1}),
    ("steps/steps[1]", "success", {"succeeded": 1}),
    ("steps/steps[1].fallback[0]", "failure", {"failed": 1, "code": "check_failed"}),
    ("steps/steps[1].fallback[1]", "success", {"succeeded": 1}),
    ("steps/steps[2]", "success", {"succeeded": 1}),
    ("steps/steps[2].parallel[0]", "stopped", {"stopped": 1}),
    ("steps/steps[2].parallel[1]", "failure", {"failed": 1}),
    ("steps/steps[3]", "running", {"running": 1, "note": "round 2"}),
    ("steps/steps[3].steps[0]", "running", {"running": 1, "succeeded": 1, "note": "lwd_1 40 %"}),
    ("steps/steps[4]", "skipped", {"skipped": 1}),
)


@pytest.fixture
def drawing(tmp_path: Path) -> Drawing:
    file = tmp_path / "look.yaml"
    file.write_text(TEXT, encoding="utf-8")
    read = read_task(file, read_world())
    assert read.task is not None, read.diagnostics
    where = str(tmp_path) + os.sep
    found = json_of(drawing_of(read.task)).replace(where, "")
    found = re.sub(r'"[^"]*(lib/flying\.yaml)"', r'"\1"', found)
    import msgspec

    drawn = msgspec.json.decode(json.dumps(json.loads(found)["drawing"]), type=Drawing)
    return msgspec.structs.replace(drawn, sources={"look.yaml": TEXT})


@pytest.fixture
def facts() -> dict[str, StepFact]:
    return {path: StepFact(path=path, status=status, **more) for path, status, more in FACTS}  # type: ignore[arg-type]


Steps = dict[str, StepFact]


def terminal(drawing: Drawing, steps: Steps | None, width: int = 90, ascii_only: bool = False) -> str:
    return "".join(line.plain() + "\n" for line in draw(drawing, steps, width=width, ascii_only=ascii_only))


@pytest.mark.parametrize(
    ("name", "drawn"),
    [
        ("file.txt", lambda d, f: terminal(d, None)),
        ("task.txt", terminal),
        ("task_narrow.txt", lambda d, f: terminal(d, f, 44)),
        ("task_ascii.txt", lambda d, f: terminal(d, f, 70, True)),
        ("file.mmd", lambda d, f: mermaid_of(d)),
        ("task.mmd", lambda d, f: mermaid_of(d, f, "Look-1 ACTIVE")),
        ("file.dot", lambda d, f: dot_of(d)),
        ("task.dot", lambda d, f: dot_of(d, f, "Look-1 ACTIVE")),
        ("file.svg", lambda d, f: svg_of(d)),
        ("task.svg", lambda d, f: svg_of(d, f, "Look-1 ACTIVE")),
        ("task.json", json_of),
        ("task.html", lambda d, f: html_of(d, f, "Look-1").partition("<body>")[2].partition("<script>")[0]),
    ],
)
def test_each_format_of_text_is_pinned(
    name: str, drawn: Callable[[Drawing, Steps], str], drawing: Drawing, facts: Steps, wording: Wording
) -> None:
    wording.file(GOLDEN / name, drawn(drawing, facts))


# -- statuses ----------------------------------------------------------------------------------------------------------
def test_no_two_statuses_look_alike_in_black_and_white(wording: Wording) -> None:
    assert len({mark.glyph for mark in MARKS}) == len(MARKS)
    assert len({mark.letter for mark in MARKS}) == len(MARKS)
    assert len({(mark.line, mark.width) for mark in MARKS} | {mark.words for mark in MARKS}) >= len(MARKS)
    assert all(mark.letter.isascii() and len(mark.glyph) == len(mark.letter) == 1 for mark in MARKS)
    wording(legend(ascii_only=True))


def test_a_failure_that_is_ignored_is_no_failure(drawing: Drawing, facts: Steps) -> None:
    told = next(box for box in walk(drawing.sections) if box.path == "steps/steps[2].parallel[1]")
    assert mark_of(told, facts[told.path]) == IGNORED_FAILURE


@pytest.mark.parametrize(
    ("fact", "note"),
    [
        (None, ""),
        (StepFact(path="", status="success", succeeded=1), ""),
        (StepFact(path="", status="failure", failed=1, code="lost", reason="it was lost"), "lost"),
        (StepFact(path="", status="success", succeeded=2, failed=1), "3 runs, 1 failed"),
        (StepFact(path="", status="running", running=1, succeeded=4, note="round 5"), "round 5, 5 runs"),
    ],
)
def test_what_is_told_of_a_step(fact: StepFact | None, note: str) -> None:
    assert note_of(fact) == note


# -- pictures ----------------------------------------------------------------------------------------------------------
def big(steps: int) -> Drawing:
    """Return a tree of so many steps."""

    def leaf(path: str) -> Box:
        label = (
            StyledSpan("drone.", "agent"),
            StyledSpan("GoTo", "kind"),
            StyledSpan("(to: at_height(drone.home, drone.transit_height))"),
        )
        return Box(path=path, kind="do", label=label, modifiers=("timeout 5 min",), spot=FileSpot("a/x.yaml", 12, 3))

    def block(at: int) -> Box:
        path = f"steps/steps[{at}]"
        inside = tuple(leaf(f"{path}.sequence[{n}]") for n in range(9))
        return Box(path=path, kind="sequence", label=(StyledSpan("sequence", "kind"),), children=inside)

    section = Box(
        kind="section",
        path="steps/",
        label=(StyledSpan("steps"),),
        children=tuple(block(n) for n in range(steps // 10)),
    )
    return Drawing(task="Big", spot=FileSpot("a/x.yaml", 1, 1), sections=(section,))


def test_a_picture_is_as_wide_as_a_page_and_nothing_overlaps(drawing: Drawing, facts: Steps) -> None:
    for one in (outline_of(drawing, facts), outline_of(big(300))):
        assert one.width <= WIDTH
        for above, below in zip(one.rows, one.rows[1:], strict=False):
            assert above.y + above.height <= below.y
        assert all(row.x + row.width <= one.width for row in one.rows)


def test_a_very_deep_tree_keeps_room_for_its_words() -> None:
    inner = Box(path="steps/x", kind="wait", label=(StyledSpan("wait ", "kind"), StyledSpan("5 s")))
    for n in range(40):
        inner = Box(path=f"steps/x{n}", kind="sequence", label=(StyledSpan("sequence", "kind"),), children=(inner,))
    section = Box(kind="section", path="steps/", label=(StyledSpan("steps"),), children=(inner,))
    outline = outline_of(Drawing(task="Deep", spot=FileSpot("x.yaml", 1, 1), sections=(section,)))
    assert len(outline.rows[-1].lines) == 1
    assert outline.width < 2 * WIDTH


def test_no_picture_needs_a_program(drawing: Drawing, facts: Steps, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    for form in ("svg", "dot", "html", "mermaid", "json"):
        assert as_text(form, drawing, facts)
    assert as_png(drawing, facts)[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_tree_too_long_for_png_is_refused(wording: Wording) -> None:
    with pytest.raises(Exception, match="PNG") as refused:
        png_of(big(2_000))
    wording(refused.value)


SVG = "{http://www.w3.org/2000/svg}"


def test_an_svg_has_every_step_once_and_no_link(drawing: Drawing, facts: Steps) -> None:
    svg = svg_of(drawing, facts)
    root = ET.fromstring(svg)
    tips = [one.text or "" for one in root.iter(f"{SVG}title")]
    steps = [box for box in walk(drawing.sections) if is_step(box)]
    for box in steps:
        assert box.spot is not None
        assert len([tip for tip in tips if tip.startswith(f"{box.spot.file}:{box.spot.line} ")]) == 1
    assert "href" not in svg
    assert "<script" not in svg
    assert (root.attrib["width"], len(tips) > len(steps)) == ("508pt", True)


def test_all_of_an_svg_is_on_its_page(drawing: Drawing, facts: Steps) -> None:
    root = ET.fromstring(svg_of(drawing, facts))
    left, top, width, height = (float(word) for word in root.attrib["viewBox"].split())
    for one in root.iter():
        for x, y in places_of(one):
            assert left <= x <= left + width
            assert top <= y <= top + height


def places_of(one: ET.Element) -> list[tuple[float, float]]:
    """Return the corners of an element of a picture."""
    at = one.attrib
    match one.tag.removeprefix(SVG):
        case "text":
            return [(float(at["x"]), float(at["y"]))]
        case "circle":
            x, y, r = (float(at[key]) for key in ("cx", "cy", "r"))
            return [(x - r, y - r), (x + r, y + r)]
        case "rect":
            x, y, width, height = (float(at[key]) for key in ("x", "y", "width", "height"))
            return [(x, y), (x + width, y + height)]
        case "polygon" | "polyline":
            return [(float(x), float(y)) for x, y in (pair.split(",") for pair in at["points"].split())]
    return []


@pytest.mark.parametrize("shape", get_args(Shape))
def test_a_shape_stays_inside_its_place(shape: Shape) -> None:
    root = ET.fromstring(f'<svg xmlns="{SVG[1:-1]}">{shape_of(BoxLook(shape=shape), 10, 20, 40, 40)}</svg>')
    places = [place for one in root.iter() for place in places_of(one)]
    assert (min(x for x, _ in places), max(x for x, _ in places)) == (10, 50)
    assert (min(y for _, y in places), max(y for _, y in places)) == (20, 60)


def test_a_png_has_letters_and_the_size_of_the_page(drawing: Drawing) -> None:
    png = png_of(drawing)
    height = float(ET.fromstring(svg_of(drawing)).attrib["height"].removesuffix("pt"))
    assert int.from_bytes(png[16:20]) == 2 * 508
    assert abs(int.from_bytes(png[20:24]) - 2 * height) <= 1
    with_words = (
        f'<svg xmlns="{SVG[1:-1]}" width="40pt" height="20pt"><text y="15" font-family="DejaVu Sans">{{}}</text></svg>'
    )
    assert painted(with_words.format("►⇉")) != painted(with_words.format(""))


@pytest.mark.external
def test_graphviz_paints_the_places_of_the_layout(drawing: Drawing) -> None:
    outline = outline_of(drawing)
    by_dot = subprocess.run(["dot", "-Tsvg"], input=dot_of(drawing).encode(), capture_output=True, check=True).stdout
    _, _, width, height = (float(word) for word in ET.fromstring(by_dot).attrib["viewBox"].split())
    assert abs(width - outline.width - 8) < 2
    assert height > outline.height


@pytest.mark.parametrize("name", [path.stem for path in sorted((ROOT / "docs/pictures/trees").glob("*.svg"))])
def test_pictures_of_the_documents_show_the_steps_of_the_files(name: str) -> None:
    """`make pictures` draws them anew."""
    path = ROOT / "trees" / f"{name}.yaml"
    if not path.exists():  # drawn from a text of its own
        return
    task = read_task(path, read_world()).task
    assert task is not None
    svg = (ROOT / "docs/pictures/trees" / f"{name}.svg").read_text(encoding="utf-8")
    drawn = drawing_of(task)
    boxes = [*drawn.params, *drawn.vars, *drawn.roles, *(box for box in walk(drawn.sections) if box.spot)]
    lines = [f"{Path(box.spot.file).name}:{box.spot.line}" for box in boxes if box.spot]
    assert sorted(re.findall(r"<title>(?:[^<]*/)?(\w+\.yaml:\d+) ", svg)) == sorted(lines)


# -- pages -------------------------------------------------------------------------------------------------------------
class Seen(HTMLParser):
    """Collects what a browser would see in a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_a_page_loads_nothing_and_runs_no_script_but_its_own(drawing: Drawing, facts: Steps) -> None:
    page = html_of(drawing, facts)
    seen = Seen(page)
    names = [tag for tag, _ in seen.tags]
    assert names.count("script") == 1
    assert not {"link", "img", "iframe", "object", "form"} & set(names)
    assert "b" in names
    assert "default-src 'none'" in page
    assert "script-src 'sha256-" in page
    assert not [attrs for _, attrs in seen.tags if any(key.startswith("on") for key in attrs)]
    assert "notify to ann" in "".join(seen.texts)
    assert "</script> looking" in "".join(seen.texts)


def test_every_step_of_a_page_leads_to_its_line(drawing: Drawing) -> None:
    seen = Seen(html_of(drawing))
    ids = {attrs["id"] for _, attrs in seen.tags if attrs.get("id")}
    links = [attrs["href"] for tag, attrs in seen.tags if tag == "a"]
    steps = [box for box in walk(drawing.sections) if is_step(box) and box.spot and box.spot.file == "look.yaml"]
    assert set(links) <= {f"#{one}" for one in ids}
    assert len([link for link in links if link]) >= len(steps)
    assert {f"f0-{n}" for n in range(1, TEXT.count("\n") + 1)} <= ids


def test_a_page_folds_without_a_script(drawing: Drawing) -> None:
    tags = [tag for tag, _ in Seen(html_of(drawing)).tags]
    assert (
        tags.count("details")
        == tags.count("summary")
        == sum(bool(b.children) for s in drawing.sections for b in walk(s.children))
    )


def test_mermaid_has_no_character_of_a_file_that_means_something_to_it(drawing: Drawing) -> None:
    labels = re.findall(r'"(.*)"', mermaid_of(drawing).partition("flowchart LR")[2])
    for label in labels:
        assert re.fullmatch(r"(?:[\w ,.:()=/+'?!]|<br>|#\d+;)*", label, re.ASCII), label


# -- formats -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("name", "form"), [(f"x{s.upper()}", f) for f, many in SUFFIXES.items() for s in many])
def test_the_ending_of_a_file_is_its_format(name: str, form: str) -> None:
    assert format_of(Path(name)) == form


@pytest.mark.parametrize("name", ["tree", "tree.pdf"])
def test_an_unknown_ending_names_those_that_are_known(name: str) -> None:
    with pytest.raises(UnknownFormat, match=r"\.svg \(svg\).*or --format"):
        format_of(Path(name))


@pytest.mark.parametrize("form", ["dot", "svg", "mermaid", "html", "json"])
def test_what_is_cut_is_said_in_every_format(form: str, drawing: Drawing) -> None:
    text = as_text(form, cut(drawing, collapse=["Twice"]))
    assert ('"hidden": 1' if form == "json" else "(1 more)") in text


def test_two_thousand_steps_are_all_drawn() -> None:
    drawn = draw(big(2_000), {}, width=90)
    assert sum(1 for line in drawn if line.path and not line.path.endswith("/")) == 2_000


def test_signs_that_turn_words_round_are_spelled_on_a_page() -> None:
    label = (StyledSpan("say \u202e dnal ot raelC\x1b[2J", "plain"),)
    box = Box(path="steps/steps[0]", kind="notify", label=label, spot=FileSpot("a.yaml", 1, 1))
    section = Box(path="steps/", kind="section", label=(StyledSpan("steps", "title"),), children=(box,))
    drawing = Drawing(
        task="T", spot=FileSpot("a.yaml", 1, 1), sections=(section,), sources={"a.yaml": "\tx: \u202ey\n"}
    )

    page = html_of(drawing, None, "")

    assert "say \\u202e dnal ot raelC\\x1b[2J" in page
    assert "\tx: \\u202ey" in page
    assert "\u202e" not in page
