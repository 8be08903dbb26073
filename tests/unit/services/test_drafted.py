"""What a site's folder knows of tasks that models wrote, and what a running engine makes of it."""

from pathlib import Path
from typing import Any

import pytest

from formiga_bt.rehearsal.testing import packaged_world, task_of
from formiga_bt.safety.approval import TYPED
from formiga_bt.safety.drafted import drafted, stamped
from formiga_bt.services.kept.drafted import LEDGER, known_below, known_of, note, texts_of, who_drafted
from tests.golden import Wording
from tests.unit.services.conftest import Service, Start
from tests.unit.services.test_crew import real as real

STAY = "formiga: 1\ntask: Stay\nagents: {watcher: {type: watcher}}\nsteps: [{wait: 1 s}]\n"
EVE = drafted(["eve"], "local qwen")
WROTE = "was written by a model (local qwen) on the request of eve"


def task(text: str = STAY) -> Any:
    return task_of(text.partition("task: ")[2].partition("\n")[2], *packaged_world(), name="Stay")


# -- the file ----------------------------------------------------------------------------------------------------------
def test_what_is_noted_is_known_and_noted_once(tmp_path: Path, wording: Wording) -> None:
    runtime = tmp_path / ".formiga" / "meadow"
    assert known_of(runtime) == {}
    for _ in range(2):
        note(runtime, [task(), task()], EVE, draft=3, unix_millis=7)
    (key,) = known_of(runtime)
    (line,) = (runtime / LEDGER).read_text().splitlines()
    wording(line)
    note(runtime, [task()], drafted(["bob"], "local qwen"))
    assert known_of(runtime) == {key: drafted(["eve", "bob"], "local qwen")}
    assert known_below(tmp_path) == known_of(runtime)
    assert who_drafted(task(STAY.replace("watcher:", "w:")), known_of(runtime), ()) is not None
    assert who_drafted(task(STAY.replace("1 s", "2 s")), known_of(runtime), ()) is None


@pytest.mark.parametrize("line", ["{", '{"meaning": 7, "by": 3}', '{"meaning": "ab", "by": [7], "model": {}}', "[]"])
def test_lines_that_are_damaged_do_no_harm(tmp_path: Path, line: str) -> None:
    (tmp_path / LEDGER).write_text(line + "\n")
    assert all(one.people == () for one in known_of(tmp_path).values())
    note(tmp_path, [task()], EVE)
    assert EVE in known_of(tmp_path).values()


def test_files_that_are_gone_say_nothing(tmp_path: Path) -> None:
    assert texts_of(task()) == []


# -- an engine ---------------------------------------------------------------------------------------------------------
def load(service: Service, text: str, file: str = "trees/stay.yaml", **more: Any) -> Any:
    return service.post("/v1/library", {"file": file, "texts": {file: text}, "by": "mallory", **more})


def origin(service: Service, name: str) -> Any:
    (found,) = [one for one in service.get("/v1/approvals")["tasks"] if one["task"] == name]
    return found["drafted"]


def approve(service: Service, name: str, by: str, *, refused: bool = False) -> Any:
    (found,) = [one for one in service.get("/v1/approvals")["tasks"] if one["task"] == name]
    body = {"task": name, "by": by, "digest": found["digest"], "typed": found["digest"][:TYPED]}
    return (service.refused if refused else lambda *given: service.post(*given[1:]))("POST", "/v1/approvals", body)


def run(service: Service, name: str, requester: str) -> Any:
    return service.refused("POST", "/v1/tasks", {"task": name, "by": requester})["text"]


@pytest.mark.network
def test_a_copy_that_is_loaded_by_http_is_known_by_what_it_does(real: Start, tmp_path: Path, wording: Wording) -> None:
    note(tmp_path / ".formiga/old_name", [task()], EVE)
    with real() as service:
        copy = STAY.replace("Stay", "Rest").replace("watcher: {", "somebody: {")
        load(service, copy, "elsewhere/rest.yaml")
        assert origin(service, "Rest") == {"by": ["eve"], "model": "local qwen"}
        said = approve(service, "Rest", "ann")
        wording(said["text"], run(service, "Rest", "ann"))
        assert service.post("/v1/tasks", {"task": "Rest", "by": "rita"})["id"] == "Rest-1"


@pytest.mark.network
def test_the_line_and_the_word_of_a_client_count_and_stay(real: Start, tmp_path: Path, wording: Wording) -> None:
    with real() as service:
        load(service, stamped(STAY.replace("1 s", "3 s"), drafted(["ann"], "groq llama")))
        assert origin(service, "Stay") == {"by": ["ann"], "model": "groq llama"}
        refused = approve(service, "Stay", "ann", refused=True)
        assert (refused["status"], refused["code"]) == (403, "not_approver")
        wording(refused["text"])
        load(service, STAY.replace("1 s", "3 s").replace("Stay", "Bare"), "trees/bare.yaml")  # without the line
        assert origin(service, "Bare") == {"by": ["ann"], "model": "groq llama"}
        load(service, STAY.replace("1 s", "5 s"), drafted={"by": ["bob"], "model": "far"})
        assert origin(service, "Stay") == {"by": ["bob"], "model": "far"}
        load(service, STAY.replace("1 s", "5 s"))  # as it is served: nothing is taken back
        assert origin(service, "Stay") == {"by": ["bob"], "model": "far"}
        load(service, STAY.replace("1 s", "5 s"), drafted={"by": ["ann"]})
        assert origin(service, "Stay") == {"by": ["bob", "ann"], "model": "far"}
        wording(run(service, "Stay", "rita"))


@pytest.mark.network
def test_files_that_are_there_at_the_start_are_looked_at_and_an_old_approval_does_not_help(
    real: Start, tmp_path: Path, wording: Wording
) -> None:
    with real() as service:
        assert origin(service, "Stay") is None
        approve(service, "Stay", "bob")
    note(tmp_path / ".formiga/meadow", [task(STAY.replace("1 s", "1 h"))], drafted(["bob"], "local qwen"))
    with real() as service:
        assert origin(service, "Stay") == {"by": ["bob"], "model": "local qwen"}
        wording(run(service, "Stay", "rita"))
        approve(service, "Stay", "ann")
        assert service.post("/v1/tasks", {"task": "Stay", "by": "rita"})["id"] == "Stay-1"
        assert service.host.driver.error is None


@pytest.mark.network
def test_what_was_loaded_before_a_new_start_is_known_again(real: Start, tmp_path: Path) -> None:
    with real() as service:
        load(service, stamped(STAY.replace("Stay", "Rest"), EVE), "trees/rest.yaml")
    with real() as service:
        assert origin(service, "Rest") == {"by": ["eve"], "model": "local qwen"}


@pytest.mark.network
def test_in_a_simulation_it_is_known_and_binds_nobody(start: Start, tmp_path: Path) -> None:
    with start() as service:
        load(service, stamped(STAY, EVE))
        assert origin(service, "Stay") == {"by": ["eve"], "model": "local qwen"}
        assert service.post("/v1/tasks", {"task": "Stay", "by": "eve"})["id"] == "Stay-1"
