"""New and changed tasks for an engine that runs: what is checked, kept, served, refused, and served again."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace

from formiga_bt.engine.engine import Engine
from formiga_bt.engine.kernel.inputs import Input, Submit
from formiga_bt.engine.kernel.library import Bundles
from formiga_bt.engine.kernel.replies import Accepted, Refusal, Reply
from formiga_bt.services.kept.bundles import BundleStore
from formiga_bt.services.loading import Loading, read_stored, served_again
from formiga_bt.services.refused import Refused
from formiga_bt.services.view import EngineView
from formiga_bt.show.facts import TaskLoaded
from tests.golden import Wording
from tests.unit.engine.yard import CART, task, yard

SITE, CATALOGUE = yard()
FILE = "trees/try.yaml"
ONE = f"formiga: 1\ntask: Try\n{CART}steps: [{{do: cart.Rise}}, {{do: cart.Park}}]\n"
TWO = ONE.replace("{do: cart.Rise}", "{do: cart.Rise}, {do: cart.Move}")
LIB = "formiga: 1\nsubtrees:\n  Go:\n    params: {one: agent}\n    steps: [{do: one.Rise}, {do: one.Park}]\n"
CALLS = f"formiga: 1\ntask: Try\nimports: [lib/go.yaml]\n{CART}steps: [{{call: Go, with: {{one: '${{cart}}'}}}}]\n"


class Rig:
    """An engine without a driver, and what loads into it."""

    def __init__(self, runtime: Path) -> None:
        self.bundles = Bundles([task(f"{CART}steps: [{{do: cart.Rise}}, {{do: cart.Home}}]", "First")])
        self.engine = Engine(SITE, CATALOGUE, self.bundles)
        self.view = EngineView(1)
        self.view.start()
        self.store = BundleStore(runtime)
        self.loading = Loading(self.ask, self.view, SITE, CATALOGUE, self.bundles, self.store)
        self.given: list[Input] = []

    def ask(self, given: Input) -> Reply | None:
        self.given.append(given)
        done = self.engine.handle(1, given)
        self.view.feed_step(done)
        self.view.catch_up()
        if isinstance(done.reply, Refusal):
            raise Refused(done.reply.code, done.reply.text)
        return done.reply

    def load(self, text: str = ONE, file: str = FILE, **more: str) -> TaskLoaded:
        return self.loading.load(file, {file: text, **more}, "eve", 1_800_000_000_000)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    made = Rig(tmp_path)
    yield made
    made.view.stop()


def test_a_new_task_is_kept_and_served(rig: Rig, wording: Wording) -> None:
    said = rig.load()

    assert (said.task, said.what, said.version) == ("Try", "new", 1)
    wording(said.text)
    (stored,) = rig.store.served().values()
    assert (stored.text(), stored.bundle.by, stored.bundle.file) == (ONE, "eve", FILE)
    assert rig.ask(Submit("Try", bundle=said.bundle)) == Accepted("Try-1")
    wording([event.text for event in rig.view.feed.after(0)[0] if event.type == "library"])


def test_a_changed_one_is_a_new_version_and_open_tasks_are_named(rig: Rig, wording: Wording) -> None:
    first = rig.load()
    rig.ask(Submit("Try"))
    said = rig.load(TWO)

    assert (said.what, said.version) == ("changed", 2)
    wording(said.text)
    (_, shown) = rig.loading.library().tasks
    assert (shown.task, shown.version, shown.bundle) == ("Try", 2, said.bundle)
    assert [(one.version, one.bundle, one.tasks) for one in shown.versions] == [
        (1, first.bundle, ("Try-1",)),
        (2, said.bundle, ()),
    ]


def test_the_same_bundle_changes_nothing(rig: Rig) -> None:
    rig.load()
    rig.given.clear()

    assert (rig.load().what, rig.given) == ("same", [])
    assert rig.load(file="trees/other.yaml").what == "same"  # the bundle is of texts, not of names
    assert len([one for one in rig.store.path.iterdir() if one.name != "served.json"]) == 1


def test_an_older_one_again_is_a_newer_version(rig: Rig) -> None:
    first = rig.load()
    rig.load(TWO)
    again = rig.load()
    assert (again.bundle, again.version) == (first.bundle, 3)


def test_imports_come_along_under_their_paths(rig: Rig) -> None:
    said = rig.load(CALLS, **{"trees/lib/go.yaml": LIB})
    other = rig.load(CALLS, **{"trees/lib/go.yaml": LIB.replace("{do: one.Park}", "{do: one.Home}")})
    assert (said.what, other.what) == ("new", "changed")
    assert said.bundle != other.bundle


def test_what_the_engine_finds_wrong_is_told_and_nothing_is_kept(rig: Rig, wording: Wording) -> None:
    with pytest.raises(Refused) as told:
        rig.load(ONE.replace("cart.Park", "cart.Fly"))

    assert told.value.code == "bad_task"
    wording(told.value.text)
    assert told.value.problems[0].startswith("trees/try.yaml:4:")
    assert list(rig.store.path.iterdir()) == []
    assert rig.given == []


def test_an_import_that_was_not_sent_is_missed_though_it_lies_on_the_engines_disk(
    rig: Rig, tmp_path: Path, wording: Wording
) -> None:
    (tmp_path / "secret.yaml").write_text("password: 1\n")
    with pytest.raises(Refused) as told:
        rig.load(CALLS.replace("lib/go.yaml", "../../../secret.yaml"))
    assert "E008" in told.value.problems[0]
    assert "password" not in told.value.problems[0]
    assert not any("password" in text for text in told.value.problems)
    with pytest.raises(Refused) as refused:
        rig.load(CALLS)
    wording(refused.value)


def test_what_a_task_requests_is_what_is_served(rig: Rig) -> None:
    asks = "formiga: 1\ntask: Asks\nsteps: [{request: Try}]\n"
    with pytest.raises(Refused) as told:
        rig.load(asks)
    assert "Try" in told.value.problems[0]
    rig.load()
    assert rig.load(asks, "trees/asks.yaml").what == "new"


@pytest.mark.parametrize(
    "name",
    ["../try.yaml", "/etc/try.yaml", ".hidden/try.yaml", "trees/../try.yaml", "try.txt", "a//try.yaml", "a\\b.yaml",
     "./try.yaml", "a/" * 10 + "try.yaml", "x\ny.yaml", "x" * 200 + ".yaml"],
)  # fmt: skip
def test_a_path_leads_nowhere_else(rig: Rig, name: str, wording: Wording) -> None:
    with pytest.raises(Refused) as told:
        rig.load(ONE, name)
    wording(told.value)
    assert told.value.code == "bad_bundle"
    assert not rig.store.path.exists()


def test_a_bundle_has_its_task_and_not_too_many_files(rig: Rig, wording: Wording) -> None:
    with pytest.raises(Refused) as refused:
        rig.loading.load(FILE, {"x.yaml": ""}, "", 0)
    wording(refused.value)
    with pytest.raises(Refused) as refused:
        rig.load(**{f"{n}.yaml": "" for n in range(100)})
    wording(refused.value)


def test_an_engine_that_ends_takes_nothing(rig: Rig, wording: Wording) -> None:
    rig.loading.closed_for = lambda: "draining"
    with pytest.raises(Refused) as refused:
        rig.load()
    wording(refused.value)


def test_what_was_loaded_is_served_again_unless_a_file_has_the_name(rig: Rig, wording: Wording) -> None:
    rig.load()
    last = rig.load(TWO)

    found, told = served_again(rig.store, {}, SITE, CATALOGUE)
    assert [(name, one.bundle) for name, one in found.items()] == [("Try", last.bundle)]
    wording(told[0])

    mine = task(ONE.partition("task: Try\n")[2])
    found, told = served_again(rig.store, {"Try": mine}, SITE, CATALOGUE)
    assert found == {}
    wording(told[0])
    assert served_again(rig.store, {}, SITE, CATALOGUE) == ({}, [])  # and it is forgotten


def test_one_that_does_not_fit_any_more_is_told_of(rig: Rig, wording: Wording) -> None:
    rig.load()
    path = rig.store.served()["Try"].path
    path.write_text(path.read_text().replace("Park", "Fly"))
    found, (told,) = served_again(rig.store, {}, SITE, CATALOGUE)
    assert found == {}
    wording(told)


def test_a_bundle_half_written_is_none_and_is_written_anew(rig: Rig) -> None:
    rig.load()
    path = rig.store.served()["Try"].path
    path.write_text(path.read_text()[:-20])
    assert rig.store.served() == {}
    assert sorted(rig.store.unusable) == ["Try", path.name]
    rig.load(TWO)
    assert rig.load().version == 3
    assert rig.store.served()["Try"].text() == ONE


def test_a_library_of_the_site_comes_along_and_not_from_the_engines_disk(tmp_path: Path) -> None:
    beside = Path(SITE.file).parent
    store = BundleStore(tmp_path)
    catalogue = replace(CATALOGUE, libraries=(beside / "own",))
    calls = CALLS.replace("lib/go.yaml", "go.yaml")
    stored, _ = store.keep(FILE, {FILE: calls, "own/go.yaml": LIB}, by="", unix_millis=0)
    alone, _ = store.keep(FILE, {FILE: calls}, by="", unix_millis=0)

    assert read_stored(stored, SITE, catalogue, {}).diagnostics == []
    assert read_stored(alone, SITE, catalogue, {}).task is None
