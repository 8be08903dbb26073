"""A site of 30 types and 100 actions that nobody foresaw: from `formiga new` to `demo`, with no line of Python.

One catalogue, drawn by a seed; the property test of any catalogue draws many (tests/property/test_any_catalogue.py).
"""

import json
import random
from pathlib import Path
from typing import Any

import pytest

from formiga_bt.cli.app import run
from tests.property.test_any_catalogue import site_of, written_as

TYPES, ACTIONS = 30, 100
MOBILITIES = ("air", "ground", "fixed", "none", "people")
FIELDS: dict[str, Any] = {
    "share": {"type": "percent", "min": "60 %"}, "far": {"type": "distance", "max": "2 m"}, "word": {"type": "text"},
    "mode": {"type": "enum", "values": ["slow", "fast"]}, "many": {"list": "number"},
    "deep": {"type": "mass", "optional": True}, "area": {"type": "region"}, "whom": {"type": "agent"},
}  # fmt: skip
RESULTS = (
    "number",
    "mass",
    "text",
    "bool",
    "place",
    {"list": "duration"},
    {"type": "enum", "values": ["red", "green"]},
)


def catalogue(seed: int) -> dict[str, Any]:
    """Return a catalogue file: types of each mobility in turn, the actions spread over them."""
    draw = random.Random(seed)
    actions: dict[str, Any] = {}
    types: dict[str, Any] = {}
    for number in range(TYPES):
        mobility = MOBILITIES[number % len(MOBILITIES)]
        own = [f"Act{n}" for n in range(number, ACTIONS, TYPES)]
        for name in own:
            fields = {field: FIELDS[field] for field in draw.sample(sorted(FIELDS), draw.randint(0, 3))}
            if mobility in ("air", "ground"):
                fields.pop("area", None)  # a machine that moves about in an area is checked against it
            spec: dict[str, Any] = {"fields": fields, "typical": f"{draw.randint(1, 40)} s"}
            spec["result"] = {word: draw.choice(RESULTS) for word in draw.sample("pqr", draw.randint(0, 2))}
            if mobility == "people" or number == 1:  # others would wait until it has left the place
                fields["goal"] = {"type": "place"}
                spec["moves_to"] = "goal"
            actions[name] = spec
        how: dict[str, Any] = {"human": True} if mobility == "people" else {"mobility": mobility}
        types[f"kind{number}"] = {**how, "actions": own, "limits": {"speed": f"{draw.randint(1, 5)} m/s"}}
    return {"types": types, "actions": actions}


WORLD = catalogue(7)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("trees").mkdir()
    Path("mine.yaml").write_text(written_as(WORLD))
    Path("site.yaml").write_text(written_as(site_of(WORLD["types"])))
    return tmp_path


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    code = run(list(words))
    read = capsys.readouterr()
    return code, read.out + read.err


def name_of(kind: str) -> str:
    return f"Try{kind.title()}"


def test_the_catalogue_is_as_large_as_it_says() -> None:
    assert (len(WORLD["types"]), len(WORLD["actions"])) == (TYPES, ACTIONS)


@pytest.mark.usefixtures("site")
def test_a_task_for_each_type_checks_is_rehearsed_and_tested(capsys: pytest.CaptureFixture[str]) -> None:
    for kind in WORLD["types"]:
        code, out = said(capsys, "new", name_of(kind), "--for", kind)
        assert code == 0, out
    code, out = said(capsys, "check", "--strict", "--site", "site.yaml", "trees", "mine.yaml", "site.yaml")
    assert code == 0, out

    orders = [step for kind in WORLD["types"] for step in ordered(kind)]
    assert len(orders) > ACTIONS / 2
    for kind in list(WORLD["types"])[: len(MOBILITIES)]:
        code, out = said(capsys, "dryrun", f"trees/try_{kind}.yaml", "--json")
        assert code == 0, (kind, out)
        assert [row["action"] for row in json.loads(out)["actions"]] == ordered(kind), kind

    for kind in WORLD["types"]:
        case = {"name": "all goes well", "expect": {"status": "succeeded"}}
        cases = {"formiga_test": 1, "task": f"try_{kind}.yaml", "site": "../site.yaml", "cases": [case]}
        Path(f"trees/try_{kind}.test.yaml").write_text(written_as(cases))
    code, out = said(capsys, "test", "trees", "--json")
    assert code == 0, out
    assert len([case for file in json.loads(out)["files"] for case in file["cases"] if case["ok"]]) == TYPES


def ordered(kind: str) -> list[str]:
    """Return the actions that the task for a type orders."""
    lines = Path(f"trees/try_{kind}.yaml").read_text().splitlines()
    return [line.partition(f"{kind}.")[2] for line in lines if line.startswith(f"  - do: {kind}.")]


def begins(kind: str) -> dict[str, Any]:
    """Return an agent of a scenario: the site says where machines begin, the scenario where people do."""
    return {"id": f"{kind}_1", **({"at": "pit"} if WORLD["types"][kind].get("human") else {})}


@pytest.mark.usefixtures("site")
def test_all_types_work_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    """A scenario with all thirty: `sim` plays it in this process, `demo` with a process each (a few of them here)."""
    kinds = list(WORLD["types"])
    for kind in kinds:
        assert run(["new", name_of(kind), "--for", kind]) == 0
    capsys.readouterr()
    for file, some in (("day.yaml", kinds), ("small.yaml", kinds[: len(MOBILITIES)])):
        day = {
            "scenario": "day", "site": "site.yaml", "speed": 20, "agents": [begins(kind) for kind in some],
            "tasks": [{"at": "0 s", "task": name_of(kind)} for kind in some],
        }  # fmt: skip
        Path(file).write_text(written_as(day))

    code, out = said(capsys, "sim", "day.yaml", "--virtual", "--json")
    assert code == 0, out
    code, out = said(capsys, "demo", "--headless", "--scenario", "small.yaml")
    assert code == 0, out
    assert out.count("SUCCEEDED") >= len(MOBILITIES)


@pytest.mark.usefixtures("site")
def test_new_takes_the_first_type_of_a_site_without_those_that_ship(capsys: pytest.CaptureFixture[str]) -> None:
    code, out = said(capsys, "new", "First")
    assert code == 0, out
    assert "type: kind0" in Path("trees/first.yaml").read_text()

    code, out = said(capsys, "new", "Other", "--for", "kynd3")
    assert (code, "no type is called 'kynd3'" in out) == (2, True)
    assert run(["new", "Other", "--for", "kind3", "--kind", "ask"]) == 2
