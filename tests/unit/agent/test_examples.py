"""The examples and the page about agents of one's own: they run as they stand there."""

import importlib.util
import json
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from formiga_bt.agent import Agent, Place
from formiga_bt.agent.catalogue import catalogue_of
from formiga_bt.agent.testing import AgentBench
from formiga_bt.cli.app import run
from formiga_bt.engine.agents.announced import refusals
from formiga_bt.lang.loader import load_catalogue

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "agent.md").read_text(encoding="utf-8")


def load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def agent_in(module: ModuleType) -> type[Agent]:
    (found,) = [
        one for one in vars(module).values() if isinstance(one, type) and issubclass(one, Agent) and one is not Agent
    ]
    return found


class _Answer(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        body = json.dumps({"wind_m_s": 3, "rain": False}).encode() if "east=5" in self.path else b"no weather"
        self.send_response(200)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None: ...


@pytest.fixture
def service() -> Iterator[str]:
    server = HTTPServer(("127.0.0.1", 0), _Answer)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/forecast"
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.mark.network
def test_a_service_answers_from_the_web(service: str) -> None:
    weather = agent_in(load(DOCS / "examples" / "weather.py"))
    bench = AgentBench(weather(service))  # type: ignore[call-arg]
    assert bench.do("Forecast", at=Place(5, 1)).result == {"wind": 3.0, "rain": False}
    assert bench.do("Forecast", at=Place(6, 1)).code == "no_answer"


def test_a_sensor_says_its_temperature_and_reports_heat_once() -> None:
    kind = agent_in(load(DOCS / "examples" / "thermometer.py"))
    sensor = kind()
    degrees = iter([5.0, 9.0, 9.5, 6.0, 10.0])
    sensor.read = lambda: next(degrees, 4.0)  # type: ignore[attr-defined]
    bench = AgentBench(sensor)
    bench.run_for(10)
    assert [one.fields for one in bench.events] == [{"temperature": 9.0}, {"temperature": 10.0}]
    assert bench.status.fields == {"temperature": 4.0}


@pytest.mark.parametrize("name", ["weather.py", "thermometer.py"])
def test_the_catalogue_that_a_class_prints_is_its_card(name: str, tmp_path: Path) -> None:
    agent = agent_in(load(DOCS / "examples" / name))
    file = tmp_path / "own.yaml"
    file.write_text(catalogue_of(agent))
    catalogue, problems, _ = load_catalogue([file])
    assert problems == []
    card = AgentBench(agent()).cards[0]
    assert refusals(card, catalogue) == {}
    assert set(card.names) == set(catalogue.types[card.type].actions)


@pytest.mark.parametrize("name", ["mule", "hwd", "picker", "lwd"])
def test_what_new_agent_makes_is_what_the_catalogue_says(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code = run(["new", "agent", f"{name}.py"])
    if name == "picker":
        assert code == 2  # people are no program
        return
    assert code == 0, capsys.readouterr()
    own = tmp_path / "actions" / f"{name}.yaml"
    bench = AgentBench(agent_in(load(tmp_path / f"{name}.py"))())
    files = [own] if own.exists() else sorted((DOCS.parent / "actions").glob("*.yaml"))
    catalogue, problems, _ = load_catalogue(files)
    assert problems == []
    assert refusals(bench.cards[0], catalogue) == {}
    world = ["--actions", str(own)] if own.exists() else []
    assert run(["check", f"trees/try_{name}.yaml", *world]) == 0, capsys.readouterr()
    assert run(["new", "agent", f"{name}.py"]) == 2


def test_the_pages_test_passes_for_what_new_agent_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "agent", "mule.py"]) == 0
    (text,) = re.findall(r"```python\n(from formiga_bt.agent import Place\n.*?)```", PAGE, re.DOTALL)
    exec(text, {"Mule": agent_in(load(tmp_path / "mule.py"))})


def test_the_pages_first_class_needs_twenty_lines() -> None:
    text = next(one for one in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "class Mule" in one)
    assert len([line for line in text.splitlines() if line.strip()]) <= 20
