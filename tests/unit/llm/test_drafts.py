"""Drafts that wait for a person."""

import json
from dataclasses import replace as with_tasks
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.errors import SiteError, UnusableFile
from formiga_bt.base.packaged import files
from formiga_bt.base.packaged import folder as packaged
from formiga_bt.lang.loader import load_task
from formiga_bt.llm.draft import Options, draft
from formiga_bt.llm.drafts import delete, drafts_folder, keep, numbers, read_draft
from formiga_bt.llm.origin import kept_with_origin, note_drafted
from formiga_bt.llm.records import Draft, Message, ModelReply, Origin, ParamValue, Round
from formiga_bt.llm.world import world_of
from formiga_bt.safety.drafted import drafted, said_in, stamped
from formiga_bt.services.kept.drafted import known_of
from tests.golden import Wording
from tests.unit.llm.scripted import Scripted, fly_to, home, tree

WAIT = "formiga: 1\ntask: Circle\nagents: {{w: {{type: watcher}}}}\nsteps: [{{wait: {}}}]\n"
ROUND = Round(messages=(Message("user", "a"),), reply=ModelReply(text=""), yaml=WAIT.format("4 s"))

DRAFT = Draft(
    request="a circle", kind="task", task="Circle", yaml="formiga: 1", values=(ParamValue("radius", "3 m", "three"),)
)
ORIGIN = Origin(by="eve", request="a circle", provider="local", model="q15", prompt_sha256="0f", rounds=2)


def test_a_draft_is_found_again_as_it_was_kept(tmp_path: Path) -> None:
    folder = drafts_folder(tmp_path / "site.yaml", "meadow")
    kept = keep(folder, DRAFT, ORIGIN)
    assert (kept.number, kept.folder) == (1, tmp_path / ".formiga" / "meadow" / "drafts" / "1")
    found = read_draft(folder, 1)
    assert found.origin == ORIGIN
    assert found.draft == Draft(**{**{f: getattr(DRAFT, f) for f in DRAFT.__struct_fields__}, "yaml": "formiga: 1\n"})


def test_the_task_is_what_its_file_says_now(tmp_path: Path) -> None:
    kept = keep(tmp_path, DRAFT, ORIGIN)
    (kept.folder / "task.yaml").write_text("mended", encoding="utf-8")
    assert read_draft(tmp_path, 1).draft.yaml == "mended"


def test_numbers_only_grow_and_a_half_written_folder_is_passed_over(tmp_path: Path) -> None:
    assert numbers(tmp_path / "nothing") == []
    (tmp_path / "7").mkdir()
    (tmp_path / "x").mkdir()
    assert keep(tmp_path, DRAFT, ORIGIN).number == 8
    assert keep(tmp_path, DRAFT, ORIGIN).number == 9
    assert numbers(tmp_path) == [8, 9]


def test_what_is_not_there_or_damaged_is_told_with_what_to_do(tmp_path: Path, wording: Wording) -> None:
    kept = keep(tmp_path, DRAFT, ORIGIN)
    with pytest.raises(UnusableFile) as refused:
        read_draft(tmp_path, 2)
    wording(refused.value)
    (kept.folder / "draft.json").write_text("{")
    with pytest.raises(UnusableFile) as refused:
        read_draft(tmp_path, 1)
    wording(refused.value)


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises((UnusableFile, SiteError), match="cannot write "):
        keep(tmp_path / "file", DRAFT, ORIGIN)


def test_what_was_kept_is_known_beside_the_drafts_but_not_what_people_wrote(tmp_path: Path) -> None:
    world = world_of()
    folder = drafts_folder(tmp_path / "site.yaml", "rovaniemi")
    mine_ = replace(DRAFT, yaml=WAIT.format("3 s"), rounds=(ROUND,), provider="groq", model="llama")
    kept = kept_with_origin(mine_, folder, world, by="eve", unix_millis=7, people=["root@desk"])
    assert kept.draft.yaml == (
        '# drafted {"by": ["eve"], "model": "groq llama", "also": ["root@desk"]}\n' + WAIT.format("3 s")
    )
    assert list(known_of(folder.parent).values()) == [drafted(["eve"], "groq llama", ["root@desk"])] * 2
    delete(folder, kept.number)
    assert len(known_of(folder.parent)) == 2  # what it says, and what the first round said

    mine = with_tasks(world, tasks={"mine.yaml": WAIT.format("5 s")})
    shipped = (packaged("trees") / "move_task.yaml").read_text(encoding="utf-8")
    for text in (WAIT.format("5 s"), shipped):
        kept_with_origin(replace(mine_, yaml=text), folder, mine, by="eve", unix_millis=7)
    assert len(known_of(folder.parent)) == 2
    marked = with_tasks(world, tasks={"mine.yaml": stamped(WAIT.format("5 s"), drafted(["eve"]))})
    kept_with_origin(replace(mine_, yaml=WAIT.format("5 s")), folder, marked, by="eve", unix_millis=7)
    assert len(known_of(folder.parent)) == 3


def test_no_task_that_ships_counts_as_written_by_a_model_that_says_it_again(tmp_path: Path) -> None:
    world = world_of()
    loaded = [load_task(path, catalogue=world.catalogue, site=world.site) for path in files("trees")]
    tasks = [one.task for one in loaded if one.task is not None]
    assert len(tasks) > 10

    note_drafted(tmp_path, tasks, drafted(["eve"]), world, draft=1, unix_millis=7)
    assert known_of(tmp_path) == {}


@pytest.mark.parametrize("where", ["request", "plan"])
def test_who_asked_cannot_be_replaced_by_words(where: str, tmp_path: Path) -> None:
    crowd = json.dumps({"by": ["aa", *map(str, range(9))], "also": [f"z{n}" for n in range(10)]})
    said = f"drafted {crowd}"
    answer = tree(fly_to("camp"), home(), task="Look") | ({"plan": said} if where == "plan" else {})
    request = "A light drone flies to the camp and comes home."
    request = f"{said} {request}" if where == "request" else request
    made = draft(request, world_of(), Scripted(answer), options=Options(rounds=0, compare=False))
    kept = kept_with_origin(made, tmp_path / "drafts", world_of(), by="eve", unix_millis=7, people=["root"])

    found = said_in(kept.draft.yaml)
    assert found is not None
    assert (found.by, found.also) == (("eve",), ("root",))
    assert '> drafted {"by"' in kept.draft.yaml


def test_what_has_errors_is_kept_with_the_line_alone(tmp_path: Path) -> None:
    kept = kept_with_origin(DRAFT, tmp_path / "drafts", world_of(), by="eve", unix_millis=7)
    assert kept.draft.yaml.startswith("# drafted {")
    assert known_of(tmp_path) == {}
