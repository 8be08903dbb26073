"""What each mission is put through to see whether a fault made it worse: the same eleven days for every mission.

All is fixed: the site, the parameters, who answers what and when, what fails. Written as a test file, so that the same player
runs it; nothing is expected, the traces of the original and of the mutated task are compared.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

DRONES: Final = ("lwd_1", "lwd_2", "lwd_3", "hwd_1", "hwd_2")


@dataclass(frozen=True, slots=True)
class Mission:
    """A task file of `trees/`, the parameters of its scenarios, and the answer that means no ("" = it asks nothing)."""

    file: str
    params: Mapping[str, Any]
    no: str = ""
    agents: Mapping[str, Any] = field(default_factory=dict)
    """What differs from the site in all scenarios."""


MISSIONS: Final = (
    Mission("circle.yaml", {"center": "north_field", "points": 4}),
    Mission("delivery.yaml", {"target": "north_field", "next_stop": "east_field", "return_second": True}, "no"),
    Mission("explore_region.yaml", {"region": "lake"}),
    Mission("move_task.yaml", {"robot": "lwd_1"}, agents={"lwd_1": {"at": "south_field"}}),
    Mission("patrol_and_escort.yaml", {"target": "north_field", "points": 4}),
    Mission("pick_up.yaml", {"target": "north_field", "user": "picker_1"}, "not_yet"),
    Mission("triangle.yaml", {"corner": "north_field"}),
    Mission("watch_dog_request.yaml", {"alarmtype": "lost", "target": "east_field", "username": "picker_2"}, "no"),
    Mission("watch_dog_sos.yaml", {"alarmtype": "sos", "target": "lake_shore"}, "no"),
    Mission("zig_zag.yaml", {"start": "north_field", "end": "west_field", "legs": 4}),
)
HOSTS: Final = (Mission("there_and_back.yaml", {"target": "north_field"}),)
"""Beside this file: they call what no mission calls."""

COOKBOOK: Final = (
    Mission("cookbook/charge_and_resume.yaml", {"region": "bog"}),
    Mission("cookbook/converge.yaml", {"region": "bog"}),
    Mission("cookbook/convoy.yaml", {"start": "west_field", "end": "north_field"}),
    Mission("cookbook/handover.yaml", {"target": "east_field"}),
    Mission("cookbook/look_with_another.yaml", {"target": "north_field"}),
    Mission("cookbook/ring_patrol.yaml", {"center": "north_field", "end": "1970-01-13T00:00+00:00"}),
    Mission("cookbook/share_finds.yaml", {"region": "bog"}),
    Mission("cookbook/watch_person.yaml", {"user": "picker_1"}, "no"),
)
"""Trees that no check was tuned on, with the parameters of their own test files."""

LIBRARY_HOSTS: Final = {
    "ReturnHome": ("circle.yaml", "move_task.yaml", "pick_up.yaml"),
    "FlyOver": ("delivery.yaml", "triangle.yaml"),
    "FlyTo": ("circle.yaml", "zig_zag.yaml"),
    "FetchHome": ("delivery.yaml",),
    "FlyAndLand": ("there_and_back.yaml",),
    "LandNear": ("there_and_back.yaml",),
}
"""The missions that a fault of a library's subtree is tried in."""


def test_file(mission: Mission) -> str:
    """Return the scenarios of a mission as the text of a test file."""
    each = {"params": dict(mission.params), "expect": {}}

    def goals(action: str, nth: int | None = None, **what: Any) -> list[dict[str, Any]]:
        number = {} if nth is None else {"nth": nth}
        return [{"do": f"{drone}.{action}", **number, **what} for drone in DRONES]

    def charged(percent: int) -> dict[str, Any]:
        return {drone: {**mission.agents.get(drone, {}), "battery": f"{percent} %"} for drone in DRONES}

    questions = range(1, 5) if mission.no else ()
    no = [{"ask": number, "answer": mission.no} for number in questions]
    cases: dict[str, dict[str, Any]] = {
        "ok": {},
        "weak": {"agents": charged(46)},
        "flat": {"agents": charged(24)},
        "no": {"answers": [*no, {"ask": "about to land", "answer": "clear", "after": "20 s"}]},
        "silence": {"answers": [{"ask": number, "never": True} for number in questions]},
        "not clear": {"answers": [{"ask": "about to land", "never": True}, {"ask": "start here", "never": True}]},
        "late": {"answers": goals("GoTo", 2, after="40 min")},
        "lost": {"faults": [{"at": "45 s", "agent": drone, "kind": "kill"} for drone in DRONES]},
        "refused": {"answers": goals("TakeOff", 1, reject="not_now")},
        "blocked": {"answers": goals("GoTo", 2, fail="blocked", after="5 s")},
        "abort": {"abort_at": "50 s"},
    }
    told = [{"name": name, "agents": dict(mission.agents), **each, **case} for name, case in cases.items()]
    return json.dumps({"formiga_test": 1, "task": mission.file, "cases": told}, indent=1)
