"""Every type of a catalogue can be rehearsed: what its actions do, how long they last, what they give."""

from collections.abc import Callable
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest

import agents_sim.bodies
from agents_sim.body import Body, Setup
from agents_sim.machine import Machine
from formiga_bt.base.errors import FormigaError
from formiga_bt.base.geo import horizontal_m
from formiga_bt.lang.compose import Composed, compose
from formiga_bt.rehearsal.bodies import kind_of
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import task_of

CATALOGUE = """types:
  crane: {extends: hwd, actions: [Winch, Hop]}
  rover: {mobility: ground, actions: [Drive, Pick], limits: {speed: 2 m/s, drive_drain_pct_s: 0.1, charge_pct_s: 1}}
  door: {mobility: fixed, actions: [Open]}
  weather: {mobility: none, shared: true, actions: [Forecast]}
  loader: {extends: person, actions: [Load, Walk]}
actions:
  Winch: {fields: {down: distance}, result: {held: mass, state: {type: enum, values: [slack, tight]}}, typical: 20 s}
  Hop: {fields: {to: position}, moves_to: to, requires: airborne}
  Drive: {fields: {to: place, speed: {type: speed, optional: true}}, moves_to: to}
  Pick: {result: {count: {type: int, min: 2}}, typical: 10 s}
  Open: {typical: 4 s, result: {open: bool}}
  Forecast: {typical: 2 s, result: {wind: speed, where: region, near: place, names: {list: text}}}
  Load: {typical: 30 s, result: {done: bool}}
  Walk: {fields: {to: place}, moves_to: to}
"""
SITE = """formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7}
ports: {p1: {at: {east: 0 m, north: 20 m}}}
places: {pit: {east: 60 m, north: 60 m}, shed: {east: -40 m, north: 0 m}}
agents:
  crane_1: {type: crane, home: p1}
  rover_1: {type: rover}
  door_1: {type: door, at: {east: -40 m, north: 10 m}}
  weather_1: {type: weather}
  loader_1: {type: loader}
actions: [mine.yaml]
"""
HOP = 'crane.Hop: {to: "${above(site.places.pit, 60 m)}"}|crane.Hop: {to: "${above(crane.home, 20 m)}"}'
Play = Callable[..., Rehearsal]


@pytest.fixture
def world(tmp_path: Path) -> Composed:
    (tmp_path / "mine.yaml").write_text(CATALOGUE)
    (tmp_path / "site.yaml").write_text(SITE)
    found = compose(tmp_path / "site.yaml")
    assert found.diagnostics == ()
    return found


@pytest.fixture
def play(world: Composed) -> Play:
    def run(text: str) -> Rehearsal:
        assert world.site is not None
        task = task_of(text, world.site, world.catalogue)
        rehearsal = Rehearsal(world.site, world.catalogue, [task], fleet_of(world.site, world.catalogue))
        rehearsal.run_for(1.0)
        rehearsal.task_id = rehearsal.submit("Try")  # type: ignore[attr-defined]
        rehearsal.run_until_ended()
        return rehearsal

    return run


def test_all_agents_of_the_site_are_there_apart_from_each_other(world: Composed) -> None:
    assert world.site is not None
    specs = {spec.id: spec for spec in fleet_of(world.site, world.catalogue)}
    places = [spec.at for spec in specs.values()]

    assert set(specs) == set(world.site.agents)
    assert specs["crane_1"].home == world.site.ports["p1"].at
    assert all(horizontal_m(a, b) > 3.0 for i, a in enumerate(places) for b in places[:i])


@pytest.mark.parametrize(
    ("who", "steps", "least_s", "most_s"),
    [
        ("crane", f'crane.TakeOff|crane.Winch: {{down: 5 m}}|{HOP}|crane.LandIn: {{at: "${{crane.home}}"}}', 60, 180),
        ("rover", "rover.Drive: {to: pit}|rover.Pick", 45, 70),
        ("rover", "rover.Drive: {to: pit, speed: 1 m/s}", 75, 110),
        ("door", "door.Open", 3.6, 5.5),
        ("weather", "weather.Forecast", 1.8, 3.3),
        ("loader", "loader.Load|loader.Walk: {to: shed}", 60, 160),
    ],
)
def test_an_action_does_what_the_catalogue_says(
    play: Play, who: str, steps: str, least_s: float, most_s: float
) -> None:
    lines = [f"  - do: {one.split(':')[0]}" + _with(one) for one in steps.split("|")]
    rehearsal = play(f"agents: {{{who}: {{type: {who}}}}}\nsteps:\n" + "\n".join(lines) + "\n")
    (task,) = [one for one in rehearsal.engine.state.tasks.values() if one.name == "Try"]

    assert (task.status, task.outcome.code) == ("SUCCEEDED", ""), task.outcome
    assert task.times.ended_at is not None
    assert least_s <= (task.times.ended_at - task.times.submitted_at) / 1e6 <= most_s
    assert rehearsal.referee.verdict(rehearsal.now).is_clean


def _with(step: str) -> str:
    _, colon, fields = step.partition(": ")
    return f"\n    with: {fields}" if colon else ""


def test_a_result_is_of_its_types_by_default_and_the_task_can_read_it(play: Play) -> None:
    rehearsal = play(
        "agents: {rover: {type: rover}, crane: {type: crane}, weather: {type: weather}}\nsteps:\n"
        "  - do: rover.Pick\n    save_as: got\n"
        "  - do: crane.Winch\n    with: {down: 1 m}\n    save_as: winch\n"
        "  - do: weather.Forecast\n    save_as: sky\n"
        "  - check: got.count == 2 and winch.state == 'slack' and winch.held == 0 kg and sky.wind == 0 m/s\n"
    )

    assert [one.status for one in rehearsal.engine.state.tasks.values()] == ["SUCCEEDED"]


def test_a_rover_stands_where_it_drove_and_has_spent_what_its_type_drains(play: Play, world: Composed) -> None:
    rehearsal = play("agents: {rover: {type: rover}}\nsteps:\n  - do: rover.Drive\n    with: {to: pit}\n")
    body = rehearsal.sim["rover_1"].body
    assert isinstance(body, Machine)
    assert world.site is not None

    assert horizontal_m(body.position(), world.site.places["pit"]) < 0.01
    assert not body.is_airborne
    assert body.battery() == pytest.approx(
        100.0 - 0.1 * horizontal_m(_begin(world), world.site.places["pit"]) / 2.0, 0.01
    )


def _begin(world: Composed) -> Any:
    assert world.site is not None
    return next(spec.at for spec in fleet_of(world.site, world.catalogue) if spec.id == "rover_1")


def test_the_catalogues_numbers_are_a_bodys_limits(world: Composed) -> None:
    assert world.site is not None
    rehearsal = Rehearsal(world.site, world.catalogue, [], fleet_of(world.site, world.catalogue))
    rehearsal.run_for(1.0)
    agents = rehearsal.engine.state.agents
    types = world.catalogue.types

    for agent, of in (("crane_1", "crane"), ("rover_1", "rover")):
        said = agents[agent].limits
        assert {name: said[name] for name in said if name in types[of].limits} == {
            name: types[of].limits[name] for name in said if name in types[of].limits
        }
    assert set(agents["crane_1"].actions) == set(types["crane"].actions) - {"CutMotors"}


# Bodies of one's own.


class Slow(Machine):
    """A rover that is slow."""

    def on_card(self) -> dict[str, Any]:
        return {**super().on_card(), "limits": {"speed_m_s": 0.5}}


class Broken(Body):
    """Its constructor fails."""

    def __init__(self, setup: Setup) -> None:
        raise RuntimeError("no arms")


def registered(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    found = EntryPoints([EntryPoint(name, value, agents_sim.bodies.GROUP)])
    monkeypatch.setattr(agents_sim.bodies, "entry_points", lambda **given: found.select(**given))


@pytest.mark.parametrize("name", ["rover", "hwd"])
def test_a_registered_body_serves_its_type_and_those_that_extend_it(
    world: Composed, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    registered(monkeypatch, name, f"{__name__}:Slow")
    assert world.site is not None
    rehearsal = Rehearsal(world.site, world.catalogue, [], fleet_of(world.site, world.catalogue))
    slow = [one.spec.id for one in rehearsal.sim.agents.values() if isinstance(one.body, Slow)]

    assert slow == [{"rover": "rover_1", "hwd": "crane_1"}[name]]
    assert kind_of(world.catalogue, "door").body == ""


@pytest.mark.parametrize(
    ("value", "word"),
    [
        ("no_such_module:Body", "no_such_module"),
        (f"{__name__}:nothing", "nothing"),
        (f"{__name__}:registered", "Body"),
        (f"{__name__}:Broken", "no arms"),
    ],
)
def test_a_broken_body_is_an_error_that_names_it_and_the_agent(
    world: Composed, monkeypatch: pytest.MonkeyPatch, value: str, word: str
) -> None:
    registered(monkeypatch, "rover", value)
    assert world.site is not None
    with pytest.raises(FormigaError) as error:
        Rehearsal(world.site, world.catalogue, [], fleet_of(world.site, world.catalogue))

    assert word in str(error.value)
    assert "rover_1" in str(error.value)
    assert error.value.help
