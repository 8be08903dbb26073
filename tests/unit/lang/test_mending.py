"""`formiga fix`: each code with a repair that alone can be meant, what is left alone, and that nothing else is touched."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings

from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.lang.any_file import check_text
from formiga_bt.lang.loader import load_catalogue, load_site, load_task
from formiga_bt.lang.text.fixing import FixedFile, mend
from tests.golden import Wording
from tests.property.test_loader_never_raises import TASKS, mutated

ROOT = Path(__file__).parents[3]
BASE = ROOT / "actions" / "base.yaml"
CATALOGUE = load_catalogue([BASE])[0]
SITE = load_site(ROOT / "trees" / "demo-site.yaml", CATALOGUE)[0]
HEAD = """\
formiga: 1
task: Example
imports: [lib/flying.yaml]
params: {target: place, robot: {type: agent, of: [lwd], optional: true}}
agents:
  drone: {type: lwd, near: "${target}", prefer: "${robot}"}
  watcher: {type: watcher}
steps:
"""

MENDS = [
    ("E001", "  - do: drone.GoTo\n    with: {to: ${above(target, 60 m)}}", '    with: {to: "${above(target, 60 m)}"}'),
    ("E001", "  - notify: Row 3: come here", '  - notify: "Row 3: come here"'),
    ("E001", "  - check: !drone.airborne", "  - check: not drone.airborne"),
    ("E001", "  - do drone.TakeOff\n    timeout: 2 min", "  - do: drone.TakeOff"),
    ("E001", "  - sequence\n    - wait: 1 s", "  - sequence:"),
    ("E005", "  - do drone.TakeOff", "  - do: drone.TakeOff"),
    ("E005", "  - wait:1 s", "  - wait: 1 s"),
    ("E005", "  - TakeOff", "  - do: drone.TakeOff"),
    ("E004", "  - do: drone.TakeOff\n    args: {altitude: 30 m}", "    with: {altitude: 30 m}"),
    ("E004", "  - do: drone.TakeOff\n    timeot: 2 min", "    timeout: 2 min"),
    ("E004", "  - repeat: 2\n    parallel: true\n    steps: [{wait: 1 s}]", "    mode: parallel"),
    (
        "E004",
        "  - repeat: forever\n    rate: 2 Hz\n    until: drone.airborne\n    steps: [{wait: 1 s}]",
        "    every: 500 ms",
    ),
    ("E006", "  - selector:\n      - wait: 1 s", "  - fallback:"),
    ("E006", "  - first_of:\n      - wait: 1 s\n      - wait: 2 s", "  - race:"),
    ("E006", "  - wait_while: drone.airborne", "  - wait_until: not (drone.airborne)"),
    ("E008", "  - ask: Clear?\n    of: watcher", "    of: [watcher]"),
    ("E008", "  - wait: 1 s\n    retry: 3", "    retry: {attempts: 3}"),
    ("E008", "  - wait: 1 s\n    critical: yes", "    critical: true"),
    ("E009", "  - check: drone.airborne && 1 < 2", "  - check: drone.airborne and 1 < 2"),
    ("E010", "  - check: tagret == base", "  - check: target == base"),
    ("E011", "  - check: drone.batery > 30 %", "  - check: drone.battery > 30 %"),
    ("E012", "  - check: distence(target, base) < 5 m", "  - check: distance(target, base) < 5 m"),
    ("E013", "  - check: triangle(target, 20 m)[-1] == base", "  - check: last(triangle(target, 20 m)) == base"),
    (
        "E014",
        "  - ask: Ok?\n    of: [watcher]\n    expect: result.answer == 'yess'",
        "    expect: result.answer == 'yes'",
    ),
    ("E015", "  - check: ${drone.airborne} and 1 < 2", "  - check: drone.airborne and 1 < 2"),
    ("E016", "  - do: drone.LandIn\n    with:\n      at: target", "      at: ${target}"),
    ("E017", "  - do: drone.TakeOff\n    with: {altitude: 30}", "    with: {altitude: 30 m}"),
    ("E020", "  - do: dron.TakeOff", "  - do: drone.TakeOff"),
    ("E021", "  - do: drone.Takeoff", "  - do: drone.TakeOff"),
    ("E021", "  - do: drone.Land", "  - do: drone.LandIn"),
    ("E022", "  - do: drone.TakeOff\n    with: {altitud: 30 m}", "    with: {altitude: 30 m}"),
    ("E047", "  - switch: drone.control\n    cases: {enginee: [{wait: 1 s}]}", "    cases: {engine: [{wait: 1 s}]}"),
    ("E050", "  - call: ReturnHom\n    with: {drone: '${drone}'}", "  - call: ReturnHome"),
    (
        "E066",
        "  - do: drone.LandIn\n    with:\n      at: ${above(target, 5 m)}",
        "      at: ${ground(above(target, 5 m))}",
    ),
    (
        "W088",
        "  - with_agents: {scout: {type: lwd}}\n    steps:\n      - call: FlyTo\n        with: "
        "{drone: '${scout}', to: '${target}', height: 30 m}\n      - call: ReturnHome\n        with: {drone: '${scout}'}",
        '{scout: {type: lwd, near: "${target}"}}',
    ),
    ("W070", "  - check: drone.battery > 0.3 %", "  - check: drone.battery > 30 %"),
]

LEFT = [
    ("E017", "  - wait: 15", "seconds or minutes"),
    ("E066", "  - do: drone.GoTo\n    with:\n      to: ${target}", "nobody said how high"),
    ("E006", "  - retries: 3\n    do: drone.TakeOff", "three tries, or three more"),
    ("E006", "  - until: drone.airborne", "a loop, or a wait"),
]


def fixed(text: str, name: str = "task.yaml") -> FixedFile:
    path = ROOT / "trees" / name

    def check(new: str) -> list[Diagnostic]:
        return check_text(new, path, CATALOGUE, [BASE], SITE)

    return mend(text, str(path), check)


@pytest.mark.parametrize(("code", "steps", "mended"), MENDS, ids=lambda value: value[:20].strip())
def test_a_mistake_with_one_repair_is_mended(code: str, steps: str, mended: str) -> None:
    done = fixed(HEAD + steps + "\n")

    assert mended in done.text
    assert code in {d.code for d in done.applied}
    assert code == "W070" or code not in {d.code for d in done.left if d.fix}


@pytest.mark.parametrize(("code", "steps", "why"), LEFT, ids=lambda value: value[:20].strip())
def test_what_may_be_meant_in_two_ways_is_left_to_the_author(code: str, steps: str, why: str) -> None:
    done = fixed(HEAD + steps + "\n")

    assert done.text == HEAD + steps + "\n", why
    assert done.left


FLIGHT = """\
steps:
  - call: FlyTo
    with: {drone: "${drone}", to: "${target}", height: 30 m}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


@pytest.mark.parametrize(
    ("role", "mended"),
    [
        ("{type: lwd}", '{type: lwd, near: "${target}"}'),
        ("{any_of: [lwd, hwd]}", '{near: "${target}", any_of: [lwd, hwd]}'),
        ("{type: lwd, wait: 5 min}", '{type: lwd, near: "${target}", wait: 5 min}'),
        ("\n    type: lwd  # a small one", "\n    near: ${target}\n    type: lwd  # a small one"),
        (
            "\n    type: lwd  # a small one\n    # soon\n    wait: 5 min",
            "\n    type: lwd  # a small one\n    # soon\n    near: ${target}\n    wait: 5 min",
        ),
    ],
)
def test_a_role_gets_the_place_that_it_goes_to_first(role: str, mended: str) -> None:
    head = "formiga: 1\ntask: Example\nimports: [lib/flying.yaml]\nparams: {target: place}\nagents:\n  drone: "

    done = fixed(head + role + "\n" + FLIGHT)

    assert done.text == head + mended + "\n" + FLIGHT
    assert not done.left


def test_a_place_that_may_be_missing_is_not_written_for_a_role() -> None:
    head = "formiga: 1\ntask: Example\nimports: [lib/flying.yaml]\nparams: {target: {type: place, optional: true}}\n"
    steps = FLIGHT.replace("  - call: FlyTo", "  - call: FlyTo\n    when: is_set(target)")

    done = fixed(head + "agents:\n  drone: {type: lwd}\n" + steps)

    assert "near" not in done.text


def test_names_that_differ_by_a_number_are_not_exchanged() -> None:
    steps = HEAD.replace("  watcher: {type: watcher}", "  drone_2: {type: lwd}") + "  - do: drone_3.TakeOff\n"

    assert "drone_3.TakeOff" in fixed(steps).text


def test_the_version_is_put_first_below_the_comments() -> None:
    done = fixed("# A task.\ntask: Example\nsteps:\n  - wait: 1 s\n")

    assert done.text == "# A task.\nformiga: 1\ntask: Example\nsteps:\n  - wait: 1 s\n"
    assert not done.left


def test_one_mend_brings_the_next_to_light(wording: Wording) -> None:
    done = fixed(HEAD + "  - action: drone.goto\n    args: {to: ${above(targt, 60 m)}}\n")

    wording(done.text)


def test_line_ends_stay_as_they_are() -> None:
    text = (HEAD + "  - sleep: 1 s\n").replace("\n", "\r\n")

    assert fixed(text).text == text.replace("sleep", "wait")


def test_sites_and_libraries_are_mended_too() -> None:
    site = (ROOT / "trees" / "demo-site.yaml").read_text()
    library = (ROOT / "trees" / "lib" / "flying.yaml").read_text()

    assert fixed(site.replace("home: p1", "home: P1"), "demo-site.yaml").text == site
    assert fixed(library.replace("drone.LandIn", "drone.Landin"), "lib/other.yaml").text == library


def test_every_code_of_the_museum_that_has_a_fix_is_tried_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT / "tests" / "lang_errors")
    found = set()
    for path in Path().glob("[EW]*.yaml"):
        site = SITE if "of_site" in path.name else None
        found |= {d.code for d in load_task(path, catalogue=CATALOGUE, site=site).diagnostics if d.fix is not None}

    assert found - {code for code, _, _ in MENDS} - {"E007"} == set()


@settings(max_examples=150, deadline=None)
@given(mutated(TASKS))
def test_only_flagged_lines_change(text: str) -> None:
    done = fixed(text)
    flagged = {line for d in done.applied if d.fix for line in range(d.fix.mark.line, (d.fix.mark.end_line or 0) + 1)}
    if done.text == text:
        assert not done.applied or flagged
        return
    inserted = sum((d.fix.text.count("\n") if d.fix else 0) for d in done.applied)
    before, after = re.split("\r\n|\r|\n", text), re.split("\r\n|\r|\n", done.text)
    assert len(after) == len(before) + inserted
    if not inserted:
        assert {n for n, (a, b) in enumerate(zip(before, after, strict=True), 1) if a != b} <= flagged
