"""`formiga approve` and `formiga log export` without an engine: what a person is shown, and what is kept."""

import json
import os
import shutil
from pathlib import Path

import pytest

from formiga_bt.base.durable import private_folder
from formiga_bt.base.person_secrets import LEAST_N, hashed, write_secret
from formiga_bt.base.site_folder import FLIGHTS, append_line
from formiga_bt.cli.app import run
from formiga_bt.cli.author.starts import start
from formiga_bt.services.crew import standing
from tests.e2e.terminal import at_terminal
from tests.golden import Wording

REAL = "people: {watchers: [watcher_1], approvers: [ann, bob]}\npilots: [{id: pia, max_airborne: 1}]\n"
SECRET = "the same of both"
ASKS = r"Type the first 8 characters of the digest.*: $"


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a site in mode real; it is the current one."""
    text = start("site").replace("@site", "meadow").replace("mode: simulation", "mode: real")
    text = text.replace("people: {watchers: [watcher_1]}\n", REAL)
    (tmp_path / "site.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "trees").mkdir()
    (tmp_path / "trees" / "hello.yaml").write_text(start("hello"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    private_folder(tmp_path / ".formiga" / "meadow")
    for person in ("ann", "bob"):
        write_secret(tmp_path / ".formiga" / "meadow", person, hashed(SECRET, (LEAST_N, 8, 1)))
    monkeypatch.setenv("FORMIGA_SECRET", SECRET)
    return tmp_path


def digest_in(shown: str) -> str:
    return shown.split("digest  ")[1].split()[0]


def test_a_person_reads_what_it_may_do_and_types_the_digest(site: Path, wording: Wording) -> None:
    code, shown = at_terminal(
        site, "approve", "Hello", "--by", "ann", until=ASKS, types=lambda shown: digest_in(shown)[:8]
    )
    digest = digest_in(shown)

    assert code == 0, shown
    wording(shown)
    assert [(g.task, g.by, g.digest) for g in standing(site / ".formiga/meadow")] == [("Hello", "ann", digest)]
    assert "  made of\n    trees/hello.yaml\n" in shown
    assert "\n    site.yaml\n" in shown


@pytest.mark.parametrize(
    "said",
    ["", "not it"],
)
def test_without_an_engine_the_secret_is_asked_for_too(
    site: Path, monkeypatch: pytest.MonkeyPatch, said: str, wording: Wording
) -> None:
    monkeypatch.delenv("FORMIGA_SECRET")
    code, shown = at_terminal(
        site, "approve", "Hello", "--by", "ann", until=ASKS, types=lambda shown: digest_in(shown)[:8],
        then=[("Secret of ann: $", said)],
    )  # fmt: skip
    assert code == 1
    wording(shown)
    assert standing(site / ".formiga/meadow") == []


def test_nobody_takes_an_approval_back_for_another(
    site: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("FORMIGA_SECRET", "not the right one")
    assert run(["approve", "Hello", "--by", "bob", "--revoke"]) == 1
    monkeypatch.delenv("FORMIGA_SECRET")
    assert run(["approve", "Hello", "--by", "bob", "--revoke"]) == 1
    said = capfd.readouterr().err
    wording(said)


def test_another_line_than_the_digest_approves_nothing(site: Path, wording: Wording) -> None:
    code, shown = at_terminal(site, "approve", "Hello", "--by", "ann", until=ASKS, types=lambda _: "yes")
    assert code == 1
    wording(shown)
    assert standing(site / ".formiga/meadow") == []


def test_no_program_approves(site: Path, capfd: pytest.CaptureFixture[str], wording: Wording) -> None:
    assert run(["approve", "PickUp", "--by", "ann"]) == 1
    said = capfd.readouterr()
    wording(said.err, said.out)
    assert standing(site / ".formiga/meadow") == []


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["approve", "Hello", "--by", "rita"], 1),
        (["approve", "Nothing", "--by", "ann"], 2),
        (["approve", "Hello"], 2),
        (["approve", "Hello", "--by", "ann", "--revoke"], 1),
        (["approve", "--list", "--site", "none.yaml"], 2),
        (["log", "export", "--since", "tomorrow"], 2),
        (["log", "import"], 2),
        (["duty"], 2),
        (["duty", "pia", "perhaps"], 2),
    ],
)
def test_what_cannot_be_done_says_why(
    site: Path, capfd: pytest.CaptureFixture[str], words: list[str], code: int, wording: Wording
) -> None:
    assert run(words) == code
    wording(capfd.readouterr().err)


def test_a_simulation_needs_no_approval(site: Path, capfd: pytest.CaptureFixture[str], wording: Wording) -> None:
    file = site / "site.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("mode: real", "mode: simulation"), encoding="utf-8")
    assert run(["approve", "Hello", "--by", "ann"]) == 1
    wording(capfd.readouterr().err)


def test_before_it_is_approved_a_task_can_be_tried_in_a_dry_run(site: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["dryrun", "trees/hello.yaml", "--site", "site.yaml"]) == 0
    assert "Hello-1 SUCCEEDED" in capfd.readouterr().out


def test_a_changed_letter_voids_it_and_revoking_needs_no_terminal(
    site: Path, capfd: pytest.CaptureFixture[str], wording: Wording
) -> None:
    def types(shown: str) -> str:
        return digest_in(shown)[:8]

    _, first = at_terminal(site, "approve", "trees/hello.yaml", "--by", "ann", until=ASKS, types=types)
    file = site / "trees" / "hello.yaml"
    before = file.read_text(encoding="utf-8")
    file.write_text(before.replace("wait: 10 s", "wait: 11 s"), encoding="utf-8")
    _, second = at_terminal(site, "approve", "trees/hello.yaml", "--by", "bob", until=ASKS, types=types)
    assert digest_in(first) != digest_in(second)

    file.write_text(before, encoding="utf-8")
    assert run(["approve", "Hello", "--by", "bob", "--revoke"]) == 0
    assert run(["approve", "--list"]) == 0
    said = capfd.readouterr().out
    wording(said.splitlines()[0])
    assert f"Hello ({digest_in(first)[:8]})" in said
    assert [line.split()[:3] for line in said.splitlines()[-1:]] == [["Hello", digest_in(second)[:8], "bob"]]


def test_the_flight_log_goes_out_without_an_engine(
    site: Path, capfd: pytest.CaptureFixture[str], wording: Wording
) -> None:
    shutil.rmtree(site / ".formiga")
    assert run(["log", "export"]) == 1
    wording(capfd.readouterr().err)
    flight = {
        "agent": "lwd_1",
        "type": "lwd",
        "mode": "real",
        "take_off_utc": "2026-07-01T09:00:00.000Z",
        "pilot": "pia",
    }
    append_line(site / ".formiga/meadow" / FLIGHTS, flight)

    assert run(["log", "export"]) == 0
    head, row = capfd.readouterr().out.splitlines()
    assert head.startswith("agent,type,mode,pilot,task,")
    assert row.startswith("lwd_1,lwd,real,pia,")
    assert run(["log", "export", "--format", "json", "--since", "2026-07-02"]) == 0
    assert json.loads(capfd.readouterr().out) == []
    assert run(["log", "export", "--format", "json", "-o", "out.json", "--site", "site.yaml"]) == 0
    wording(capfd.readouterr().err)
    assert json.loads((site / "out.json").read_text())[0]["pilot"] == "pia"


def test_several_sites_are_told_apart_by_name(
    site: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    for name in ("meadow", "marsh"):
        append_line(
            site / ".formiga" / name / FLIGHTS,
            {"agent": name, "type": "lwd", "mode": "real", "take_off_utc": "2026-07-01T09:00:00Z"},
        )
    assert run(["log", "export"]) == 1
    wording(capfd.readouterr().err)
    monkeypatch.setitem(os.environ, "FORMIGA_SITE", "marsh")
    assert run(["log", "export"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("marsh,")
