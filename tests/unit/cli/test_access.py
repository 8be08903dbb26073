"""`formiga access`: a person's secret is asked for twice, or comes from a file or the environment, and is shown nowhere."""

import json
from pathlib import Path

import pytest

from formiga_bt.base.errors import UnusableFile
from formiga_bt.base.person_secrets import LEAST_N, SECRETS, hashed, read_secrets, write_secret
from formiga_bt.cli import proving
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from tests.e2e.terminal import at_terminal
from tests.golden import Wording

Capture = pytest.CaptureFixture[str]
Patch = pytest.MonkeyPatch
FIRST, SECOND = "first of them all", "second of them all"
REAL = "people: {watchers: [watcher_1], approvers: [ann, bob]}\npilots: [{id: pia, max_airborne: 1}]\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: Patch) -> Path:
    """Return the runtime folder of a site in mode real; the site's is the current one, and hashes are cheap."""
    text = start("site").replace("@site", "meadow").replace("mode: simulation", "mode: real")
    (tmp_path / "site.yaml").write_text(text.replace("people: {watchers: [watcher_1]}\n", REAL), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("formiga_bt.cli.orders.access.hashed", lambda secret: hashed(secret, (LEAST_N, 8, 1)))
    return tmp_path / ".formiga" / "meadow"


def fits(folder: Path, person: str, secret: str) -> bool:
    return read_secrets(folder)[person].fits(secret)


def test_it_is_typed_twice_and_the_present_one_before(tmp_path: Path, folder: Path, wording: Wording) -> None:
    once = [("once more: $", FIRST)]
    words = ("access", "secret", "ann")
    code, first = at_terminal(tmp_path, *words, until="New secret of ann: $", types=lambda _: FIRST, then=once)
    assert (code, fits(folder, "ann", FIRST)) == (0, True), first
    assert (folder / SECRETS).stat().st_mode & 0o777 == 0o600
    assert folder.stat().st_mode & 0o777 == folder.parent.stat().st_mode & 0o777 == 0o700

    then = [("New secret of ann: $", SECOND), ("once more: $", SECOND)]
    code, wrong = at_terminal(tmp_path, *words, until="Present secret of ann: $", types=lambda _: SECOND)
    assert (code, fits(folder, "ann", FIRST)) == (1, True)
    wording(wrong)
    code, right = at_terminal(tmp_path, *words, until="Present secret of ann: $", types=lambda _: FIRST, then=then)
    assert (code, fits(folder, "ann", SECOND)) == (0, True), right
    code, other = at_terminal(
        tmp_path,
        *words,
        "--reset",
        until="New secret of ann: $",
        types=lambda _: FIRST,
        then=[("once more: $", SECOND)],
    )
    assert (code, fits(folder, "ann", SECOND)) == (1, True)
    for shown in (first, wrong, right, other):
        assert FIRST not in shown
        assert SECOND not in shown


def test_scripts_name_files_that_nobody_else_reads(
    folder: Path, tmp_path: Path, monkeypatch: Patch, capfd: Capture, wording: Wording
) -> None:
    assert run(["access", "secret", "pia"]) == 1
    wording(capfd.readouterr().err)
    file = tmp_path / "new"
    file.write_text(FIRST + "\n")
    file.chmod(0o644)
    monkeypatch.setenv("FORMIGA_NEW_SECRET_FILE", str(file))
    assert run(["access", "secret", "pia"]) == 2
    wording(capfd.readouterr().err)
    file.chmod(0o600)
    assert run(["access", "secret", "pia"]) == 0
    assert fits(folder, "pia", FIRST)

    monkeypatch.setenv("FORMIGA_NEW_SECRET", SECOND)
    assert run(["access", "secret", "pia"]) == 1, "the present one was not said"
    monkeypatch.setenv("FORMIGA_SECRET_FILE", str(file))
    assert run(["access", "secret", "pia"]) == 0
    assert fits(folder, "pia", SECOND)
    monkeypatch.setenv("FORMIGA_NEW_SECRET", "too short")
    assert run(["access", "secret", "pia", "--reset"]) == 1
    assert fits(folder, "pia", SECOND)
    said = capfd.readouterr()
    for secret in (FIRST, SECOND, "too short"):
        assert secret not in said.out + said.err


def test_only_people_of_the_site_file_have_one(
    monkeypatch: Patch, capfd: Capture, folder: Path, wording: Wording
) -> None:
    monkeypatch.setenv("FORMIGA_NEW_SECRET", FIRST)
    assert run(["access", "secret", "eve"]) == 1
    assert (
        run(["access", "secret"])
        == run(["access", "list", "ann"])
        == run(["access", "secret", "x", "--site", "n.yaml"])
        == 2
    )
    said = capfd.readouterr().err
    wording(said)
    assert run(["access", "secret", "ann", FIRST]) == 2, "an argument is in the list of processes"
    assert not folder.exists()
    capfd.readouterr()

    assert run(["access", "secret", "bob"]) == 0
    assert run(["access", "list", "--json"]) == 0
    found = json.loads(capfd.readouterr().out.partition("\n")[2])
    assert {one["person"]: one["secret"] for one in found} == {
        "watcher_1": False,
        "ann": False,
        "bob": True,
        "pia": False,
    }
    assert run(["access", "list"]) == 0
    rows = [row.split() for row in capfd.readouterr().out.splitlines()]
    assert ["pia", "pilots", "none"] in rows
    assert ["bob", "approvers", "set"] in rows


def test_a_file_that_cannot_be_used_is_set_aside_by_its_owner_only(
    folder: Path, tmp_path: Path, monkeypatch: Patch, capfd: Capture, wording: Wording
) -> None:
    monkeypatch.setenv("FORMIGA_NEW_SECRET", FIRST)
    assert run(["access", "secret", "ann"]) == 0
    (folder / SECRETS).write_text("{")
    assert run(["access", "secret", "bob"]) == run(["access", "list"]) == 1
    wording(capfd.readouterr().err)
    assert (folder / SECRETS).read_text() == "{"
    assert run(["access", "secret", "bob", "--reset"]) == 0
    wording(capfd.readouterr().out)
    assert list(read_secrets(folder)) == ["bob"]
    assert (folder / "aside-1" / SECRETS).read_text() == "{"


def test_a_secret_goes_as_a_header_that_any_letter_survives(monkeypatch: Patch, tmp_path: Path) -> None:
    assert proving.as_header("") == {}
    monkeypatch.setenv("FORMIGA_SECRET", 'ä %"\\: x')
    assert proving.secret_header("ann") == {"Formiga-Secret": "%C3%A4%20%25%22%5C%3A%20x"}
    monkeypatch.delenv("FORMIGA_SECRET")
    assert proving.secret_header("ann") == {}, "nobody is there to ask"
    monkeypatch.setenv("FORMIGA_SECRET_FILE", str(tmp_path / "nothing"))
    with pytest.raises(UnusableFile, match="cannot be read"):
        proving.own_secret("ann")


def test_a_word_that_was_set_by_somebody_else_meanwhile_is_not_replaced(
    folder: Path, monkeypatch: Patch, capfd: Capture, wording: Wording
) -> None:
    def meanwhile(_: str) -> str:
        write_secret(folder, "ann", hashed(SECOND, (LEAST_N, 8, 1)))
        return FIRST

    monkeypatch.setattr("formiga_bt.cli.orders.access.new_secret", meanwhile)
    assert run(["access", "secret", "ann"]) == 1
    wording(capfd.readouterr().err)
    assert fits(folder, "ann", SECOND)
