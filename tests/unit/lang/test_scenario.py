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


def problems(text: str, catalogue: Catalogue) -> list[tuple[int, str, str]]:
    loaded = load_scenario_text(text, "x.yaml", catalogue=catalogue)
    assert loaded.scenario is None
    return [short(problem) for problem in loaded.diagnostics]


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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [(1, "E008", "the file is empty")]),
        ("scenario: x\nsite: demo-sit.yaml\nagents: []\n",
         [(2, "E008", "no site file 'demo-sit.yaml'; did you mean 'demo-site.yaml'?")]),
        ("site: demo-site.yaml\n" + FLEET, [(1, "E008", "a scenario needs 'scenario'")]),
        (HEAD + "agents: []\n", [(3, "E044", "'agents' is an empty list")]),
        (HEAD + "sped: 3\n" + FLEET, [(3, "E004", "a scenario has no option 'sped'; did you mean 'speed'?")]),
        (HEAD + "speed: 40\n" + FLEET, [(3, "E062", "'speed' must lie between 0.1 and 20")]),
        (HEAD + "seed: 1.5\n" + FLEET, [(3, "E062", "'seed' must be a whole number from 0 on")]),
    ],
)  # fmt: skip
def test_a_wrong_head_is_named(text: str, expected: list[tuple[int, str, str]], catalogue: Catalogue) -> None:
    assert problems(text, catalogue) == expected


@pytest.mark.parametrize(
    ("agent", "expected"),
    [
        ("{id: hwd_2, type: hvd}", "E020 no agent type is called 'hvd'"),
        ("{id: hwd_1, type: hwd, at: p4}", "E018 there is an agent 'hwd_1' already"),
        ("{id: hwd_7, type: hwd, at: p5}", "E018 'hwd_7' stands where 'hwd_1' stands"),
        ("{id: hwd_7, type: hwd}", "E008 'hwd_7' has no port of its own: it needs 'at'"),
        ("{id: hwd_7, at: p4}", "E008 'hwd_7' needs 'type': the site does not list it; did you mean 'hwd_2'?"),
        ("{id: lwd_1, type: hwd}", "E013 'lwd_1' is a lwd at this site, not a hwd"),
        ("{id: hwd_2, at: nort_field}", "E010 no port or place is called 'nort_field'; did you mean 'north_field'?"),
        ("{id: hwd_2, battery: 130 %}", "E062 'battery' must lie between 0 % and 100 %"),
        ("{id: hwd_2, battery: 90}", "E017 'battery' needs a unit: 90 %?"),
        ("{id: hwd_2, person: {}}", "E008 'hwd_2' is a hwd: only people have 'person'"),
        (
            "{id: picker_2, at: camp, person: {answers: [{match: x}]}}",
            "E008 an answer needs 'options', 'fields' or 'never: true'",
        ),
        ("{id: picker_2, at: camp, person: {awnsers: []}}", "E004 a person has no option 'awnsers'; did you mean 'answers'?"),
        ("{id: picker_2, at: {east: 3, north: 4 m}}", "E017 east needs a unit: 3 m?"),
        ("{id: picker_2, at: camp, cut: true}", "E008 'picker_2' is a person: only drones have 'cut'"),
        ("{id: hwd_2, payload: 2}", "E017 'payload' needs a unit: 2 kg?"),
        ("{id: hwd_2, payload: -2 kg}", "E062 'payload' must not be negative"),
        ("{id: hwd_2, on_link_loss: home}", "E008 'on_link_loss' cannot be 'home'"),
    ],
)  # fmt: skip
def test_a_wrong_agent_is_named(agent: str, expected: str, catalogue: Catalogue) -> None:
    found = problems(f"{HEAD}{FLEET}  - {agent}\n", catalogue)
    assert [(line, f"{code} {text}") for line, code, text in found] == [(6, expected)]


@pytest.mark.parametrize(
    ("task", "expected"),
    [
        ("{task: PickUpp}", "E010 no task is called 'PickUpp'; did you mean 'PickUp'?"),
        ("{at: 3 s}", "E008 a task needs 'task'"),
        ("{task: MoveTask, at: 5}", "E017 'at' needs a unit: 5 s?"),
        ("{task: MoveTask, at: -5 s}", "E062 'at' must not be negative"),
        ("{task: MoveTask, priority: urgent}", "E008 'priority' cannot be 'urgent'"),
        ("{task: MoveTask, params: {robt: hwd_1}}", "E010 MoveTask has no parameter 'robt'; did you mean 'robot'?"),
        ("{task: MoveTask, params: {robot: hwd_3}}", "E010 no agent of this scenario is called 'hwd_3'; did you mean 'hwd_1'?"),
        ("{task: MoveTask, params: {robot: picker_1}}", "E013 'robot' is a hwd or lwd, 'picker_1' is a picker"),
        ("{task: PickUp, params: {target: camp}}", "E051 PickUp needs the parameter 'user' (picker agent)"),
        ("{task: PickUp, params: {target: camp, user: picker_1, height: 300 m}}", "E062 'height' must be at most 120 m"),
        ("{task: PickUp, params: {target: camp, user: picker_1, username: picker_1}}",
         "E018 'username' and 'user' are the same parameter"),
        ('{task: PickUp, params: {lat: 66.5, user: picker_1}}', "E051 'lat' is half a place: 'lng' is missing"),
        ('{task: PickUp, params: {lat: 66.5, lng: 25.7, target: camp, user: picker_1}}',
         "E018 'target' and 'lat and lng' are the same parameter"),
        ('{task: PickUp, params: {target: "66.6,25.7", user: picker_1}}',
         "E063 'target' lies outside the fence of site rovaniemi"),
        ('{task: PickUp, params: {target: "${now}", user: picker_1}}',
         "E027 'now' has no value here: this is read before there is a task"),
        ('{task: PickUp, params: {target: "${[base][1]}", user: picker_1}}',
         "E062 'target' has no value: the list has 1 items, there is no [1]"),
    ],
)  # fmt: skip
def test_a_wrong_task_is_named(task: str, expected: str, catalogue: Catalogue) -> None:
    found = problems(f"{HEAD}{FLEET}tasks:\n  - {task}\n", catalogue)
    assert [(line, f"{code} {text}") for line, code, text in found] == [(7, expected)]


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("{at: 1 s, agent: hwd_1}", "E008 a fault needs 'kind'"),
        ("{agent: hwd_1, kind: kill}", "E008 the fault 'kill' needs 'at'"),
        ("{at: 1 s, agent: hwd_1, kind: frezee}", "E008 'kind' cannot be 'frezee'; did you mean 'freeze'?"),
        ("{at: 1 s, agent: hwd_8, kind: kill}", "E010 no agent of this scenario is called 'hwd_8'; did you mean 'hwd_1'?"),
        ("{at: 1 s, agent: picker_1, kind: take_over}", "E013 'picker_1' is a person: nobody can take over"),
        ("{at: 1 s, agent: hwd_1, kind: slow}", "E008 the fault 'slow' needs 'delay'"),
        ("{at: 1 s, agent: hwd_1, kind: nan, count: 0}", "E062 'count' must be a whole number from 1 on"),
        ("{at: 1 s, agent: hwd_1, kind: thaw, for: 2 s}", "E004 the fault 'thaw' has no option 'for'"),
        ("{at: 1 s, agent: hwd_1, kind: battery}", "E008 the fault 'battery' needs 'charge'"),
        ("{at: 1 s, agent: hwd_1, kind: battery, charge: 120 %}", "E062 'charge' must lie between 0 % and 100 %"),
        ("{at: 1 s, agent: picker_1, kind: battery, charge: 20 %}", "E013 'picker_1' is a person: no charge to change"),
        ("{at: 1 s, agent: hwd_1, kind: preflight, check: gps}", "E008 'check' cannot be 'gps'"),
        ("{at: 1 s, agent: hwd_1, kind: drift, east: 50 m}", "E062 'east' must lie between -20 m and 20 m"),
        ("{at: 1 s, agent: hwd_1, kind: event, event: sos}", "E021 hwd has no event 'sos'"),
        ("{at: 1 s, kind: drift, east: 5 m}", "E008 the fault 'drift' needs 'agent'"),
        ("{at: 1 s, kind: wind, east: 5}", "E017 'east' needs a unit: 5 m/s?"),
        ("{at: 1 s, agent: hwd_1, kind: link_loss, presence: here}", "E008 'presence' cannot be 'here'"),
    ],
)  # fmt: skip
def test_a_wrong_fault_is_named(fault: str, expected: str, catalogue: Catalogue) -> None:
    found = problems(f"{HEAD}{FLEET}faults:\n  - {fault}\n", catalogue)
    assert [(line, f"{code} {text}") for line, code, text in found] == [(7, expected)]


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


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("{order: hold, target: hwd_1}", "E008 the order 'hold' needs 'at'"),
        ("{at: 1 s, target: hwd_1}", "E008 an order needs 'order'"),
        ("{at: 1 s, order: hold}", "E008 the order 'hold' needs 'target'"),
        ("{at: 1 s, order: retrun, target: hwd_1}", "E008 'order' cannot be 'retrun'; did you mean 'return'?"),
        ("{at: 1 s, order: hold, target: hwd_2}",
         "E010 no agent or task of this scenario is called 'hwd_2'; did you mean 'hwd_1'?"),
        ("{at: 1 s, order: hold, target: MoveTsk}",
         "E010 no agent or task of this scenario is called 'MoveTsk'; did you mean 'MoveTask'?"),
        ("{at: 1 s, order: hold, target: picker_1}", "E013 'picker_1' is a person: orders are for machines"),
        ("{at: 1 s, order: cut, target: all}", "E013 'cut' is for one agent, 'all' is everything"),
        ("{at: 1 s, order: restart, target: hwd_1}", "E013 'restart' is for one task, 'hwd_1' is an agent"),
        ("{at: 1 s, order: hold, target: hwd_1, how: end}", "E004 the order 'hold' has no option 'how'"),
        ("{at: 1 s, order: handback, target: hwd_1, how: home}", "E008 'how' cannot be 'home'"),
        ("{at: 1 s, order: hold, target: hwd_1, by: piker_1}",
         "E010 no person of this scenario is called 'piker_1'; did you mean 'picker_1'?"),
        ("{at: 1 s, order: hold, target: hwd_1, by: hwd_1}", "E013 'hwd_1' is no person: it orders nothing"),
        ("{at: 1 s, lockdown: fly}", "E008 'lockdown' cannot be 'fly'"),
        ("{at: 1 s, lockdown: return, target: hwd_1}", "E004 a lockdown has no option 'target'"),
        ("{at: 1 s, abort: PickUp}", "E010 no task of this scenario is called 'PickUp'"),
        ("{at: 1 s, abort: hwd_1}", "E013 'abort' is for one task, 'hwd_1' is an agent"),
    ],
)  # fmt: skip
def test_a_wrong_order_is_named(order: str, expected: str, catalogue: Catalogue) -> None:
    found = problems(f"{HEAD}{FLEET}tasks: [{{task: MoveTask}}]\norders:\n  - {order}\n", catalogue)
    assert [(line, f"{code} {text}") for line, code, text in found] == [(8, expected)]


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
