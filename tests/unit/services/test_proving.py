"""Whose secret lets a word pass: wrong ones are counted on a virtual clock, few are compared at once, no engine waits."""

import json
import logging
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from formiga_bt.base.clock import SECOND
from formiga_bt.base.durable import write_durably
from formiga_bt.base.person_secrets import SECRETS, Hashed, write_secret
from formiga_bt.lang.model import Site
from formiga_bt.services.http.proving import AT_ONCE, MOST_WAITING, MOST_WRONG, Proofs, people_of
from formiga_bt.services.kept.journaling import JournalAt
from formiga_bt.services.refused import Refused
from tests.golden import Wording
from tests.unit.services.conftest import Service, Start, cheap, make_real, secret_of
from tests.unit.services.test_crew import body

SITE = Site(
    name="north", lat=66.5, lng=25.7, mode="real", people={"approvers": ("ann", "bob"), "watchers": ("wim",)}, pilots={"pia": 1}
)  # fmt: skip
RIGHT = "right"


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 7 * SECOND

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def proofs(tmp_path: Path, clock: Clock) -> Proofs:
    for person in ("ann", "pia"):
        write_secret(tmp_path, person, cheap(person * 6))
    return Proofs(tmp_path, SITE, clock, lambda _, said: said == RIGHT)


def code(proofs: Proofs, person: str, secret: str) -> str:
    found: list[Refused] = []
    try:
        proofs.check(person, secret)
    except Refused as refused:
        found.append(refused)
    for one in found:
        assert one.help
        assert not secret or secret not in f"{one} {one.help}"
    return found[0].code if found else ""


def test_who_may_have_a_secret() -> None:
    assert people_of(SITE) == {"ann": ["approvers"], "bob": ["approvers"], "wim": ["watchers"], "pia": ["pilots"]}


def test_right_wrong_missing_and_of_strangers(proofs: Proofs) -> None:
    assert [code(proofs, "ann", said) for said in (RIGHT, "false", "")] == ["", "secret_wrong", "secret_missing"]
    assert code(proofs, "bob", RIGHT) == "secret_missing", "none is set"
    assert code(proofs, "eve", RIGHT) == code(proofs, "", RIGHT) == "secret_missing"
    assert proofs.without() == ["bob"]


def test_a_simulation_asks_nobody(tmp_path: Path, clock: Clock) -> None:
    proofs = Proofs(tmp_path, replace(SITE, mode="simulation"), clock)
    (tmp_path / SECRETS).write_text("broken")
    assert code(proofs, "eve", "") == ""
    assert list(proofs.troubles()) == []
    assert proofs.without() == []


def test_after_five_wrong_ones_in_a_minute_nothing_is_compared(proofs: Proofs, clock: Clock) -> None:
    for _ in range(MOST_WRONG):
        assert code(proofs, "ann", "false") == "secret_wrong"
        clock.now += SECOND
    assert code(proofs, "ann", RIGHT) == code(proofs, "ann", "false") == "secret_wait"
    assert code(proofs, "pia", RIGHT) == "", "of somebody else they do not count"
    assert [(one.code, one.subject) for one in proofs.troubles()] == [("secret_guessed", "ann")]
    clock.now = 67 * SECOND - 1
    assert code(proofs, "ann", RIGHT) == "secret_wait"
    clock.now += 1
    assert code(proofs, "ann", "false") == "secret_wrong"
    assert code(proofs, "ann", RIGHT) == "secret_wait"
    clock.now += SECOND
    assert [code(proofs, "ann", RIGHT) for _ in range(20)] == [""] * 20, "right ones do not count"
    assert list(proofs.troubles()) == []


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    event = threading.Event()
    yield event
    event.set()


def test_two_are_compared_at_once_some_wait_and_more_are_refused(
    tmp_path: Path, clock: Clock, gate: threading.Event
) -> None:
    write_secret(tmp_path, "ann", cheap("ann" * 6))
    write_secret(tmp_path, "pia", cheap("pia" * 6))
    inside: list[int] = []
    most: list[int] = []

    def fits(_: Hashed, said: str) -> bool:
        inside.append(1)
        most.append(len(inside))
        gate.wait(20)
        inside.pop()
        return said == RIGHT

    proofs = Proofs(tmp_path, SITE, clock, fits)
    codes: list[str] = []
    people = ["ann", "pia"] * ((AT_ONCE + MOST_WAITING) // 2)
    threads = [threading.Thread(target=lambda one=one: codes.append(code(proofs, one, RIGHT))) for one in people]
    for thread in threads:
        thread.start()
    while proofs._inside < AT_ONCE + MOST_WAITING:
        threading.Event().wait(0.001)
    assert code(proofs, "ann", RIGHT) == "busy"
    gate.set()
    for thread in threads:
        thread.join(20)
    assert codes == [""] * len(people)
    assert max(most) == AT_ONCE
    assert code(proofs, "ann", RIGHT) == ""


def test_many_tries_at_once_are_no_more_than_one_after_the_other(
    tmp_path: Path, clock: Clock, gate: threading.Event
) -> None:
    write_secret(tmp_path, "ann", cheap("ann" * 6))
    proofs = Proofs(tmp_path, SITE, clock, lambda *_: bool(gate.wait(20)) and False)
    codes: list[str] = []
    threads = [threading.Thread(target=lambda: codes.append(code(proofs, "ann", "false"))) for _ in range(8)]
    for thread in threads:
        thread.start()
    gate.set()
    for thread in threads:
        thread.join(20)
    assert sorted(codes) == ["secret_wait"] * (8 - MOST_WRONG) + ["secret_wrong"] * MOST_WRONG


# -- a whole service ---------------------------------------------------------------------------------------------------
@pytest.fixture
def real(tmp_path: Path, start: Start) -> Start:
    make_real(tmp_path)
    return start


def approve(service: Service, **headers: str) -> Any:
    return service.call("POST", "/v1/approvals", body(service), headers)


def refusal(answer: tuple[int, Any]) -> tuple[int, str]:
    assert answer[1]["help"]
    return answer[0], answer[1]["code"]


@pytest.mark.network
def test_nobody_approves_or_goes_on_duty_without_a_secret_of_their_own(real: Start, tmp_path: Path) -> None:
    """By HTTP any program could say `by: ann`, and type the digest that it had just been told."""
    with real() as service:
        for said, known in (("", "secret_missing"), ("x" * 20, "secret_wrong"), (secret_of("bob"), "secret_wrong")):
            word = {"Formiga-Secret": said}
            assert refusal(approve(service, **word)) == (403, known)
            assert refusal(service.call("POST", "/v1/pilots/pia/duty", {"on": True}, word)) == (403, known)
        assert not service.get("/v1/pilots")["pilots"][0]["since"]
        assert not any(one["approval"] for one in service.get("/v1/approvals")["tasks"])

        assert approve(service)[0] == 200
        assert (
            refusal(service.call("POST", "/v1/approvals", body(service, revoke=True), {"Formiga-Secret": ""}))[0] == 403
        )
        assert service.call("POST", "/v1/pilots/pia/duty", {"on": True, "by": "eve"})[0] == 200
        assert refusal(service.call("POST", "/v1/pilots/pia/duty", {"on": False}, {"Formiga-Secret": ""}))[0] == 403
        assert service.get("/v1/pilots")["pilots"][0]["since"]
        paths = service.get("/v1/openapi.json")["paths"]
        for path in ("/v1/approvals", "/v1/pilots/{pilot}/duty"):
            assert "Formiga-Secret" in [one["name"] for one in paths[path]["post"]["parameters"]]


@pytest.mark.network
def test_a_secret_that_is_set_or_lost_while_the_engine_runs_counts_at_once(
    real: Start, tmp_path: Path, wording: Wording
) -> None:
    folder = tmp_path / ".formiga/meadow"
    kept = (folder / SECRETS).read_text()
    with real() as service:
        (folder / SECRETS).unlink()
        status, said = approve(service)
        assert (status, said["code"]) == (403, "secret_missing")
        wording(said["help"])
        write_durably(folder / SECRETS, kept)
        assert approve(service)[0] == 200
        write_secret(folder, "ann", cheap("another one of hers"))
        assert refusal(approve(service)) == (403, "secret_wrong")

        write_durably(folder / SECRETS, kept[:-20])
        assert refusal(approve(service)) == (409, "secrets_unusable")
        service.host.house.look()
        assert [(one["code"], one["subject"]) for one in service.get("/v1/health")["house"]] == [
            ("secrets_unusable", SECRETS)
        ]
        write_durably(folder / SECRETS, kept)
        assert approve(service)[0] == 200
    write_durably(folder / SECRETS, kept[:-20])
    with real() as service:
        assert refusal(approve(service)) == (403, "secret_missing")
        wording(service.host.set_aside[0])


@pytest.mark.network
def test_a_simulation_is_as_it_was(start: Start) -> None:
    with start() as service:
        assert "Authorization" not in service.headers
        status, said = service.call("POST", "/v1/approvals", body(service), {"Formiga-Secret": ""})
        assert (status, said["code"]) == (403, "not_approver")


@pytest.mark.network
def test_a_secret_is_hashed_in_no_thread_that_others_wait_for_and_is_written_nowhere(
    real: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    import hashlib

    seen: list[str] = []
    scrypt = hashlib.scrypt

    def watched(*given: Any, **more: Any) -> bytes:
        seen.append(threading.current_thread().name)
        return scrypt(*given, **more)

    monkeypatch.setattr(hashlib, "scrypt", watched)
    caplog.set_level(logging.DEBUG)
    wrong = "not-the-right-one"
    said = []
    with real(journal=JournalAt(durability="normal")) as service:
        said.append(approve(service))
        said.append(approve(service, **{"Formiga-Secret": wrong}))
        said.append(service.call("POST", "/v1/approvals", {"task": 7, "by": "ann"}, {"Formiga-Secret": wrong}))
        said.append(service.call("POST", "/v1/approvals", body(service), {"Formiga-Secret": wrong * 400}))
        said.append(service.get("/v1/health"))
        said.append(service.call("POST", "/v1/pilots/pia/duty", {"on": True}))
        said += [(one.text, one.data) for one in service.host.feed.after(0)[0]]
    assert len(seen) == 3
    assert not [name for name in seen if name.startswith(("formiga", "Main"))], (
        "doors, driver and house have such names"
    )
    texts = [caplog.text, json.dumps(said, default=str)]
    texts += [path.read_bytes().decode("latin-1") for path in tmp_path.rglob("*") if path.is_file()]
    for secret in (wrong, secret_of("ann"), "ann%27s%20own", secret_of("pia")):
        assert not [text for text in texts if secret in text or secret.encode().decode("latin-1") in text]
