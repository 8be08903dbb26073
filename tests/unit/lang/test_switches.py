"""`switch`: what it becomes, what is certain after it, how the state of a drone is followed through it, how it is drawn."""

from collections.abc import Callable

from formiga_bt.lang import model
from formiga_bt.lang.loader import Loaded
from formiga_bt.lang.model import Task
from formiga_bt.lang.places import steps_around
from formiga_bt.show.tree.drawing import drawing_of
from formiga_bt.show.tree.terminal import draw
from tests.golden import Wording

Load = Callable[[str], Loaded]
Read = Callable[[str], Task]

ASK = """
imports: [lib/flying.yaml]
agents:
  drone: {type: lwd}
  picker: {type: picker}
  watcher: {type: watcher}
steps:
  - ask: What now?
    of: [watcher]
    options: [up, track, nothing]
    timeout: 5 min
    save_as: reply
  - switch: reply.answer
    cases:
"""
HOME = """
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
TRACK = "[{do: picker.MiniFinder, with: {base: '${base}'}, save_as: fix}]"


def codes(loaded: Loaded) -> list[str]:
    return [d.code for d in loaded.diagnostics if d.code != "W060"]


def test_its_steps_are_numbered_by_case(task: Read) -> None:
    found = task(
        "params: {n: int}\nagents: {watcher: {type: watcher}}\nsteps:\n  - switch: n\n    cases:\n"
        "      -1: [{notify: a, to: [watcher]}]\n      3: [{wait: 1 s}, {wait: 2 s}]\n    default: [{wait: 3 s}]\n"
    )

    (step,) = found.steps
    assert isinstance(step, model.Switch)
    assert [case.value for case in step.cases] == [-1, 3]
    assert [[one.seg for one in branch] for branch in step.branches] == [
        ["case0[0]"],
        ["case1[0]", "case1[1]"],
        ["default[0]"],
    ]
    assert [one.kind for one in steps_around(found, "steps/steps[0].case1[1]")] == ["switch", "wait"]


def test_what_every_case_saves_is_sure_after_it(load: Load) -> None:
    use = "  - do: drone.TakeOff\n  - do: drone.GoTo\n    with: {to: '${above(fix.go_to, 40 m)}'}\n" + HOME
    sure = f"      up: {TRACK}\n      track: {TRACK}\n      nothing: {TRACK}\n"
    some = f"      up: {TRACK}\n      track: {TRACK}\n    default: [{{wait: 1 s}}]\n"

    assert codes(load(ASK + sure + use)) == []
    assert codes(load(ASK + some + use)) == ["E019"]


def test_a_case_that_leaves_the_drone_in_the_air_is_named(load: Load, wording: Wording) -> None:
    text = ASK + "      track: [{wait: 1 s}]\n      up: [{do: drone.TakeOff}]\n    default: [{wait: 1 s}]\n"

    found = load(text + "  - do: drone.GoTo\n    with: {to: '${above(base, 40 m)}'}\n" + HOME).diagnostics
    (problem,) = [d for d in found if d.code != "W060"]
    assert problem.code == "E030"
    wording(problem.message)
    assert codes(load(text + HOME + "    when: drone.airborne\n")) == []
    assert "E031" in codes(load(text))


def test_steps_after_a_switch_all_of_whose_cases_fail_never_run(load: Load) -> None:
    dead = "      up: [{fail: a}]\n      track: [{fail: b}]\n      nothing: [{fail: c}]\n  - wait: 1 s\n"

    assert codes(load(ASK + dead)) == ["E043"]


def test_cases_may_be_called_like_words_of_the_language(load: Load) -> None:
    loaded = load(
        "params: {way: {type: enum, values: [set, with, save_as]}}\nagents: {picker: {type: picker}}\nsteps:\n"
        f"  - switch: way\n    cases:\n      set: {TRACK}\n      with: {TRACK}\n      save_as: {TRACK}\n"
        "  - notify: Go to ${fix.go_to}.\n"
    )

    assert loaded.diagnostics == []


def test_it_is_drawn_with_its_cases(task: Read) -> None:
    found = task(
        "params: {n: int}\nagents: {watcher: {type: watcher}}\nsteps:\n  - switch: n + 1\n    cases:\n"
        "      2: [{notify: two, to: [watcher]}]\n    default: [{wait: 3 s}]\n"
    )

    drawn = "\n".join(line.plain() for line in draw(drawing_of(found), width=60, ascii_only=True))
    for text in ("switch n + 1", "2", 'notify to watcher: "two"', "default", "wait 3 s"):
        assert text in drawn
