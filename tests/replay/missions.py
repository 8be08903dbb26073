"""Missions that are recorded, and replayed from every snapshot. Run as a program it does so in a process of its own."""

import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from formiga_bt.base.geo import Place, Position, Region
from formiga_bt.base.packaged import folder
from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel import inputs as inp
from formiga_bt.lang.loader import load_catalogue, load_site, load_task, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from tests.reloading import loaded, written
from tests.shares import some

AHEAD = some(12, 25)
"""So many steps are played again from most of the snapshots."""
EACH = some(10, 4)
"""Each so many-th goes on to the end."""
SHIPPED = ("move_task", "pick_up", "explore_region", "watch_dog_sos", "watch_dog_request")

DETOUR = """\
formiga: 1
task: Detour
imports: [lib/flying.yaml]
params: {to: place}
agents:
  drone: {type: hwd}
  watcher: {type: watcher}
steps:
  - do: drone.TakeOff
  - fallback:
      - call: FlyTo                                   # stopped in flight: the rest of it drains
        with: {drone: "${drone}", to: "${to}", height: 40 m}
        timeout: 35 s
        retry: {attempts: 2, attempt_timeout: 15 s}
      - sequence:
          - notify: Not there because of ${error.code}
          - switch: error.code
            cases:
              timeout: [{wait: 2 s}]
            default: [{wait: 1 s}]
          - ask: Try once more?
            of: [watcher]
            options: [go_home, wait]
            timeout: 1 min
            retry: {attempts: 2, delay: 7 s}
            expect: result.answer == 'wait'
            save_as: said
            ignore_failure: true
          - notify: They said ${said.answer}
            when: is_set(said)
  - call: ReturnHome
    with: {drone: "${drone}"}
on_abort:
  - notify: Stopped because of ${abort.reason}
  - wait: 3 s
finally:
  - wait: 2 s
  - notify: Done
"""


SURVEY = """\
formiga: 1
task: Survey
imports: [lib/flying.yaml]
params: {to: place}
vars: {rounds: "${0}", over: "${false}"}
agents:
  drones: {type: lwd, count: 2}
  picker: {type: picker}
steps:
  - parallel:
      - for: {place: "${[to, base, to]}"}
        mode: parallel
        max_parallel: 2
        need: 1
        collect: fixes
        steps:
          - do: picker.MiniFinder                     # the second is busy and tries again
            with: {base: "${place}"}
            save_as: fixes
            retry: {attempts: 3, delay: 2 s}
      - repeat: 1 min
        every: 4 s
        steps:
          - set: {rounds: "${rounds + 1}"}
          - break_if: rounds == 3
      - sequence:
          - wait_until: rounds > 2
            timeout: 1 min
          - notify: Three rounds
        finally:
          - wait: 1 s
  - for: {fix: "${fixes}"}
    collect: seen
    steps:
      - while: rounds < 5
        every: 2 s
        steps:
          - set: {rounds: "${rounds + 1}"}
      - do: picker.MiniFinder
        with: {base: "${fix.go_to}"}
        save_as: seen
  - notify: "There are ${seen[0].go_to}"
    when: len(seen) > 0
  - parallel:
      - sequence:
          - wait: 20 s
          - set: {over: "${true}"}
      - for: {drone: "${drones}", height: "${[30 m, 40 m]}"}
        mode: parallel
        steps:
          - fallback:
              - guard: not over                       # turns false in flight: the leg drains
                steps:
                  - sequence:
                      - call: FlyTo
                        with: {drone: "${drone}", to: "${to}", height: "${height}"}
                    finally:                          # of a stopped sequence
                      - wait: 3 s
                      - notify: ${drone.id} looked from ${height}
              - notify: Stopped because of ${error.code}
          - release: drone                            # in the air: brought home first
  - fallback:
      - check: picker.battery < 1 %
      - wait: 5 s
    reactive: true
"""


RELIEF = """\
formiga: 1
task: Relief
imports: [lib/flying.yaml]
params: {to: place}
agents:
  drone: {type: hwd}
steps:
  - with_agents:
      looker: {type: lwd, near: "${to}"}
    retry: {attempts: 2, agent: another}              # the first is stopped in flight and comes home, another one goes
    steps:
      - call: FlyTo
        with: {drone: "${looker}", to: "${to}", height: 40 m}
        timeout: 20 s
      - call: ReturnHome
        with: {drone: "${looker}"}
on_failure:
  - notify: nobody looked
"""


ERRAND = """\
formiga: 1
task: Errand
params: {robot: {type: agent, of: [lwd]}}
steps:
  - fallback:
      - request: MoveTask
        with: {robot: "${robot}"}
        timeout: 32 s                                 # it is in the air then: its way home drains
      - request: MoveTask
        with: {robot: "${robot}"}
        priority: high
        save_as: moved
  - request: MoveTask
    wait: false
  - wait: 12 s
  - notify: ${moved.task_id} ${moved.status}
    when: is_set(moved)
"""


class Recorded(msgspec.Struct):
    """One step as recorded: what went in, and the bytes of what came out."""

    at: int
    given: Any
    out: bytes


@cache
def world() -> tuple[Site, Catalogue, dict[str, Task]]:
    """Return the demo site, the catalogue and the tasks."""
    catalogue, found, _ = load_catalogue(sorted(folder("actions").glob("*.yaml")))
    assert not found, found
    site, found, _ = load_site(folder("trees") / "demo-site.yaml")
    assert site is not None, found
    loaded = [load_task(folder("trees") / f"{name}.yaml", catalogue=catalogue, site=site) for name in SHIPPED]
    loaded.append(load_task_text(DETOUR, "detour.yaml", catalogue=catalogue, site=site))
    loaded.append(load_task_text(SURVEY, "survey.yaml", catalogue=catalogue, site=site))
    loaded.append(load_task_text(RELIEF, "relief.yaml", catalogue=catalogue, site=site))
    loaded.append(load_task_text(ERRAND, "errand.yaml", catalogue=catalogue, site=site))
    tasks = [one.task for one in loaded]
    assert all(tasks), [str(d) for one in loaded for d in one.diagnostics]
    return site, catalogue, {task.name: task for task in tasks if task is not None}


def rehearsal(answers: Sequence[str] = ("not_yet", "loaded")) -> Rehearsal:
    site, catalogue, tasks = world()
    rule = [{"match": "loaded", "options": list(answers), "after": "4 s"}]
    watcher = [{"match": "Try once", "options": ["go_home", "wait"], "after": "5 s"}]
    fleet = fleet_of(site, catalogue, scripts={"picker_1": rule, "watcher_1": watcher})
    flight = Rehearsal(site, catalogue, tasks.values(), fleet)
    flight.run_for(1)
    return flight


def submit_pick_up(flight: Rehearsal) -> str:
    site = world()[0]
    return flight.submit("PickUp", {"target": site.places["north_field"], "user": AgentRef("picker_1")})


def move_task(flight: Rehearsal) -> None:
    flight.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert flight.run_until_ended()


def pick_up(flight: Rehearsal) -> None:
    submit_pick_up(flight)
    assert flight.run_until_ended()


def pick_up_beside_move_task(flight: Rehearsal) -> None:
    submit_pick_up(flight)
    flight.submit("MoveTask", {"robot": AgentRef("lwd_1")})
    assert flight.run_until_ended()


def pick_up_aborted(flight: Rehearsal) -> None:
    task = submit_pick_up(flight)
    flight.run_for(25)
    flight.abort(task, by="watcher_1")
    assert flight.run_until_ended()


def detour(flight: Rehearsal) -> None:
    flight.submit("Detour", {"to": world()[0].places["west_field"]})
    assert flight.run_until_ended()


def detour_aborted(flight: Rehearsal) -> None:
    task = flight.submit("Detour", {"to": world()[0].places["west_field"]})
    flight.run_for(30)
    flight.abort(task, by="watcher_1")
    assert flight.run_until_ended()


def detour_taken_over(flight: Rehearsal) -> None:
    flight.submit("Detour", {"to": world()[0].places["west_field"]})
    flight.run_for(20)
    (drone,) = [a.id for a in flight.engine.state.agents.values() if a.type == "hwd" and a.task]
    flight.sim.take_over(drone)
    flight.run_for(10)
    flight.sim.hand_back(drone)
    flight.run_for(1)
    flight.ask(inp.Operator("handback_end", drone, "watcher_1"))
    assert flight.run_until_ended()


def survey(flight: Rehearsal) -> None:
    flight.submit("Survey", {"to": world()[0].places["west_field"]})
    assert flight.run_until_ended()


def survey_aborted(flight: Rehearsal) -> None:
    task = flight.submit("Survey", {"to": world()[0].places["west_field"]})
    flight.run_for(45)
    flight.abort(task, by="watcher_1")
    assert flight.run_until_ended()


def relief(flight: Rehearsal) -> None:
    flight.submit("Relief", {"to": world()[0].places["west_field"]})
    assert flight.run_until_ended()


def relief_aborted(flight: Rehearsal) -> None:
    task = flight.submit("Relief", {"to": world()[0].places["west_field"]})
    flight.run_for(12)
    flight.abort(task, by="watcher_1")
    assert flight.run_until_ended()


def errand(flight: Rehearsal) -> None:
    """One child is stopped in flight, the next one is waited for, the last one ends with its parent."""
    mine = flight.submit("Errand", {"robot": AgentRef("lwd_1")})
    assert flight.run_until_ended()
    assert flight.task(mine).status == "SUCCEEDED"
    assert [flight.task(one).status for one in flight.task(mine).family.children] == [
        "CANCELED",
        "SUCCEEDED",
        "CANCELED",
    ]


def errand_held_and_aborted(flight: Rehearsal) -> None:
    mine = flight.submit("Errand", {"robot": AgentRef("lwd_1")})
    flight.run_for(28)
    flight.ask(inp.Operator("hold", mine, "watcher_1"))
    flight.run_for(20)
    flight.ask(inp.Operator("continue", mine, "watcher_1"))
    flight.run_for(3)
    flight.abort(mine, by="watcher_1")
    assert flight.run_until_ended()


def explore_region(flight: Rehearsal) -> None:
    flight.submit("ExploreRegion", {"region": world()[0].regions["bog"]})
    assert flight.run_until_ended()


def watch_dogs(flight: Rehearsal) -> None:
    """T4 and T5 at once: the loop of fixes in T5, the watcher's queue in both."""
    places = world()[0].places
    flight.submit("WatchDogSOS", {"alarmtype": "sos", "target": places["camp"]})
    lost = {"alarmtype": "lost", "target": places["east_field"], "username": AgentRef("picker_2")}
    flight.submit("WatchDogRequest", lost)
    assert flight.run_until_ended()


MISSIONS: dict[str, Callable[[Rehearsal], None]] = {
    mission.__name__: mission
    for mission in (
        move_task, pick_up, pick_up_beside_move_task, pick_up_aborted, detour, detour_aborted, detour_taken_over,
        survey, survey_aborted, relief, relief_aborted, errand, errand_held_and_aborted, explore_region, watch_dogs,
    )
}  # fmt: skip

ENCODER = msgspec.json.Encoder()


def out(step: inp.EngineStep) -> bytes:
    """Return the bytes of a step without its input."""
    return ENCODER.encode((step.seq, step.at, step.changes, step.effects, step.reply))


def record(name: str) -> tuple[list[Recorded], list[bytes]]:
    """Fly a mission; return its steps, and the snapshot after each."""
    flight = rehearsal()
    before = len(flight.steps)
    shots = [written(flight.engine.state)]
    flight.driver.listeners.append(lambda _: shots.append(written(flight.engine.state)))
    MISSIONS[name](flight)
    flight.close()
    return [Recorded(s.at, s.input, out(s)) for s in flight.steps[before:]], shots


def replay(steps: Sequence[Recorded], shots: Sequence[bytes]) -> list[str]:
    """Go on from each snapshot with what was put in; return where what comes out differs from what came out.

    Each `EACH`-th one goes on to the end, the others for `AHEAD` steps; with FORMIGA_EXAMPLES set, all go on to the end.
    """
    site, catalogue, tasks = world()
    every = 1 if os.environ.get("FORMIGA_EXAMPLES") else EACH
    wrong = []
    for index, shot in enumerate(shots):
        engine = Engine(site, catalogue, tasks, state=loaded(shot))
        if written(engine.state) != shot:
            wrong.append(f"the state after step {index} is another when it is loaded")
        until = len(steps) if index % every == 0 else index + AHEAD
        for offset, one in enumerate(steps[index:until]):
            try:
                now = out(engine.handle(one.at, one.given))
            except Exception as error:  # noqa: BLE001 - told as a difference
                now = f"{type(error).__name__}: {error}".encode()
            if now != one.out:
                wrong.append(f"loaded after step {index}, step {index + offset + 1}: {one.given}\n{one.out!r}\n{now!r}")
                break
    return wrong


class Film(msgspec.Struct):
    """A mission in a file: inputs are pickled by msgspec as their union."""

    at: list[int]
    given: list[inp.Input]
    out: list[bytes]
    shots: list[bytes]


def save(steps: Sequence[Recorded], shots: list[bytes]) -> bytes:
    film = Film([s.at for s in steps], [s.given for s in steps], [s.out for s in steps], shots)
    return msgspec.msgpack.encode(film)


TAGGED: dict[str, type[msgspec.Struct]] = {"place": Place, "position": Position, "region": Region, "agent": AgentRef}


def _revived(value: Any) -> Any:
    """Return a value of a field of type Any from its plain form: its tag says what it was."""
    if isinstance(value, dict) and value.get("is", "") in TAGGED:
        return msgspec.convert(value, TAGGED[value["is"]])
    if isinstance(value, dict):
        return {key: _revived(item) for key, item in value.items()}
    return tuple(map(_revived, value)) if isinstance(value, list) else value


def load(data: bytes) -> tuple[list[Recorded], list[bytes]]:
    film = msgspec.msgpack.decode(data, type=Film)
    given = [
        msgspec.structs.replace(g, params=_revived(g.params)) if isinstance(g, inp.Submit) else g for g in film.given
    ]
    return [Recorded(*three) for three in zip(film.at, given, film.out, strict=True)], film.shots


def main() -> int:
    """Replay films, or (`--fly`) print the bytes of all missions' steps."""
    if sys.argv[1] == "--fly":
        for name in MISSIONS:
            flight = rehearsal()
            MISSIONS[name](flight)
            flight.close()
            for step in flight.steps:
                sys.stdout.buffer.write(ENCODER.encode(step) + b"\n")
        return 0
    wrong = [f"{file}: {line}" for file in sys.argv[1:] for line in replay(*load(Path(file).read_bytes()))]
    print("\n".join(wrong[:5]))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
