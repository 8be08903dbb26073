# ruff: noqa: E501  (pieces of trees stand on one line)
"""The oracles of the language-model experiment accept the shipped trees and refuse wrong ones, each for its own reason."""

import pytest

from experiments.e2_llm.fly import World, fly, world_of
from experiments.e2_llm.fresh import FRESH
from experiments.e2_llm.judging import judge
from experiments.e2_llm.oracles import ORACLES
from experiments.e2_llm.requests import Request, requests
from experiments.e2_llm.verdicts import Verdict
from formiga_bt.base.packaged import folder

WORLD: World = world_of()
TASKS = list(ORACLES)


def reference(request: Request) -> str:
    return (folder("trees") / f"{request.reference}.yaml").read_text(encoding="utf-8")


def judged(request: Request, text: str, values: dict[str, str] | None = None) -> Verdict:
    given = request.values if values is None else values
    return judge(request.task, request.goal, lambda scene: fly(text, given, WORLD, scene), request.scenes)


@pytest.mark.parametrize("task", TASKS)
def test_the_shipped_tree_does_what_is_asked(task: str) -> None:
    runs = {"T5": (0,), "T7": (0, 15)}.get(task, (0, 10, 20))
    for request in (requests(task, WORLD)[run] for run in runs):
        assert str(judged(request, reference(request))) == "right", request


@pytest.mark.parametrize("task", FRESH)
def test_the_shipped_tree_does_what_fresh_wordings_ask(task: str) -> None:
    for request in requests(task, WORLD, 10, 30)[::3]:
        assert str(judged(request, reference(request))) == "right", request


PARAMS = "params"
HOME = "  - call: ReturnHome\n    with:\n      drone: ${drone}\n"
LAND_HERE = "  - do: drone.LandIn\n    with:\n      at: ${ground(drone.position)}\n"
ASK = "  - ask: Both drones have landed. May they fly on?\n    of: [watcher]\n"
WRONG = [
    ("T1", "another drone", {PARAMS: {"robot": "lwd_3"}}, "wrong_drone"),
    ("T1", "stays where it is", {"  - call: ReturnHome": "  - call: LandNear",
                                 "      drone: ${drone}\n": "      drone: ${drone}\n      at: ${ground(drone.position)}\n"},
     "not_home"),
    ("T2", "only a visit", {"do: drone.Explore\n    with:\n      region: ${region}\n      altitude: ${altitude}\n":
                            "do: drone.GoTo\n    with:\n      to: ${above(centroid(region), altitude)}\n"}, "not_explored"),
    ("T2", "another region", {PARAMS: {"region": "?other"}},
     "not_explored"),
    ("T2", "a heavy drone", {"type: lwd": "type: hwd", "of: [lwd]": "of: [hwd]", "drone.Explore\n    with:\n      region: ${region}\n      altitude: "
                             "${altitude}\n": "drone.GoTo\n    with:\n      to: ${above(centroid(region), altitude)}\n"},
     "wrong_machine"),
    ("T3", "nobody is asked", {"  - ask: Are the": "  - notify: Are the", "    of: [picker, watcher]\n": "",
                               "    options: [loaded, nothing_to_load, not_yet]\n": "",
                               "    clears: {role: drone, on: [loaded, nothing_to_load]}\n": "",
                               "    escalate_after: 5 min\n    timeout: 15 min\n": "",
                               "    retry: {attempts: 3, delay: 2 min}\n    expect: result.answer != 'not_yet'\n": "",
                               "  picker:\n    type: picker\n    id: ${user}\n  watcher: {type: watcher}\n": ""}, "not_asked"),
    ("T3", "another place", {PARAMS: {"target": "camp", "user": "picker_1"}}, "not_landed_at_target"),
    ("T3", "a light drone", {"type: hwd": "type: lwd", "of: [hwd]": "of: [lwd]"}, "wrong_machine"),
    ("T4", "asked before it flies", {"swap": ("  - call: FlyTo", "  - ask:", "  - notify:")}, "asked_early"),
    ("T4", "another place", {PARAMS: {"alarmtype": "sos", "target": "camp"}}, "not_at_target"),
    ("T5", "follows in any case", {"if: reply.answer == 'yes'": "if: is_set(reply)"}, "followed_anyway"),
    ("T5", "one fix only", {"repeat: forever ": "repeat: 1 ", "while: not there ": "while: there "}, "followed_too_short"),
    ("T5", "never follows", {"if: reply.answer == 'yes'": "if: reply.answer == 'no'"}, "not_followed"),
    ("T6", "half a circle", {"spot: ${circle(middle, radius, points=points)}":
                             "spot: ${line(offset(middle, north=radius), offset(middle, north=-radius), 5)}"}, "no_circle"),
    ("T6", "a square", {"circle(middle, radius, points=points)": "circle(middle, radius, points=4)"}, "no_circle"),
    ("T6", "too wide", {"circle(middle, radius": "circle(middle, radius * 1.5"}, "no_circle"),
    ("T6", "round another place", {"circle(middle, radius": "circle(offset(middle, east=40 m), radius"}, "no_circle"),
    ("T6", "not back to the centre", {"to: ${middle}": "to: ${toward(middle, at_height(drone.home, 20 m), radius)}"}, "not_at_center"),
    ("T6", "a heavy drone", {"type: lwd": "type: hwd", "of: [lwd]": "of: [hwd]"}, "wrong_machine"),
    ("T6", "lands at the centre", {HOME: LAND_HERE}, "not_home"),
    ("T6", "uneven", {"- do: drone.GoTo\n        with:\n          to: ${spot}": "- do: drone.GoTo\n        with:\n          "
                      "to: ${offset(spot, up=distance(spot, middle) * 2 if bearing(middle, spot) > 180 deg else 0 m)}"},
     "not_level"),
    ("T7", "in a line", {"spots: ${triangle(corner, leg, heading)}":
                         "spots: ${line(offset(corner, east=-leg), offset(corner, east=leg), 3)}"}, "no_formation"),
    ("T7", "another corner", {"triangle(corner, leg, heading)": "triangle(offset(corner, east=20 m), leg, heading)"},
     "no_formation"),
    ("T7", "short legs", {"triangle(corner, leg, heading)": "triangle(corner, leg / 2, heading)"}, "no_formation"),
    ("T7", "one after the other", {"drones}\n      spot: ${spots}\n    mode: parallel\n    steps:\n      - do: drone.LandIn":
                                   "drones}\n      spot: ${spots}\n    steps:\n      - wait: 1 min\n      - do: drone.LandIn"},
     "not_together"),
    ("T7", "two only", {"count: 3": "count: 2", "${triangle(corner, leg, heading)}":
                        "${line(corner, offset(corner, east=leg), 2)}"}, "wrong_count"),
    ("T7", "home instead", {"      - do: drone.LandIn\n        with:\n          at: ${spot}\n":
                            "      - call: ReturnHome\n        with:\n          drone: ${drone}\n"}, "not_landed_there"),
    ("T7", "no barrier", {"      - do: drone.GoTo\n        with:\n          to: ${above(spot, altitude)}\n  - for:\n      drone: "
                          "${drones}\n      spot: ${spots}\n    mode: parallel\n    steps:\n": "",
                          "mode: parallel\n    steps:\n      - call: FlyOver": "steps:\n      - call: FlyOver",
                          "          to: ${spot}\n  - for:                                              # the formation stands "
                          "before any lands\n      drone: ${drones}\n      spot: ${spots}\n    mode: parallel\n    steps:\n":
                          "          to: ${spot}\n"}, "no_formation"),
    ("T8", "a straight line", {"zigzag(start, end, amplitude, legs)": "line(start, end, legs)"}, "no_zigzag"),
    ("T8", "too few legs", {"amplitude, legs)": "amplitude, 3)"}, "no_zigzag"),
    ("T8", "too many legs", {"amplitude, legs)": "amplitude, legs + 4)"}, "wrong_legs"),
    ("T8", "too wide", {"amplitude, legs)": "amplitude * 2, legs)"}, "too_wide"),
    ("T8", "half as wide", {"amplitude, legs)": "amplitude * 0.6, legs)"}, "wrong_amplitude"),
    ("T8", "comes home", {"  - do: drone.LandIn                                  # away from a port: people are asked to stand "
                          "clear\n    with:\n      at: ${end}\n": HOME}, "not_landed_there"),
    ("T8", "there and back", {"spot: ${zigzag(start, end, amplitude, legs)}\n    steps:\n":
                              "spot: ${zigzag(start, end, amplitude, legs)}\n    steps:\n      - do: drone.GoTo\n        with:\n"
                              "          to: ${above(start, altitude)}\n"}, "went_back"),
    ("T8", "not by the start", {"to: ${start}\n": "to: ${midpoint(start, end)}\n",
                                "zigzag(start,": "zigzag(midpoint(start, end),"}, "not_at_start"),
    ("T9", "half a circle", {"circle(above(target, height), radius, points=points)":
                             "circle(above(target, height), radius, points=3)"}, "no_circle"),
    ("T9", "round another place", {"circle(above(target,": "circle(above(offset(target, east=30 m),"}, "no_circle"),
    ("T9", "escort beside", {"escort.LandIn\n        with:\n          at: ${target}":
                             "escort.LandIn\n        with:\n          at: ${offset(target, east=5 m)}"}, "no_escort"),
    ("T9", "another radius", {PARAMS: {"target": "?", "radius": "30 m"}}, "no_circle"),
    ("T9", "heavy drones", {"type: lwd": "type: hwd", "of: [lwd]": "of: [hwd]"}, "wrong_machine"),
    ("T10", "nobody is asked", {ASK: "  - wait: 5 s\n", "    timeout: 15 min\n    expect: result.answer == 'yes'\n": "",
                                "  watcher: {type: watcher}\n": ""}, "not_asked"),
    ("T10", "asked before they land", {"swap": ("  - parallel:\n      - do: going_home.LandIn", "  - ask:", "  - parallel:")},
     "asked_early"),
    ("T10", "goes on after a no", {"    expect: result.answer == 'yes'\n": ""}, "flew_on"),
    ("T10", "too far apart", {"east=spacing": "east=spacing + 10 m"}, "wrong_spacing"),
    ("T10", "both come home", {PARAMS: {"return_second": "true"}}, "not_at_next_stop"),
    ("T10", "stop and target exchanged", {PARAMS: {"exchange": "1"}}, "not_landed_there"),
    ("T10", "heavy drones", {"type: lwd": "type: hwd", "of: [lwd]": "of: [hwd]"}, "wrong_machine"),
    ("T10", "the first stays", {"      - call: ReturnHome\n        with:\n          drone: ${going_home}\n":
                                "      - do: going_home.LandIn\n        with:\n          at: ${target}\n"}, "not_home"),
]  # fmt: skip


def changed(text: str, request: Request, changes: dict[str, object]) -> tuple[str, dict[str, str]]:
    values = dict(request.values)
    for old, new in changes.items():
        if old == PARAMS:
            assert isinstance(new, dict)
            values |= {name: value for name, value in new.items() if value != "?" and name != "exchange"}
            if "?other" in new.values():
                values["region"] = "lake" if request.values["region"] == "bog" else "bog"
            if "exchange" in new:
                values["target"], values["next_stop"] = values["next_stop"], values["target"]
        elif old == "swap":
            first, second, end = new  # type: ignore[misc]
            a = text.index(first)
            b = text.index(second, a)
            c = text.index(end, b)
            text = text[:a] + text[b:c] + text[a:b] + text[c:]
        else:
            assert old in text, old
            text = text.replace(old, str(new))
    return text, values


@pytest.mark.parametrize(("task", "name", "changes", "code"), WRONG)
def test_a_wrong_tree_is_refused_for_its_reason(task: str, name: str, changes: dict[str, object], code: str) -> None:
    request = requests(task, WORLD)[0]
    text, values = changed(reference(request), request, changes)

    verdict = judged(request, text, values)

    assert code in verdict.codes, str(verdict)


def test_a_task_with_errors_is_refused() -> None:
    request = requests("T6", WORLD)[0]

    verdict = judged(request, reference(request).replace("drone.GoTo", "drone.FlyAround"))

    assert verdict.codes == ("refused",)
