"""A catalogue of 30 types and 100 actions that nobody foresaw: a site of it is checked and rehearsed, with no line of code."""

from itertools import count
from pathlib import Path
from typing import Any

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from formiga_bt.base.machines import MOVING
from formiga_bt.lang.compose import compose
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal.rehearsal import Rehearsal, fleet_of
from formiga_bt.rehearsal.testing import task_of
from tests.shares import some

TYPES, ACTIONS = 30, 100


class Plain(yaml.SafeDumper):
    """Writes no aliases: they are not part of the language."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def written_as(data: Any) -> str:
    """Return data as YAML."""
    return yaml.dump(data, Dumper=Plain, sort_keys=False)


SCALARS = ["number", "int", "percent", "distance", "duration", "speed", "angle", "mass", "time", "text", "bool"]
VALUES: dict[str, Any] = {
    "number": 2, "int": 3, "percent": "4 %", "distance": "5 m", "duration": "6 s", "speed": "1 m/s", "angle": "7 deg",
    "mass": "8 kg", "text": "word", "bool": True, "place": "pit", "region": "field",
}  # fmt: skip
RESULTS = st.one_of(
    st.sampled_from([*SCALARS, "place", "position", "region"]),
    st.builds(lambda one: {"list": one}, st.sampled_from(SCALARS)),
    st.builds(lambda words: {"type": "enum", "values": words}, st.just(["red", "green"])),
    st.builds(lambda least: {"type": "int", "min": least}, st.integers(0, 9)),
)
FIELDS = st.dictionaries(st.sampled_from(["a", "b", "c"]), st.sampled_from(list(VALUES)), max_size=3)


@st.composite
def catalogues(draw: st.DrawFn) -> dict[str, Any]:
    """Return a catalogue file; what moves has a field `to` that its actions may move to, and no machine searches a region."""
    actions: dict[str, Any] = {}
    types: dict[str, Any] = {}
    numbers = count()
    for number in range(TYPES):
        mobility = draw(st.sampled_from(["air", "ground", "fixed", "none", "people"]))
        own = []
        for _ in range(ACTIONS // TYPES + (number < ACTIONS % TYPES)):
            name = f"Act{next(numbers)}"
            fields = {name: kind for name, kind in draw(FIELDS).items() if mobility not in MOVING or kind != "region"}
            spec: dict[str, Any] = {"fields": fields, "result": draw(st.dictionaries(st.sampled_from("pqr"), RESULTS))}
            spec["typical"] = f"{draw(st.integers(1, 30))} s"
            if mobility in ("ground", "people") and draw(st.booleans()):
                fields["to"] = "place"
                spec["moves_to"] = "to"
            actions[name] = spec
            own.append(name)
        limits = {"speed": f"{draw(st.integers(1, 5))} m/s"}
        how: dict[str, Any] = {"human": True} if mobility == "people" else {"mobility": mobility}
        types[f"type_{number}"] = {**how, "actions": own, "limits": limits}
    return {"types": types, "actions": actions}


def site_of(types: dict[str, Any]) -> dict[str, Any]:
    agents: dict[str, dict[str, Any]] = {f"{name}_1": {"type": name} for name in types}
    ports: dict[str, Any] = {}
    for number, (name, of) in enumerate(types.items()):
        spot = {"east": f"{-200 - 20 * number} m", "north": "0 m"}
        if of.get("mobility") in ("fixed", "ground"):
            agents[f"{name}_1"]["at"] = spot
        if of.get("mobility") == "air":
            agents[f"{name}_1"]["home"] = f"p{number}"
            ports[f"p{number}"] = {"at": spot}
    corner = [{"east": "300 m", "north": "0 m"}, {"east": "330 m", "north": "0 m"}, {"east": "330 m", "north": "30 m"}]
    return {
        "formiga_site": 1, "name": "any", "base": {"lat": 66.5, "lng": 25.7}, "agents": agents,
        "ports": ports, "actions": ["mine.yaml"],
        "places": {"pit": {"east": "60 m", "north": "60 m"}}, "regions": {"field": corner},
    }  # fmt: skip


def task_text(type_: str, actions: dict[str, Any], own: list[str], east: int) -> str:
    """Return a task that does all that a type can, one after the other."""
    steps = []
    for name in own:
        step: dict[str, Any] = {"do": f"who.{name}"}
        given_ = {field: VALUES[kind] for field, kind in actions[name]["fields"].items()}
        given_ |= {"to": {"east": f"{east} m", "north": "40 m"}} if "to" in given_ else {}
        step |= {"with": given_} if given_ else {}
        steps.append(step)
    return written_as({"agents": {"who": {"type": type_}}, "steps": steps})


def rehearsed(catalogue: Catalogue, site: Site, texts: dict[str, str]) -> dict[str, str]:
    """Return how each task ended."""
    tasks = [task_of(text, site, catalogue, name.title().replace("_", "")) for name, text in texts.items()]
    rehearsal = Rehearsal(site, catalogue, tasks, fleet_of(site, catalogue), keep_steps=False)
    rehearsal.run_for(1.0)
    ids = [rehearsal.submit(task.name) for task in tasks]
    rehearsal.run_until_ended(limit_s=3600.0)
    found = {one: rehearsal.task(one) for one in ids}
    rehearsal.close()
    return {one.name: f"{one.status} {one.outcome.code} {one.outcome.reason}".strip() for one in found.values()}


@settings(max_examples=some(4, 40), deadline=None, suppress_health_check=list(HealthCheck))
@given(written=catalogues())
def test_every_type_of_any_catalogue_is_rehearsed_as_soon_as_it_checks(
    written: dict[str, Any], tmp_path_factory: Any
) -> None:
    folder: Path = tmp_path_factory.mktemp("any")
    (folder / "mine.yaml").write_text(written_as(written))
    (folder / "site.yaml").write_text(written_as(site_of(written["types"])))
    world = compose(folder / "site.yaml")

    assert [str(one) for one in world.diagnostics if one.severity == "error"] == []
    assert world.site is not None
    texts = {
        name: task_text(name, written["actions"], of["actions"], -200 - 20 * number)
        for number, (name, of) in enumerate(written["types"].items())
    }
    ends = rehearsed(world.catalogue, world.site, texts)

    assert set(ends.values()) == {"SUCCEEDED"}, ends
