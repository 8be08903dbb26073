"""docs/news.md: its channels check on a site, its commands do as it says, its messages and headers are those that are sent."""

import json
import re
import shlex
import subprocess
from pathlib import Path
from typing import get_args

import pytest

from formiga_bt.cli.app import run
from formiga_bt.journal.outbox import Kind, NewsItem
from formiga_bt.lang.site import load_site_text
from formiga_bt.lang.site.keys import CHANNEL
from formiga_bt.lang.site.news import MOST_CHANNELS
from formiga_bt.services.news.log import KEPT
from formiga_bt.services.news.message import Message, message_of
from formiga_bt.services.news.webhook import MOST_ANSWER
from tests.unit.services.conftest import starter
from tests.unit.services.news.receiver import SECRET, receiving

PAGE = (Path(__file__).parents[2] / "docs" / "news.md").read_text(encoding="utf-8")
BASE = "formiga_site: 1\nname: meadow\nbase: {lat: 66.5, lng: 25.7}\n"


def block(kind: str) -> str:
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (text,) = [text for name, text in fences if name == kind]
    return str(text)


def test_the_channels_of_the_page_check() -> None:
    site, problems, _ = load_site_text(BASE + block("yaml"), "site.yaml", None)
    assert problems == []
    assert site is not None
    assert list(site.news) == ["control_room", "night_watch", "screens", "chief"]


def test_the_page_names_every_key_and_every_kind_of_news() -> None:
    assert [option.name for option in CHANNEL if not re.search(rf"^\| `{option.name}`", PAGE, re.MULTILINE)] == []
    assert [kind for kind in get_args(Kind) if f"`{kind}`" not in PAGE] == []
    assert f"up to {MOST_CHANNELS} channels" in PAGE
    assert f"newest {KEPT:,} wait" in PAGE
    assert f"{MOST_ANSWER // 1024} kB of an answer" in PAGE


def test_the_message_of_the_page_is_what_is_sent() -> None:
    told = json.loads(block("json"))
    data = told["data"]
    item = NewsItem(
        seq=1, n=0, at=1_795_867_200_000_000, what="alarms", kind=told["type"], severity=data["severity"], id=data["id"],
        state=data["state"], code=data["code"], task=data["task"], agent=data["agent"], text="Anna fell", person="anna",
    )  # fmt: skip
    site, _, _ = load_site_text(BASE + block("yaml"), "site.yaml", None)
    assert site is not None
    assert json.loads(message_of(item, site.news["control_room"], "meadow", "e1").body) == told
    with_names = json.loads(message_of(item, site.news["chief"], "meadow", "e1").body)["data"]
    assert set(with_names) - set(data) == {"text", "person"}


@pytest.mark.network
def test_the_commands_of_the_page_do_as_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    start = starter(tmp_path)
    lines = block("").strip().splitlines()
    install, *shell, first, test = lines
    assert install.startswith("pip install")
    with receiving() as receiver:
        for line in shell:
            subprocess.run(["bash", "-ec", line], input=f"{receiver.url}\n", text=True, check=True)
        assert re.fullmatch(r"whsec_[\w+/]{32}\n", (tmp_path / "secrets" / "room.secret").read_text())
        (tmp_path / "secrets" / "room.secret").write_text(SECRET)
        channel = "\n".join(block("yaml").splitlines()[:3]).replace("room.secret}}", "room.secret}, private: true}")
        with (tmp_path / "site.yaml").open("a", encoding="utf-8") as file:
            file.write(channel + "\n")
        with start():
            for line in (first, test):
                program, *words = shlex.split(line)
                assert program == "formiga"
                assert run(words) == 0, line
        assert [body["type"] for _, body in receiver.got] == ["test"]


def test_the_python_of_the_page_knows_a_forgery() -> None:
    from datetime import UTC, datetime

    from standardwebhooks import Webhook, WebhookVerificationError

    now, message = datetime.now(UTC), Message("e1.1", b'{"type":"test"}', "")
    headers = {
        "webhook-id": message.id, "webhook-timestamp": str(int(now.timestamp())),
        "webhook-signature": Webhook(SECRET).sign(message.id, now, message.body.decode()),
    }  # fmt: skip
    names = {"secret": SECRET, "body": message.body, "headers": headers}
    exec(block("python"), names)
    assert names["told"] == {"type": "test"}
    with pytest.raises(WebhookVerificationError):
        exec(block("python"), {**names, "body": b'{"type":"forged"}'})
