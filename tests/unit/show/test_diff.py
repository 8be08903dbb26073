"""What changed between two tasks, told as people tell it, and drawn to the letter."""

from pathlib import Path
from textwrap import dedent

import pytest

from formiga_bt.lang.loader import load_catalogue, load_task
from formiga_bt.lang.model import Catalogue
from formiga_bt.show.diff.caution import cautions
from formiga_bt.show.diff.changes import Difference, compare
from formiga_bt.show.diff.matching import rising
from formiga_bt.show.diff.terminal import draw
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
CATALOGUE: Catalogue = load_catalogue([ROOT / "actions" / "base.yaml"])[0]

BEFORE = """\
formiga: 1
task: Look
timeout: 20 min
params:
  spot: place
  height: {type: distance, default: 60 m}
agents:
  drone: {type: lwd, near: "${spot}", battery_min: 50 %}
  eve: {type: watcher}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${above(spot, height)}"}
    timeout: 5 min
  - ask: May it come down?
    of: [eve]
    options: [yes_, no_]
    expect: result.answer == 'yes_'
  - wait: 10 s
  - do: drone.GoTo
    with: {to: "${above(drone.home, 40 m)}"}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
on_failure:
  - notify: It failed.
"""


def differ(tmp_path: Path, before: str, after: str) -> Difference:
    loaded = []
    for name, text in (("a.yaml", before), ("b.yaml", after)):
        (tmp_path / name).write_text(dedent(text), encoding="utf-8")
        one = load_task(tmp_path / name, catalogue=CATALOGUE)
        assert one.task is not None, [f"{d.mark} {d.message}" for d in one.diagnostics]
        loaded.append(one)
    old, new = loaded
    assert old.task is not None
    assert new.task is not None
    return compare(old.task, new.task, old.sources, new.sources)


def lines(difference: Difference, width: int = 80, *, ascii_only: bool = True) -> list[str]:
    look_at = cautions(difference, CATALOGUE.actions)
    return [line.plain() for line in draw(difference, look_at, width=width, ascii_only=ascii_only)]


def told(difference: Difference) -> list[str]:
    return [
        f"{c.what} {c.title}" + (f": {'; '.join(f.in_words() for f in c.fields)}" if c.fields else "")
        for c in difference.changes
    ]


def edited(*edits: tuple[str, str]) -> str:
    text = BEFORE
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return text


def test_units_keys_quotes_spaces_and_comments_are_no_change(tmp_path: Path) -> None:
    after = edited(
        ("default: 60 m", "default: 0.06 km"),
        ("timeout: 20 min", "timeout: 1200 s   # long enough"),
        ("${above(spot, height)}", "${ above( spot,height ) }"),
        ("40 m)", "0.04 km)"),
        ("  - wait: 10 s", '  # a pause\n  - wait: "10 s"'),
        ("{type: distance, default: 0.06 km}", "{default: 0.06 km, type: distance}"),
        ("    of: [eve]\n    options: [yes_, no_]\n", "    options: [ yes_, no_ ]\n    of: [ eve ]\n"),
    )

    assert told(differ(tmp_path, BEFORE, after)) == []
    assert lines(differ(tmp_path, BEFORE, after)) == []


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("default: 60 m", "default: 80 m"), ["changed param height: default: 60 m -> 80 m"]),
        (("    timeout: 5 min\n", ""), ["changed drone.GoTo: timeout removed: 5 min"]),
        (("  - wait: 10 s\n", "  - wait: 10 s\n    timeout: 15 min\n"), ["changed wait 10 s: timeout added: 15 min"]),
        (("  - wait: 10 s\n", ""), ["removed wait 10 s"]),
        (("wait: 10 s", "wait: 12 s"), ["changed wait 12 s: wait: 10 s -> 12 s"]),
        (("drone", "scout"), ["renamed scout: name: drone -> scout"]),
        (("height", "up"), ["renamed up: name: height -> up"]),
        (("eve", "ann"), ["renamed ann: name: eve -> ann"]),
        (("type: lwd", "any_of: [lwd, hwd]"), ["changed role drone: type: lwd -> lwd or hwd"]),
        (("timeout: 20 min\n", ""), ["changed Look: timeout removed: 20 min"]),
        (("  - notify: It failed.", "  - notify: It failed.\n    severity: alarm"),
         ["changed notify It failed.: severity: info -> alarm"]),
        (("  - wait: 10 s\n", "  - guard: drone.battery > 30 %\n    steps:\n      - wait: 10 s\n"),
         ["added guard drone.battery > 30 %"]),
        (("  - wait: 10 s\n", "  - retry: {attempts: 3, delay: 5 s}\n    wait: 10 s\n"),
         ["changed wait 10 s: retry attempts added: 3; retry delay added: 5 s"]),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)  # fmt: skip
def test_one_edit_is_told_as_that_edit(tmp_path: Path, edit: tuple[str, str], said: list[str]) -> None:
    assert told(differ(tmp_path, BEFORE, edited(edit))) == said


def test_a_step_that_changed_its_place_has_moved_and_nothing_else(tmp_path: Path, wording: Wording) -> None:
    after = edited(("  - wait: 10 s\n", ""), ("steps:\n", "steps:\n  - wait: 10 s\n"))
    difference = differ(tmp_path, BEFORE, after)

    wording(told(difference))
    change = difference.changes[0]
    assert (change.from_path, change.path) == ("steps/steps[3]", "steps/steps[0]")


def test_a_rename_with_a_change_is_told_as_both(tmp_path: Path, wording: Wording) -> None:
    after = edited(("drone", "scout"), ("battery_min: 50 %", "battery_min: 30 %"))

    wording(told(differ(tmp_path, BEFORE, after)))


def test_a_change_in_an_import_is_told_once_however_often_it_is_called(tmp_path: Path, wording: Wording) -> None:
    library = dedent("""\
        formiga: 1
        subtrees:
          Pause:
            params: {drone: agent}
            steps:
              - wait: 5 s
              - do: drone.GoTo
                with: {to: "${above(drone.home, 40 m)}"}
        """)
    for name, text in (("one", library), ("two", library.replace("5 s", "7 s"))):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    call = "  - call: Pause\n    with: {drone: '${drone}'}\n"
    before = edited(("  - wait: 10 s\n", call * 3), ("task: Look\n", "task: Look\nimports: [one.yaml]\n"))

    wording(told(differ(tmp_path, before, before.replace("one.yaml", "two.yaml"))))


def test_points_and_lists_are_compared_by_what_they_say(tmp_path: Path, wording: Wording) -> None:
    def at(point: str) -> str:
        return edited(("${above(spot, height)}", "HERE")).replace('"HERE"', point)

    here = at("{lat: 60.45, lng: 22.26, height: '${height}'}")

    assert told(differ(tmp_path, here, at("{height: '${ height }', lng: 22.26, lat: 60.45}"))) == []
    wording(told(differ(tmp_path, here, at("{lat: 60.46, lng: 22.26, height: '${height}'}"))))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("  - wait: 10 s\n", "  - wait: 12 s\n"), []),
        (("    timeout: 5 min\n", ""), ["timeout of drone.GoTo is removed: 5 min"]),
        (("    timeout: 5 min\n", "    timeout: 2 min\n"), []),
        (("timeout: 20 min", "timeout: 2 h"), ["timeout of the task is longer: 20 min -> 2 h"]),
        (("default: 60 m", "default: 80 m"), ["flies higher, default of param height: 60 m -> 80 m"]),
        (("default: 60 m", "default: 50 m"), []),
        (("40 m)", "90 m)"), ["flies higher, to of drone.GoTo: above(drone.home, 40 m) -> above(drone.home, 90 m)"]),
        (("type: lwd", "any_of: [lwd, hwd]"), ["other agents for role drone: lwd -> lwd or hwd"]),
        (("battery_min: 50 %", "battery_min: 30 %"), ["role drone needs less charge: 50 % -> 30 %"]),
        (("on_failure:\n  - notify: It failed.\n", ""), ["removed from on_failure: notify It failed."]),
        (("    expect: result.answer == 'yes_'\n", ""),
         ["the condition 'expect' of ask May it come down?: result.answer == 'yes_' -> none"]),
        (("  - wait: 10 s\n", "  - wait: 10 s\n    ignore_failure: true\n"), ["ignore_failure of wait 10 s added"]),
    ],
    ids=lambda value: (value or ["nothing"])[-1] if isinstance(value, list) else "",
)  # fmt: skip
def test_what_may_be_less_safe_is_pointed_out(tmp_path: Path, edit: tuple[str, str], said: list[str]) -> None:
    difference = differ(tmp_path, BEFORE, edited(edit))

    assert [one.text for one in cautions(difference, CATALOGUE.actions)] == said


def test_a_landing_that_is_gone_is_pointed_out(tmp_path: Path, wording: Wording) -> None:
    called = edited(
        ("  - do: drone.LandIn\n    with: {at: \"${drone.home}\"}\n", "  - call: ReturnHome\n    with: {drone: '${drone}'}\n"),
        ("task: Look\n", "task: Look\nimports: [lib/flying.yaml]\n"),
    )  # fmt: skip

    wording([one.text for one in cautions(differ(tmp_path, BEFORE, called), CATALOGUE.actions)])
    wording([one.text for one in cautions(differ(tmp_path, called, BEFORE), CATALOGUE.actions)])


AFTER = (
    ("default: 60 m", "default: 80 m"),
    ("    timeout: 5 min\n", ""),
    ("  - wait: 10 s\n", ""),
    ("on_failure:\n", "on_failure:\n  - wait: 10 s\n"),
    ("  - do: drone.LandIn", "  - notify: Nearly home.\n  - do: drone.LandIn"),
    ("  - ask: May it come down?\n    of: [eve]\n    options: [yes_, no_]\n    expect: result.answer == 'yes_'\n", ""),
    ("  eve: {type: watcher}\n", ""),
)


def test_the_drawing(tmp_path: Path) -> None:
    assert "\n".join(lines(differ(tmp_path, BEFORE, edited(*AFTER)), 76)) == DRAWN.strip("\n")


def test_the_drawing_where_lines_are_short(tmp_path: Path) -> None:
    difference = differ(tmp_path, BEFORE, edited(*AFTER))
    for width in (40, 50, 120):
        for plain in (True, False):
            assert all(len(line) <= width for line in lines(difference, width, ascii_only=plain))
    assert all(line.isascii() for line in lines(difference, 40))


DRAWN = """
  Look                                                              b.yaml:2
  params
  |- spot: place                                                    b.yaml:5
~ `- height: distance = 80 m                                        b.yaml:6
          default: 60 m -> 80 m
  agents
  |- drone: lwd  [near spot; battery >= 50 %]                       b.yaml:8
- `- eve: watcher                                                   a.yaml:9
  steps
  |- drone.TakeOff(altitude: agent.transit_height)                 b.yaml:10
~ |- drone.GoTo(to: above(spot, height))                           b.yaml:11
  |       timeout removed: 5 min
- |- ask eve: "May it come down?" yes_ / no_  [expect result.a...  a.yaml:15
  |- drone.GoTo(to: above(drone.home, 40 m))                       b.yaml:13
+ |- notify: "Nearly home." (info)                                 b.yaml:15
  `- drone.LandIn(at: drone.home)                                  b.yaml:16
  on_failure
> |- wait 10 s                                                     b.yaml:19
  |       moved from a.yaml:19, out of steps
  `- notify: "It failed." (info)                                   b.yaml:20

look at
! flies higher, default of param height: 60 m -> 80 m  (b.yaml:6)
! timeout of drone.GoTo is removed: 5 min  (b.yaml:11)
! wait 10 s moved from steps to on_failure  (b.yaml:19)
! a question is removed: ask May it come down?  (a.yaml:15)

2 changed, 1 moved, 1 added, 2 removed
"""


@pytest.mark.parametrize(
    ("numbers", "weights", "row"),
    [
        ([], None, []),
        ([0, 1, 2], None, [0, 1, 2]),
        ([1, 2, 0], None, [0, 1]),
        ([1, 2, 0], [1, 1, 5], [2]),
        ([4, 0, 1, 5, 2], None, [1, 2, 4]),
    ],
)
def test_the_heaviest_rising_row(numbers: list[int], weights: list[int] | None, row: list[int]) -> None:
    found = rising(numbers, weights)

    assert sum((weights or [1] * len(numbers))[i] for i in found) == sum(
        (weights or [1] * len(numbers))[i] for i in row
    )
    assert [numbers[i] for i in found] == sorted(numbers[i] for i in found)
