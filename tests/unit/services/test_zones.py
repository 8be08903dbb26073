"""Regions closed over HTTP and by the commands of the page: said, listed, refused."""

import re
import shlex
from pathlib import Path

import pytest

from formiga_bt.cli.app import run
from tests.unit.services.conftest import Service

PAGE = Path(__file__).parents[3] / "docs" / "operating.md"

pytestmark = pytest.mark.network


def place(service: Service) -> str:
    return next(iter(service.host.site.places))


def test_it_is_closed_listed_and_opened(service: Service) -> None:
    name = place(service)
    service.post(f"/v1/zones/{name}/close", {"reason": "sheep", "by": "eve"})
    (found,) = service.get("/v1/zones")["zones"]
    assert (found["name"], found["reason"], found["by"]) == (name, "sheep", "eve")
    service.post(f"/v1/zones/{name}/open", {"by": "eve"})
    assert service.get("/v1/zones")["zones"] == []
    no = service.refused("POST", f"/v1/zones/{name}/open", {})
    assert (no["code"], no["help"]) == ("not_closed", "formiga zone list shows what is closed")
    assert service.refused("POST", "/v1/zones/nowhere/close", {"reason": "x"})["status"] == 404
    assert service.refused("POST", f"/v1/zones/{name}/close", {"reason": ""})["status"] == 422


def test_the_commands_of_the_page_do_as_it_says(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    section = re.search(r"### Closed regions\n.*?```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert section is not None
    name = place(service)
    close, listed, back = [
        [word.replace("meadow", name) for word in shlex.split(line)[1:]] for line in section[1].splitlines()
    ]
    monkeypatch.chdir(tmp_path)
    assert run([*close, "--by", "eve"]) == 0
    capsys.readouterr()
    assert run(listed) == 0
    (row,) = capsys.readouterr().out.splitlines()[1:]
    assert row.split() == [name, "eve", "sheep"]
    assert run(back) == 0
    assert run(back) == 1
    assert run(["zone", "close", name]) == 2
