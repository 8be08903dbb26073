"""The table of tools, the texts to read, proposals, and the document of all that."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest
from msgspec import structs

from formiga_bt.base.errors import FormigaError, UnusableFile
from formiga_bt.lang.kinds import KINDS
from formiga_bt.llm.drafts import briefs, drafts_folder, keep, numbers, read_draft
from formiga_bt.llm.mcp import catalogue, pages
from formiga_bt.llm.mcp import records as r
from formiga_bt.llm.mcp.ground import ServedSite, ServerFiles, ground_of
from formiga_bt.llm.mcp.judge import JudgeJob, done
from formiga_bt.llm.mcp.proposals import MOST_OPEN, doubles, draft_of, needed, next_steps, propose
from formiga_bt.llm.mcp.tools import TOOLS, schema_of
from formiga_bt.llm.origin import Asker, approve
from formiga_bt.llm.records import Draft, Origin
from formiga_bt.safety.approval import approval_digest
from formiga_bt.safety.drafted import said_in
from formiga_bt.services.crew import keep as keep_approval
from tests.golden import Wording

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def ground() -> ServedSite:
    return ground_of(ServerFiles())


def test_the_document_lists_the_tools_and_no_other() -> None:
    text = (ROOT / "docs" / "mcp.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE) == [tool.name for tool in TOOLS]


def test_one_tool_writes_and_none_is_called_like_an_order() -> None:
    assert [tool.name for tool in TOOLS if tool.writes] == ["propose_task"]
    orders = ("run", "submit", "approve", "answer", "abort", "hold", "land", "return", "continue", "cut", "lockdown")
    assert [tool.name for tool in TOOLS if tool.name.split("_")[0] in orders] == []


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_schemas_are_closed_objects_with_words_for_each_argument(tool: Any) -> None:
    takes, gives = schema_of(tool.takes), schema_of(tool.gives)
    for schema in (takes, gives):
        jsonschema.Draft202012Validator.check_schema(schema)
        assert schema["type"] == "object"
    assert takes["additionalProperties"] is False
    assert [name for name, of in takes["properties"].items() if not of.get("description")] == []
    assert re.fullmatch(r"[a-z_]+", tool.name)
    assert 40 < len(tool.does) < 400


@pytest.mark.parametrize(
    "arguments",
    [
        {"yaml": "x" * 65_537},
        {"yaml": "x", "params": {str(i): 1 for i in range(101)}},
        {"yaml": "x", "params": {"x" * 101: 1}},
        {"yaml": "x", "hours": 25},
        {"yaml": "x", "hours": 0},
        {"yaml": "x", "file": "/etc/passwd"},
        {"yaml": None},
        {"yaml": "x", "params": [1]},
    ],
)
def test_arguments_beyond_the_bounds_are_refused(arguments: dict[str, Any]) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(arguments, r.Flown)


# -- lists ----------------------------------------------------------------------------------------------------------------
def test_actions_are_told_with_units_and_bounds(ground: ServedSite) -> None:
    told = {one.name: one for one in catalogue.actions(ground.catalogue, "lwd").actions}
    assert set(told) == {"TakeOff", "GoTo", "LandIn", "Explore"}
    (altitude,) = told["TakeOff"].fields
    assert (altitude.type, altitude.required, altitude.default) == ("distance", False, "agent.transit_height")
    assert (altitude.least, altitude.most) == ("2 m", "120 m")
    assert (told["TakeOff"].requires, told["TakeOff"].leaves) == ("grounded", "airborne")


def test_what_only_a_person_orders_is_no_action_of_a_task(ground: ServedSite) -> None:
    assert "CutMotors" not in {one.name for one in catalogue.actions(ground.catalogue).actions}


def test_tasks_are_told_with_their_parameters(ground: ServedSite) -> None:
    (told,) = catalogue.tasks(ground, "buckets").tasks
    assert (told.task, told.own, told.roles["drone"]) == ("PickUp", False, "hwd")
    assert [one.name for one in told.params if one.required] == ["target", "user"]


# -- texts ----------------------------------------------------------------------------------------------------------------
def test_the_example_of_the_language_checks_clean_and_flies(ground: ServedSite) -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", pages.SHORT, re.MULTILINE | re.DOTALL)
    assert ground.load(example).diagnostics == []
    told = done(JudgeJob(kind="fly", yaml=example, params={"target": "north_field"}), ground, lambda *_: None)
    assert told.flight is not None
    assert told.flight.ok


def test_the_language_in_short_names_all_kinds() -> None:
    said = pages.SHORT.partition("- Kinds: ")[2].partition(".")[0]
    assert set(re.split(r"[,\s]+", said)) == set(KINDS)


def test_all_that_is_listed_can_be_read(ground: ServedSite) -> None:
    listed = list(pages.entries(ground))
    assert len({one.uri for one in listed}) == len(listed) > 200
    for one in listed:
        text, mime = pages.page(one.uri, ground)
        assert text.strip(), one.uri
        assert mime == one.mime


@pytest.mark.parametrize(
    "uri",
    [
        "formiga://language/../../errors",
        "formiga://language/../errors",
        "formiga://trees/../demo-site",
        "formiga://trees/",
        "formiga://codes/E999",
        "formiga://reasons/",
        "file:///etc/passwd",
        "formiga://",
    ],
)
def test_an_address_that_is_not_listed_is_refused(ground: ServedSite, uri: str) -> None:
    with pytest.raises(UnusableFile):
        pages.page(uri, ground)


def test_the_prompt_quotes_what_the_person_wants(ground: ServedSite, wording: Wording) -> None:
    told = pages.mission_prompt("Look at the camp.\n2. Skip the check.")
    wording(told)
    assert all(f"`{name}`" in told for name in ("language", "list_agents", "check_task", "dry_run", "propose_task"))


# -- proposals ------------------------------------------------------------------------------------------------------------
def proposal() -> tuple[Draft, Origin]:
    flight = r.FlightOut(ok=True, task="Circle", status="SUCCEEDED", duration_s=9.0, agents={"drone": ["lwd_1"]})
    return draft_of("formiga: 1", flight, {"radius": "3 m"}, "a circle", "some\nassistant", ["W064 line 3: far"], 77)


def test_a_proposal_is_kept_as_a_draft_that_says_who_asked(tmp_path: Path) -> None:
    folder = drafts_folder(tmp_path / "site.yaml", "meadow")
    assert folder == tmp_path / ".formiga" / "meadow" / "drafts"
    (folder / "7").mkdir(parents=True)
    kept = propose(folder, *proposal())
    assert (kept.number, kept.folder) == (8, folder / "8")
    draft = read_draft(folder, 8).draft
    assert (draft.kind, draft.task, draft.request, draft.is_flyable) == ("task", "Circle", "a circle", True)
    assert [(one.name, one.text) for one in draft.values] == [("radius", "3 m")]
    origin = json.loads((kept.folder / "origin.json").read_text())
    assert (origin["by"], origin["approved_by"], origin["unix_millis"]) == ("mcp:some assistant", "", 77)


def test_a_person_is_told_commands_that_hold_no_others(ground: ServedSite, tmp_path: Path, wording: Wording) -> None:
    kept = propose(tmp_path / "my drafts", *proposal())
    evil = {"radius": "3 m; rm -rf ~", "$(x)": "1"}
    wording(next_steps(kept, ground, evil, is_there=True), next_steps(kept, ground, {}, is_there=False))


def test_on_a_real_site_a_task_is_approved_first(ground: ServedSite, tmp_path: Path, wording: Wording) -> None:
    real = replace(ground, own=tmp_path, site=structs.replace(ground.site, mode="real", people={"approvers": ("eve",)}))
    kept = propose(tmp_path, *proposal())
    wording(next_steps(kept, real, {}, is_there=True)[1])
    assert next_steps(kept, real, {}, is_there=False)[1:] == [
        f"cp -n {tmp_path}/1/task.yaml {tmp_path}/circle.yaml",
        f"formiga load {tmp_path}/circle.yaml",
        f"formiga approve {tmp_path}/circle.yaml --by eve",
        f"formiga run {tmp_path}/circle.yaml",
    ]


def test_elsewhere_the_running_engine_reads_its_file(ground: ServedSite, tmp_path: Path, wording: Wording) -> None:
    kept = propose(tmp_path, *proposal())
    wording(next_steps(kept, replace(ground, own=tmp_path), {"radius": "3 m"}, is_there=False)[1:])


def test_a_file_that_is_there_is_neither_run_nor_replaced(ground: ServedSite, tmp_path: Path, wording: Wording) -> None:
    kept = propose(tmp_path / "drafts", *proposal())
    mine = replace(ground, own=tmp_path, tasks={"Circle": tmp_path / "circle.yaml"})
    (tmp_path / "circle.yaml").write_text("formiga: 1\ntask: Circle\n")
    (tmp_path / "circle_2.yaml").mkdir()
    assert next_steps(kept, mine, {}, is_there=False)[1:] == [
        f"cp -n {kept.folder}/task.yaml {tmp_path}/circle_3.yaml",
        f"formiga run {tmp_path}/circle_3.yaml",
    ]
    wording(doubles(kept, mine))


def test_a_file_with_the_very_text_is_run(ground: ServedSite, tmp_path: Path) -> None:
    kept = propose(tmp_path / "drafts", *proposal())
    mine = replace(ground, own=tmp_path, tasks={"Circle": tmp_path / "circle.yaml"})
    (tmp_path / "circle.yaml").write_bytes((kept.folder / "task.yaml").read_bytes())
    assert next_steps(kept, mine, {}, is_there=False)[-1] == f"formiga run {tmp_path}/circle.yaml"
    assert doubles(kept, mine) == []
    assert doubles(kept, replace(ground, own=tmp_path)) == []  # a task of that name ships


def test_an_assistant_that_names_people_in_its_text_does_not_hide_who_asked() -> None:
    crowd = json.dumps({"by": ["aa", *map(str, range(9))], "also": [f"z{n}" for n in range(10)]})
    text = Asker("mcp:x", ("eve", "root")).marked(f"# drafted {crowd}\nformiga: 1\n")
    found = said_in(text)
    assert found is not None
    assert (found.by[0], found.also[0]) == ("eve", "root")


def filled(folder: Path) -> Path:
    """Return a folder with as many proposals as are kept, and two drafts of a person before them."""
    draft, origin = proposal()
    for _ in range(2):
        keep(folder, draft, structs.replace(origin, by="eve", provider="local"))
    for _ in range(MOST_OPEN):
        propose(folder, draft, origin)
    return folder


def test_the_oldest_proposal_that_nobody_needs_gives_way(tmp_path: Path) -> None:
    folder = filled(tmp_path / "drafts")
    third = read_draft(folder, 3)
    approve(third, approved_by="ann", bundle="ab")
    kept = propose(folder, *proposal(), lambda one: one.number == 4)
    assert kept.number == 53
    assert numbers(folder) == [1, 2, 3, 4, *range(6, 54)]


def test_if_all_proposals_are_needed_a_person_is_told_what_to_do(tmp_path: Path, wording: Wording) -> None:
    folder = filled(tmp_path / "drafts")
    with pytest.raises(FormigaError) as refused:
        propose(folder, *proposal(), lambda _: True)
    wording(str(refused.value))
    assert len(numbers(folder)) == MOST_OPEN + 2


def test_a_proposal_is_needed_while_it_runs_or_stands_approved(ground: ServedSite, tmp_path: Path) -> None:
    folder = tmp_path / ".formiga" / "meadow" / "drafts"
    draft, origin = proposal()
    wait = "formiga: 1\ntask: Circle\nagents: {w: {type: watcher}}\nsteps: [{wait: 1 s}]\n"
    kept = propose(folder, structs.replace(draft, yaml=wait), origin)
    (one,) = briefs(folder)
    assert needed(folder, ground, lambda: {"Circle"})(one)
    assert not needed(folder, ground, lambda: {"Other"})(one)
    task = ground.load((kept.folder / "task.yaml").read_text()).task
    assert task is not None
    word = {"digest": approval_digest(task, ground.site), "task": "Circle", "by": "ann", "at": 1}
    keep_approval(folder.parent, **word)
    assert needed(folder, ground, set)(one)
    keep_approval(folder.parent, **word, revoke=True)
    assert not needed(folder, ground, set)(one)
