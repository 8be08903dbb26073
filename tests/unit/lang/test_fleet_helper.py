"""`fleet('picker')`: typed by the catalogue, read by expressions, refused where the task would need to hold the agent."""

from typing import Any, ClassVar

import pytest

from formiga_bt.base.diagnostics import Mark
from formiga_bt.base.geo import Place, Position
from formiga_bt.base.packaged import folder
from formiga_bt.lang.expr.members import read_of, type_read
from formiga_bt.lang.expressions import Scope, compile_expr
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.model import AgentType, Catalogue, Dependency, EvalError, Expr, UnknownState
from formiga_bt.lang.text.document import Scalar
from formiga_bt.lang.types import PLACE, AgentRef, Type
from tests.golden import Wording

HERE = Mark("t.yaml", 1, 1)
TYPES = {
    name: AgentType(name, HERE, extends=extends)
    for name, extends in (("drone", ()), ("hwd", ("drone",)), ("picker", ()))
}
SCOPE = Scope({"base": PLACE, "one": Type("agent", of=("hwd",))}, agent_types=TYPES)


class Env:
    """Three drones: at 10 m, at 30 m, and one whose position nobody knows."""

    where: ClassVar = {"a": Position(30.0, 0.0, 20.0), "b": Position(10.0, 0.0, 90.0)}

    def name(self, name: str) -> Any:
        return {"base": Place(0.0, 0.0), "one": AgentRef("b")}[name]

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        return tuple(AgentRef(one) for one in {"drone": "abc", "hwd": "c", "picker": ""}[agent_type])

    def agent_field(self, agent: AgentRef, name: str) -> Any:
        if name == "position" and agent.id not in self.where:
            raise UnknownState(f"/fleet/hwd/{agent.id}/position")
        return self.where[agent.id] if name == "position" else 50.0


def expr(text: str) -> Expr:
    found, problems = compile_expr(text, Scalar(text, Mark("t.yaml", 1, 1, 1, len(text) + 1)), 0, SCOPE, None)
    assert problems == []
    return found


def value(text: str) -> Any:
    return expr(text).run(Env())  # type: ignore[arg-type]


def test_its_agents_have_the_type_and_those_that_extend_it(wording: Wording) -> None:
    wording(str(expr("fleet('picker')").type), str(expr("first(fleet('drone'))").type))


def test_it_is_counted_searched_and_read() -> None:
    assert value("len(fleet('drone'))") == 3
    assert value("one in fleet('drone')")
    assert value("first(fleet('drone')).battery") == 50.0
    assert value("fleet('picker') == []")


def test_the_nearest_is_one_whose_position_is_known(wording: Wording) -> None:
    assert value("nearest(base, fleet('drone'))") == AgentRef("b")  # over ground: its height does not count
    assert value("nearest(at_height(base, 0 m), fleet('drone'))") == AgentRef("a")  # straight: 36 m, not 91 m
    with pytest.raises(UnknownState):
        value("nearest(base, fleet('hwd'))")
    with pytest.raises(EvalError) as refused:
        value("nearest(base, fleet('picker'))")
    wording(refused.value)


def test_what_it_reads_is_who_is_there_and_the_fields_of_each() -> None:
    assert expr("nearest(base, fleet('hwd')).battery > 30 %").reads == (
        Dependency("base"),
        Dependency("fleet('hwd')"),
        Dependency("fleet('hwd')", "position"),
        Dependency("fleet('hwd')", "battery"),
    )
    assert type_read(read_of("hwd")) == "hwd"
    assert type_read(Dependency("fleets")) == ""


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue(sorted(folder("actions").glob("*.yaml")))
    assert problems == []
    return found


def codes(steps: str, catalogue: Catalogue, head: str = "") -> list[str]:
    text = f"formiga: 1\ntask: Look\nimports: [lib/flying.yaml]\n{head}steps:\n{steps}"
    found = load_task_text(text, "look.yaml", catalogue=catalogue, library=[folder("trees")]).diagnostics
    return [d.code for d in found if d.code != "W060"]


def test_people_of_the_fleet_are_asked_and_told(catalogue: Catalogue) -> None:
    steps = """\
  - for: {one: "${fleet('picker')}"}
    mode: parallel
    steps:
      - ask: Are you well?
        of: [one]
        timeout: 5 min
        ignore_failure: true
      - notify: thank you
        to: [one]
"""
    assert codes(steps, catalogue) == []


@pytest.mark.parametrize(
    "steps",
    [
        "  - for: {one: \"${reverse(fleet('hwd'))}\"}\n    steps: [{do: one.TakeOff}]\n",
        "  - for: {one: \"${fleet('hwd')}\"}\n    steps: [{release: one}]\n",
        "  - for: {one: \"${fleet('picker')}\"}\n    steps: [{release: one}]\n",
        '  - for: {one: "${fleet(\'lwd\')}"}\n    steps: [{call: ReturnHome, with: {drone: "${one}"}}]\n',
        '  - set: {spare: "${first(fleet(\'hwd\'))}"}\n  - {call: ReturnHome, with: {drone: "${spare}"}}\n',
        "  - for: {one: \"${fleet('hwd')}\"}\n    steps:\n      - {ask: Clear?, of: [eve], timeout: 5 min, "
        "options: [y, n], clears: {role: one, on: [y]}}\n",
    ],
    ids=["do", "release", "release a person", "call", "var", "clears"],
)
def test_what_the_task_does_not_hold_is_not_commanded(steps: str, catalogue: Catalogue) -> None:
    head = 'params: {robot: {type: agent, of: [hwd]}}\nvars: {spare: "${robot}"}\nagents: {eve: {type: watcher}}\n'
    assert "E023" in codes(steps, catalogue, head)


def test_without_a_catalogue_any_name_will_do(wording: Wording) -> None:
    scope = Scope({})
    found, problems = compile_expr("fleet('x')", Scalar("fleet('x')", Mark("t.yaml", 1, 1, 1, 11)), 0, scope, None)
    assert problems == []
    wording(str(found.type))
