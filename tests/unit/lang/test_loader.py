"""What the loader makes of correct files: the model, with every default filled in."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.base.diagnostics import render
from formiga_bt.lang import model
from formiga_bt.lang.loader import Loaded, load_task, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task

ROOT = Path(__file__).parents[3]
TREES = sorted(
    path for path in (ROOT / "trees").glob("*.yaml") if "site" not in path.name and not path.name.endswith(".test.yaml")
)
Load = Callable[[str], Loaded]
Read = Callable[[str], Task]

AGENTS = "agents:\n  drone: {type: hwd}\n  picker: {type: picker}\n"


class TestShippedTrees:
    @pytest.mark.parametrize("path", TREES, ids=lambda path: path.stem)
    @pytest.mark.parametrize("with_site", [True, False])
    def test_they_check_without_a_single_warning(
        self, path: Path, with_site: bool, catalogue: Catalogue, demo_site: Site
    ) -> None:
        loaded = load_task(path, catalogue=catalogue, site=demo_site if with_site else None)

        assert [render(d, loaded.sources) for d in loaded.diagnostics] == []
        assert loaded.task is not None

    def test_pick_up_is_the_task_of_the_docs(self, catalogue: Catalogue) -> None:
        task = load_task(ROOT / "trees" / "pick_up.yaml", catalogue=catalogue).task

        assert task is not None
        assert [step.title for step in task.steps] == ["FlyTo", "drone.LandIn", "ask", "drone.TakeOff", "ReturnHome"]
        assert [step.seg for step in task.steps] == [f"steps[{i}]" for i in range(5)]
        assert task.roles["drone"].actions == ("TakeOff", "GoTo", "LandIn")
        assert task.roles["picker"].actions == ("Confirm",)
        assert list(task.subtrees) == ["ReturnHome", "FlyOver", "FlyTo", "FlyAndLand", "FetchHome", "LandNear"]
        ask = task.steps[2]
        assert isinstance(ask, model.Ask)
        assert ask.options == ("loaded", "nothing_to_load", "not_yet")
        assert ask.clears is not None
        assert (ask.clears.name, ask.clears_on) == ("drone", ("loaded", "nothing_to_load"))
        assert ask.retry is not None
        assert ask.retry.attempts.const == 3
        assert ask.timeout is not None
        assert ask.timeout.const == 900.0

    def test_move_task_takes_drones_that_stand_elsewhere(self, catalogue: Catalogue) -> None:
        task = load_task(ROOT / "trees" / "move_task.yaml", catalogue=catalogue).task

        assert task is not None
        role = task.roles["drone"]
        assert (role.types, role.away, role.count) == (("hwd", "lwd"), True, None)
        assert role.id is not None
        assert [read.name for read in role.id.reads] == ["robot"]


class TestSteps:
    def test_segments_name_the_branch_and_the_place_in_it(self, task: Read) -> None:
        found = task(
            AGENTS
            + """steps:
  - if: drone.battery > 30 %
    then:
      - wait: 5 s
    else:
      - wait: 6 s
      - sequence:
          - wait: 7 s
        timeout: 1 min
  - fallback:
      - check: picker.battery > 30 %
      - wait: 5 s
on_failure:
  - notify: It failed because of ${error.reason}.
on_abort:
  - notify: Somebody ended it (${abort.reason}).
finally:
  - wait: 1 s
"""
        )
        branch, fallback = found.steps

        assert isinstance(branch, model.If)
        assert isinstance(fallback, model.Fallback)
        assert [s.seg for s in (*branch.then, *branch.otherwise)] == ["then[0]", "else[0]", "else[1]"]
        inner = branch.otherwise[1]
        assert isinstance(inner, model.Sequence)
        assert inner.steps[0].seg == "sequence[0]"
        assert [s.seg for s in fallback.steps] == ["fallback[0]", "fallback[1]"]
        sections = (found.on_failure, found.on_abort, found.finally_)
        assert [s.seg for one in sections for s in one] == ["on_failure[0]", "on_abort[0]", "finally[0]"]

    def test_fields_stand_in_the_catalogues_order_with_defaults(self, task: Read) -> None:
        found = task(
            "agents:\n  drone: {type: hwd, near: '${base}'}\n"
            """steps:
  - do: drone.TakeOff
  - do: drone.GoTo
    with:
      speed: 5 m/s
      to: ${above(base, 60 m)}
  - do: drone.LandIn
    with: {at: "${base}"}
"""
        )
        takeoff, goto, _ = found.steps

        assert isinstance(takeoff, model.Do)
        assert isinstance(goto, model.Do)
        assert [read.field for read in takeoff.fields["altitude"].reads if read.field] == ["transit_height"]
        assert list(goto.fields) == ["to", "speed"]
        assert goto.fields["speed"].const == 5.0

    def test_modifiers_and_options_are_read(self, task: Read) -> None:
        found = task(
            AGENTS
            + """vars:
  count: ${1}
steps:
  - set: {count: "${count + 1}"}
  - ask: Ready?
    name: the question
    note: Look at ${drone.id}.
    of: [picker, watchers]
    policy: all
    escalate_after: 1 min
    if_no_answer: the drone goes home
    timeout: 5 min
    retry: {attempts: 2, delay: 5 s, backoff: 2, attempt_timeout: 1 min}
    ignore_failure: true
    critical: true
  - notify: Hello
    to: [picker]
    severity: warning
  - check: drone.battery > 30 %
    message: too empty
  - fail: no more
    code: no_more
    when: count > 2
"""
        )
        assign, ask, notify, check, fail = found.steps

        assert isinstance(assign, model.Set)
        assert list(assign.assign) == ["count"]
        assert isinstance(ask, model.Ask)
        assert ask.title == "the question"
        assert (ask.policy, ask.ignore_failure, ask.critical) == ("all", True, True)
        assert [(who.name, who.site_role) for who in ask.of] == [("picker", False), ("watchers", True)]
        assert ask.retry is not None
        assert ask.retry.backoff is not None
        assert isinstance(notify, model.Notify)
        assert notify.severity == "warning"
        assert isinstance(check, model.Check)
        assert check.message is not None
        assert isinstance(fail, model.Fail)
        assert (fail.code, fail.message.const) == ("no_more", "no more")

    def test_subtrees_return_values_and_hand_their_needs_up(self, task: Read) -> None:
        found = task(
            """agents:
  picker: {type: picker}
subtrees:
  Outer:
    params: {who: {type: agent, of: [picker]}}
    steps:
      - call: Inner
        with: {person: "${who}"}
        save_as: answered
    returns: ${answered}
  Inner:
    params:
      person: {type: agent, of: [picker]}
      question: {type: text, default: Ready?}
    steps:
      - ask: ${question}
        of: [person]
        timeout: 5 min
        save_as: reply
    returns: ${reply.answer == 'yes'}
steps:
  - call: Outer
    with: {who: "${picker}"}
    save_as: ready
  - check: ready
"""
        )

        assert found.roles["picker"].actions == ("Confirm",)
        assert found.subtrees["Outer"].returns is not None
        assert str(found.subtrees["Outer"].returns.type) == "bool"

    def test_a_role_of_an_abstract_type_takes_every_type_that_extends_it(self, task: Read) -> None:
        found = task("agents:\n  any_drone: {type: drone}\nsteps:\n  - check: any_drone.battery > 30 %\n")

        assert found.roles["any_drone"].types == ("drone", "lwd", "hwd")


class TestTask:
    def test_options_have_the_defaults_of_the_docs(self, task: Read) -> None:
        found = task("steps:\n  - wait: 5 s\n")

        assert (found.priority, found.preemptible, found.if_preempted) == ("medium", True, "restart")
        assert found.timeout is None

    def test_high_priority_is_not_preempted_unless_it_says_so(self, task: Read) -> None:
        assert task("priority: high\nsteps:\n  - wait: 5 s\n").preemptible is False
        assert task("priority: high\npreemptible: true\nsteps:\n  - wait: 5 s\n").preemptible is True

    def test_vars_are_ordered_by_what_they_read(self, task: Read) -> None:
        found = task("vars:\n  b: ${a * 2}\n  a: 30 m\nsteps:\n  - notify: ${a} ${b}\n")

        assert list(found.vars) == ["a", "b"]
        assert str(found.vars["b"].type) == "distance"

    def test_the_bundle_changes_with_task_import_and_catalogue(self, catalogue: Catalogue, tmp_path: Path) -> None:
        (tmp_path / "lib.yaml").write_text("formiga: 1\nsubtrees:\n  Nap:\n    steps:\n      - wait: 5 s\n")
        task = tmp_path / "nap.yaml"
        task.write_text("formiga: 1\ntask: NapTask\nimports: [lib.yaml]\nsteps:\n  - call: Nap\n")

        def bundle(known: Catalogue = catalogue) -> str:
            found = load_task(task, catalogue=known).task
            assert found is not None
            return found.bundle

        first = bundle()
        assert first == bundle()
        assert first != bundle(replace(catalogue, digest="other"))
        (tmp_path / "lib.yaml").write_text("formiga: 1\nsubtrees:\n  Nap:\n    steps:\n      - wait: 6 s\n")
        assert first != bundle()

    def test_a_library_beside_the_task_goes_before_the_packaged_one(self, catalogue: Catalogue, tmp_path: Path) -> None:
        (tmp_path / "lib").mkdir()
        (tmp_path / "lib" / "flying.yaml").write_text("formiga: 1\nsubtrees:\n  Nap:\n    steps:\n      - wait: 5 s\n")
        (tmp_path / "nap.yaml").write_text("formiga: 1\ntask: Nap\nimports: [lib/flying.yaml]\nsteps:\n  - call: Nap\n")
        loaded = load_task(tmp_path / "nap.yaml", catalogue=catalogue)

        assert [one.code for one in loaded.diagnostics] == ["W180"]
        assert list(loaded.sources) == [str(tmp_path / "nap.yaml"), str(tmp_path / "lib" / "flying.yaml")]

    def test_an_unreadable_file_is_a_diagnostic(self, catalogue: Catalogue, tmp_path: Path) -> None:
        (tmp_path / "latin.yaml").write_bytes(b"task: \xe9\xff")

        assert [d.code for d in load_task(tmp_path / "none.yaml", catalogue=catalogue).diagnostics] == ["E008"]
        assert [d.code for d in load_task(tmp_path / "latin.yaml", catalogue=catalogue).diagnostics] == ["E001"]
        assert [d.code for d in load_task_text("", "empty.yaml", catalogue=catalogue).diagnostics] == ["E008"]

    def test_a_task_with_warnings_only_is_loaded(self, load: Load) -> None:
        loaded = load("params:\n  spare: text\nsteps:\n  - wait: 5 s\n")

        assert [d.code for d in loaded.diagnostics] == ["W060"]
        assert loaded.task is not None


class TestNames:
    """Definite assignment: a saved name may be read where it is set on every path."""

    ASK = "ask: Ready?\n{0}of: [picker]\n{0}timeout: 5 min\n{0}save_as: reply\n"

    def codes(self, load: Load, steps: str) -> list[str]:
        return [d.code for d in load("agents:\n  picker: {type: picker}\nsteps:\n" + steps).diagnostics]

    def test_both_branches_save_it(self, load: Load) -> None:
        ask = self.ASK.format(" " * 8)
        steps = (
            f"  - if: picker.battery > 3 %\n    then:\n      - {ask}    else:\n      - {ask}"
            "  - check: reply.answer == 'yes'\n"
        )

        assert self.codes(load, steps) == []

    def test_a_branch_that_always_fails_does_not_count(self, load: Load) -> None:
        ask = self.ASK.format(" " * 8)
        steps = (
            f"  - if: picker.battery > 3 %\n    then:\n      - {ask}    else:\n      - fail: no\n"
            "  - check: reply.answer == 'yes'\n"
        )

        assert self.codes(load, steps) == []

    def test_a_fallback_child_saves_it_only_if_it_ran(self, load: Load) -> None:
        ask = self.ASK.format(" " * 8)
        steps = f"  - fallback:\n      - {ask}      - check: picker.battery > 3 %\n  - check: reply.answer == 'yes'\n"

        assert self.codes(load, steps) == ["E019"]

    def test_cleanup_sections_cannot_be_sure_of_anything(self, load: Load) -> None:
        ask = self.ASK.format(" " * 4)
        steps = f"  - {ask}  - check: reply.answer == 'yes'\nfinally:\n  - notify: ${{reply.answer}}\n"

        assert self.codes(load, steps) == ["E019"]
        assert self.codes(load, steps + "    when: is_set(reply)\n") == []

    def test_the_else_branch_of_a_negated_test_is_narrowed(self, load: Load) -> None:
        ask = self.ASK.format(" " * 4)
        steps = (
            f"  - {ask}    ignore_failure: true\n  - if: not is_set(reply)\n    then:\n      - wait: 5 s\n"
            "    else:\n      - notify: ${reply.answer}\n"
        )

        assert self.codes(load, steps) == []


def test_importing_the_loader_loads_nothing_heavy() -> None:
    heavy = ("numpy", "shapely", "pyproj", "lap", "py_trees", "zenoh")
    code = f"import sys, formiga_bt.lang.loader; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "[]"


def test_problems_of_a_library_are_shown_by_its_place_in_it(catalogue: Catalogue, tmp_path: Path) -> None:
    (tmp_path / "trees" / "lib").mkdir(parents=True)
    (tmp_path / "trees" / "lib" / "odd.yaml").write_text(
        "formiga: 1\nsubtrees:\n  Odd:\n    steps:\n      - wait: 5\n", encoding="utf-8"
    )
    text = "formiga: 1\ntask: Example\nimports: [lib/odd.yaml]\nsteps:\n  - call: Odd\n"
    loaded = load_task_text(text, "example.yaml", catalogue=catalogue, library=[tmp_path / "trees"])

    assert [str(d.mark) for d in loaded.diagnostics] == ["trees/lib/odd.yaml:5:15"]
    assert "      - wait: 5" in render(loaded.diagnostics[0], loaded.sources)


def test_calls_that_multiply_are_refused_before_anything_walks_them(load: Load) -> None:
    text = "steps:\n  - call: S0\nsubtrees:\n"
    for level in range(40):
        text += f"  S{level}:\n    steps:\n" + f"      - call: S{level + 1}\n" * 2
    found = load(text + "  S40:\n    steps:\n      - wait: 5 s\n").diagnostics

    assert [d.code for d in found] == ["E003"]
    assert "steps" in found[0].message


def test_loops_in_loops_are_followed_in_good_time(load: Load) -> None:
    text, pad = "agents: {drone: {type: hwd}, picker: {type: picker}}\nsteps:\n", "  "
    for level in range(28):
        body = (
            "- repeat: 3\n  steps:\n"
            "    - do: picker.MiniFinder\n      with: {base: '${base}'}\n      save_as: fix\n"
            "    - notify: 'Found ${fix.go_to}.'\n"
            "    - do: drone.TakeOff\n      when: not drone.airborne\n"
        )
        text += "".join(pad + line + "\n" for line in body.replace("fix", f"fix_{level}").splitlines())
        pad += "    "

    assert [d.code for d in load(text).diagnostics] == ["E031"]
