"""Scenario files are checked like tasks: every problem located, named, and with the nearest right word."""

from pathlib import Path

import pytest

from formiga_bt.base.clock import SECOND
from formiga_bt.base.diagnostics import Diagnostic
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.packaged import files, folder
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.scenario import FAULTS, Scenario, load_scenario, load_scenario_text
from formiga_bt.lang.types import AgentRef
from formiga_bt.rehearsal.simulation import VirtualRun

SHIPPED = sorted((folder("trees") / "scenarios").glob("*.yaml"))
HEAD = "scenario: try\nsite: demo-site.yaml\n"
FLEET = """agents:
  - {id: hwd_1, type: hwd, at: p5}
  - {id: picker_1, at: camp}
"""


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    catalogue, problems, _ = load_catalogue(files("actions"))
    assert not problems
    return catalogue


def read(text: str, catalogue: Catalogue) -> Scenario:
    loaded = load_scenario_text(text, "x.yaml", catalogue=catalogue)
    assert loaded.scenario is not None, loaded.diagnostics
    return loaded.scenario


def short(problem: Diagnostic) -> tuple[int, str, str]:
    return problem.mark.line, problem.code, problem.message


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenarios_are_right_and_named_as_their_file(path: Path, catalogue: Catalogue) -> None:
    loaded = load_scenario(path, catalogue=catalogue)
    assert loaded.diagnostics == []
    assert loaded.scenario is not None
    assert loaded.scenario.name == path.stem


def test_a_scenario_has_agents_tasks_and_faults_in_order_of_time(catalogue: Catalogue) -> None:
    scenario = read(
        HEAD
        + """speed: 10
seed: 3
agents:
  - {id: hwd_1, type: hwd, at: {east: 5 m, north: 6 m, height: 40 m}, battery: 90 %}
  - {id: hwd_2, type: hwd}
  - {id: hwd_9, type: hwd, at: p8}
  - id: picker_1
    at: 66.5,25.7
    person: {answers: [{match: loaded, options: [not_yet, loaded], after: 4 s}, {never: true}], walk: [camp, p1]}
tasks:
  - {at: 2 min, task: PickUp, params: {target: "66.5,25.7", user: picker_1}, priority: high}
  - {task: MoveTask}
faults:
  - {at: 40 s, agent: hwd_2, kind: freeze, for: 10 s}
  - {at: 45 s, agent: hwd_2, kind: wrong_id, as: hwd_1, count: 3}
""",
        catalogue,
    )
    flying, home, unlisted, picker = scenario.agents
    assert (scenario.speed, scenario.seed) == (10.0, 3)
    assert (flying.at, flying.battery, flying.home) == (Position(5.0, 6.0, 40.0), 90.0, Place(15.0, 40.0))
    assert home.at == Place(45.0, 40.0) == home.home
    assert unlisted.home == Place(105.0, 40.0)
    assert (picker.type, picker.human, picker.walk) == ("picker", True, (Place(30.0, -40.0), Place(-105.0, 40.0)))
    assert picker.answers[0] == {"match": "loaded", "options": ["not_yet", "loaded"], "after": 4.0, "never": False}
    assert [(task.at, task.task, task.priority) for task in scenario.requests] == [
        (0, "MoveTask", None),
        (120 * SECOND, "PickUp", "high"),
    ]
    assert scenario.requests[1].params == {"target": Place(0.0, 0.0), "user": AgentRef("picker_1")}
    assert [(fault.at, fault.kind) for fault in scenario.faults] == [
        (40 * SECOND, "freeze"),
        (45 * SECOND, "wrong_id"),
        (50 * SECOND, "thaw"),
    ]
    assert sorted(scenario.tasks) == ["MoveTask", "PickUp"]


def test_a_place_may_be_given_as_latitude_and_longitude(catalogue: Catalogue) -> None:
    task = "{task: PickUp, params: {user: picker_1, lat: 66.501, lng: 25.7}}"
    scenario = read(HEAD + FLEET + f"tasks:\n  - {task}\n", catalogue)

    target = scenario.requests[0].params["target"]
    assert (round(target.east_m), round(target.north_m)) == (0, 112)
    assert scenario.requests[0].texts == {"user": "picker_1", "lat": "66.501", "lng": "25.7"}


def test_every_kind_of_fault_can_be_written(catalogue: Catalogue) -> None:
    needs = {"slow": ", delay: 2 s", "battery": ", charge: 30 %", "preflight": ", check: gnss", "event": ", event: sos"}
    whom = {"event": "picker_1"}
    lines = [
        f"  - {{at: 1 s, agent: {whom.get(kind, 'hwd_1')}, kind: {kind}{needs.get(kind, '')}}}\n" for kind in FAULTS
    ]
    scenario = read(HEAD + FLEET + "faults:\n" + "".join(lines), catalogue)
    assert [fault.kind for fault in scenario.faults] == list(FAULTS)


def test_weather_load_and_links_can_be_written(catalogue: Catalogue) -> None:
    scenario = read(
        HEAD
        + """wind: {east: 3 m/s, north: -1 m/s}
agents:
  - {id: hwd_1, payload: 1.5 kg, cut: true, on_link_loss: land}
  - {id: hwd_2}
  - {id: picker_1, at: camp}
faults:
  - {at: 10 s, agent: hwd_1, kind: link_loss, for: 20 s, presence: stays}
  - {at: 20 s, kind: wind, east: 5 m/s}
""",
        catalogue,
    )
    first, second, _ = scenario.agents
    assert scenario.wind == (3.0, -1.0)
    assert (first.payload_kg, first.cut, first.on_link_loss) == (1.5, True, "land")
    assert (second.payload_kg, second.cut, second.on_link_loss) == (0.0, False, "return")
    assert [(f.at // SECOND, f.agent, f.kind, f.on, f.vanishes, f.east) for f in scenario.faults] == [
        (10, "hwd_1", "link_loss", True, False, 0.0),
        (20, "hwd_1", "wind", True, True, 5.0),
        (20, "hwd_2", "wind", True, True, 5.0),
        (30, "hwd_1", "link_loss", False, False, 0.0),
    ]


def test_people_order(catalogue: Catalogue) -> None:
    scenario = read(
        HEAD
        + FLEET
        + """tasks: [{task: MoveTask}]
orders:
  - {at: 90 s, lockdown: return, by: picker_1}
  - {at: 60 s, order: hold, target: hwd_1, by: picker_1}
  - {at: 61 s, order: land, target: all}
  - {at: 62 s, order: continue, target: MoveTask}
  - {at: 63 s, order: handback, target: hwd_1}
  - {at: 64 s, order: handback, target: hwd_1, how: end}
  - {at: 65 s, order: removed, target: hwd_1}
  - {at: 95 s, abort: MoveTask, how: now}
""",
        catalogue,
    )
    assert [(o.at // SECOND, o.order, o.of, o.target, o.how, o.by) for o in scenario.orders] == [
        (60, "hold", "agent", "hwd_1", "", "picker_1"),
        (61, "land", "all", "", "", "operator"),
        (62, "continue", "task", "MoveTask", "", "operator"),
        (63, "handback", "agent", "hwd_1", "continue", "operator"),
        (64, "handback", "agent", "hwd_1", "end", "operator"),
        (65, "removed", "agent", "hwd_1", "", "operator"),
        (90, "lockdown", "site", "", "return", "picker_1"),
        (95, "abort", "task", "MoveTask", "now", "operator"),
    ]


def test_problems_of_the_site_and_of_a_task_are_told_with_the_scenario(tmp_path: Path, catalogue: Catalogue) -> None:
    (tmp_path / "mine.yaml").write_text("formiga: 1\ntask: Mine\nsteps:\n  - do: nobody.TakeOff\n")
    (tmp_path / "try.yaml").write_text(f"{HEAD}{FLEET}tasks:\n  - {{task: Mine}}\n")
    loaded = load_scenario(tmp_path / "try.yaml", catalogue=catalogue)
    assert loaded.scenario is None
    assert {Path(problem.mark.file).name for problem in loaded.diagnostics} == {"mine.yaml", "try.yaml"}
    (tmp_path / "site.yaml").write_text("formiga_site: 1\nname: x\nbase: {lat: 100, lng: 3}\n")
    (tmp_path / "try.yaml").write_text(f"scenario: try\nsite: site.yaml\n{FLEET}")
    loaded = load_scenario(tmp_path / "try.yaml", catalogue=catalogue)
    assert [short(problem)[1] for problem in loaded.diagnostics] == ["E062"]
    assert load_scenario(tmp_path / "none.yaml", catalogue=catalogue).diagnostics[0].code == "E008"


def test_tasks_of_the_sites_own_folder_are_found_before_those_that_ship(tmp_path: Path, catalogue: Catalogue) -> None:
    """As `formiga up` finds them; and after those beside the scenario."""
    site = (folder("trees") / "demo-site.yaml").read_text(encoding="utf-8")
    task = "formiga: 1\ntask: {}\nsteps: [{{wait: {} s}}]\n"
    for file, text in (
        ("site.yaml", site),
        ("trees/mine.yaml", task.format("Mine", 1)),
        ("trees/deep/er.yaml", task.format("Deeper", 1)),
        ("trees/circle.yaml", task.format("Circle", 1)),
        ("trees/mine.test.yaml", "formiga_test: 1\ntask: Mine\n"),
        ("plays/mine.yaml", task.format("Mine", 2)),
        (
            "plays/day.yaml",
            f"scenario: day\nsite: ../site.yaml\n{FLEET}tasks: [{{task: Mine}}, {{task: Deeper}}, {{task: Circle}}]\n",
        ),
    ):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text, encoding="utf-8")

    loaded = load_scenario(tmp_path / "plays/day.yaml", catalogue=catalogue)

    assert loaded.scenario is not None, loaded.diagnostics
    found = {
        name: str(Path(task.mark.file).resolve().relative_to(tmp_path.resolve()))
        for name, task in loaded.scenario.tasks.items()
    }
    assert found == {"Mine": "plays/mine.yaml", "Deeper": "trees/deep/er.yaml", "Circle": "trees/circle.yaml"}


def test_what_its_tasks_request_is_played_too(tmp_path: Path, catalogue: Catalogue) -> None:
    (tmp_path / "first.yaml").write_text("formiga: 1\ntask: First\nsteps:\n  - request: Second\n")
    (tmp_path / "second.yaml").write_text("formiga: 1\ntask: Second\nsteps:\n  - request: Third\n")
    (tmp_path / "third.yaml").write_text("formiga: 1\ntask: Third\nsteps:\n  - wait: 2 s\n")
    orders = "orders:\n  - {at: 1 s, order: hold, target: Third}\n"
    (tmp_path / "try.yaml").write_text(f"{HEAD}{FLEET}tasks:\n  - {{task: First}}\n")

    scenario = load_scenario(tmp_path / "try.yaml", catalogue=catalogue).scenario

    assert scenario is not None
    assert list(scenario.tasks) == ["First", "Second", "Third"]
    run = VirtualRun(scenario)
    assert run.run()
    tasks = run.rehearsal.engine.state.tasks.values()
    assert [(task.name, task.status) for task in tasks] == [
        ("First", "SUCCEEDED"),
        ("Second", "SUCCEEDED"),
        ("Third", "SUCCEEDED"),
    ]
    (tmp_path / "try.yaml").write_text(f"{HEAD}{FLEET}tasks:\n  - {{task: First}}\n{orders}")
    assert load_scenario(tmp_path / "try.yaml", catalogue=catalogue).diagnostics == []


def test_a_mistake_in_what_its_tasks_request_is_told_once(tmp_path: Path, catalogue: Catalogue) -> None:
    (tmp_path / "first.yaml").write_text("formiga: 1\ntask: First\nsteps:\n  - request: Second\n")
    (tmp_path / "again.yaml").write_text("formiga: 1\ntask: Again\nsteps:\n  - request: Second\n")
    (tmp_path / "second.yaml").write_text("formiga: 1\ntask: Second\nsteps:\n  - do: nobody.TakeOff\n")
    (tmp_path / "try.yaml").write_text(f"{HEAD}{FLEET}tasks:\n  - {{task: First}}\n  - {{task: Again}}\n")

    loaded = load_scenario(tmp_path / "try.yaml", catalogue=catalogue)

    assert loaded.scenario is None
    assert [(Path(one.mark.file).name, one.mark.line, one.code) for one in loaded.diagnostics] == [
        ("second.yaml", 4, "E020"),
        ("try.yaml", 7, "E010"),
    ]
    said = f"a task that First requests has errors ({tmp_path / 'second.yaml'})"
    assert loaded.diagnostics[1].message == said
