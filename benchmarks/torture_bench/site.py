"""The folder of a small site: two light drones, a heavy one, a picker and a watcher; tasks that are short and end at home."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from formiga_bt.base.packaged import folder as packaged

SITE: Final = """\
formiga_site: 1
name: {name}
base: {{lat: 66.5, lng: 25.7, ground_msl: 120 m}}
ports:
  p1: {{at: {{east: -60 m, north: 40 m}}, waiting: {{east: -60 m, north: 80 m, height: 45 m}}}}
  p2: {{at: {{east: 0 m, north: 40 m}}, waiting: {{east: 0 m, north: 80 m, height: 45 m}}}}
  p3: {{at: {{east: 60 m, north: 40 m}}, waiting: {{east: 60 m, north: 80 m, height: 45 m}}}}
  p4: {{at: {{east: 120 m, north: 40 m}}, waiting: {{east: 120 m, north: 80 m, height: 45 m}}}}
places:
  camp: {{east: 30 m, north: -60 m}}
  meadow: {{east: -60 m, north: 140 m}}
  pond: {{east: 60 m, north: 150 m}}
  ditch: {{east: -10 m, north: 170 m}}
fence:
  - {{east: -600 m, north: -600 m}}
  - {{east: 600 m, north: -600 m}}
  - {{east: 600 m, north: 600 m}}
  - {{east: -600 m, north: 600 m}}
terrain: {{flat: true, relief: 5 m}}
layers: [60 m, 75 m, 90 m]
separation: 15 m
resume_hold_after: {hold_after}
people: {{watchers: [watcher_1]}}
agents:
  lwd_1: {{type: lwd, home: p1}}
  lwd_2: {{type: lwd, home: p2}}
  hwd_1: {{type: hwd, home: p3}}
  picker_1: {{type: picker}}
  watcher_1: {{type: watcher}}
transports: {{zenoh: {{listen: "tcp/127.0.0.1:0", insecure: true}}}}
mode: simulation
actions: []
"""
HOMES: Final[Mapping[str, str]] = {"lwd_1": "p1", "lwd_2": "p2", "hwd_1": "p3"}
PORTS: Final[Mapping[str, tuple[float, float]]] = {"p1": (-60, 40), "p2": (0, 40), "p3": (60, 40), "p4": (120, 40)}
"""East and north of each port, metres."""
PLACES: Final[Mapping[str, tuple[float, float]]] = {
    "camp": (30, -60), "meadow": (-60, 140), "pond": (60, 150), "ditch": (-10, 170),
}  # fmt: skip
MACHINES: Final = tuple(HOMES)
PEOPLE: Final = ("picker_1", "watcher_1")

_HOME: Final = """\
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
TREES: Final[Mapping[str, str]] = {
    "look.yaml": """\
formiga: 1
task: Look
description: Fly over a place and come home.
imports: [lib/flying.yaml]
params:
  target: {type: place, default: meadow}
agents:
  drone: {any_of: [lwd, hwd], near: "${target}", wait: 12 h}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${at_height(target, drone.transit_height)}"}
  - wait: 2 s
"""
    + _HOME,
    "stay.yaml": """\
formiga: 1
task: Stay
description: Fly to a place, stay there, do something on the way home in any case.
imports: [lib/flying.yaml]
params:
  target: {type: place, default: pond}
agents:
  drone: {any_of: [lwd, hwd], near: "${target}", wait: 12 h}
steps:
  - sequence:
      - do: drone.TakeOff
      - do: drone.GoTo
        with: {to: "${at_height(target, drone.transit_height)}"}
      - wait: 100 s
    finally:
      - do: drone.GoTo
        with: {to: "${at_height(offset(drone.home, north=60 m), drone.transit_height)}"}
"""
    + _HOME
    + """\
on_abort:
  - do: drone.GoTo
    with: {to: "${at_height(offset(drone.home, north=40 m), drone.transit_height)}"}
finally:
  - notify: The stay is over.
""",
    "away.yaml": """\
formiga: 1
task: Away
description: Land away from the ports, be loaded, start there again.
imports: [lib/flying.yaml]
params:
  target: {type: place, default: ditch}
agents:
  drone: {any_of: [lwd, hwd], near: "${target}", wait: 12 h}
  picker: {type: picker, wait: 12 h}
steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with: {to: "${at_height(target, drone.transit_height)}"}
  - do: drone.LandIn
    with: {at: "${target}"}
  - ask: Is it loaded?
    of: [picker]
    options: [loaded, not_yet]
    clears: {role: drone, on: [loaded]}
    timeout: 2 h
    expect: result.answer == 'loaded'
  - do: drone.TakeOff
"""
    + _HOME,
    "asked.yaml": """\
formiga: 1
task: Asked
description: A person is asked on the ground and in the air.
imports: [lib/flying.yaml]
agents:
  drone: {any_of: [lwd, hwd], wait: 12 h}
  watcher: {type: watcher, wait: 12 h}
steps:
  - ask: May it fly?
    of: [watcher]
    options: [yes, no]
    timeout: 2 h
    expect: result.answer == 'yes'
  - do: drone.TakeOff
  - ask: Shall it come down?
    of: [watcher]
    options: [come_down, go_on]
    timeout: 2 h
    expect: result.answer == 'come_down'
"""
    + _HOME,
    "spin.yaml": """\
formiga: 1
task: Spin
description: Two hundred loops that wake all the time, on the ground.
params:
  times: {type: int, default: 1000000}
steps:
  - parallel:
"""
    + "".join(
        f"      - repeat: ${{times}}\n        name: loop{n}\n        steps:\n          - wait: 1 ms\n"
        for n in range(200)
    ),
}
"""Task files. `spin.yaml` is written only for who asks for it."""
SCRIPTS: Final[Mapping[str, Sequence[Mapping[str, Any]]]] = {
    "picker_1": [{"match": "*", "options": ["loaded"], "after": "15 s"}, {"match": "*", "options": ["clear"], "after": "4 s"}],
    "watcher_1": [
        {"match": "come_down", "options": ["come_down"], "after": "15 s"},
        {"match": "*", "options": ["yes"], "after": "8 s"},
        {"match": "*", "options": ["clear"], "after": "4 s"},
    ],
}  # fmt: skip
"""How people answer."""
WORK: Final[Sequence[tuple[str, Mapping[str, Any]]]] = (
    ("Look", {"target": "meadow"}), ("Away", {}), ("Stay", {}), ("Look", {"target": "camp"}), ("Asked", {}),
    ("PickUp", {"target": "pond", "user": "picker_1"}), ("Stay", {"target": "meadow"}), ("MoveTask", {}),
)  # fmt: skip
"""What is requested."""
LOST: Final = "suspect_after: 3 s\n    lost_after: 30 s"
HASTY: Final = "suspect_after: 1500 ms\n    lost_after: 4 s"


def make(
    folder: Path, *, name: str = "torture", hold_after: str = "30 s", hasty: bool = False, spin: bool = False
) -> None:
    """Make the folder of a site.

    Args:
        folder: becomes it; a new one.
        name: the site's.
        hold_after: an outage that is longer holds every task.
        hasty: machines count as lost after 4 s instead of 30 s.
        spin: with the task that wakes all the time.
    """
    trees = folder / "trees"
    trees.mkdir(parents=True)
    for file, text in TREES.items():
        if spin or file != "spin.yaml":
            (trees / file).write_text(text, encoding="utf-8")
    (folder / "site.yaml").write_text(SITE.format(name=name, hold_after=hold_after), encoding="utf-8")
    actions = (packaged("actions") / "base.yaml").read_text(encoding="utf-8")
    assert LOST in actions
    (folder / "actions.yaml").write_text(actions.replace(LOST, HASTY) if hasty else actions, encoding="utf-8")
