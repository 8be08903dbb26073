"""Repairs that need no model: what the checker itself would mend, and five things that a draft forgets in one way only.

Each is told: in the file as a comment, in the round, in the summary. Nothing here changes what was asked for; what could be
meant in two ways goes back to the model.
"""

import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any, Final

from formiga_bt.base.diagnostics import CommandedTwice, Diagnostic, LeftAirborne, OnGround, UnusedName
from formiga_bt.lang.json_form.reading import JsonProblem, LoadedJson, load_task_json
from formiga_bt.lang.json_form.writing import from_yaml
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.text.fixing import mend
from formiga_bt.llm.world import RequestWorld

MOST: Final = 12
_STEP: Final = re.compile(r"\.?([A-Za-z_]\w*)|\[(\d+)\]")
FLYING: Final = "lib/flying.yaml"


@dataclass(slots=True)
class FixedTask:
    """A task in JSON form after its mends, and what was done."""

    data: dict[str, Any]
    loaded: LoadedJson
    done: list[str] = field(default_factory=list)


def mended(data: Mapping[str, Any], world: RequestWorld) -> FixedTask:
    """Check a task in JSON form, and mend what can be mended by a program."""
    now: dict[str, Any] = deepcopy(dict(data))
    done: list[str] = []
    loaded = _load(now, world)
    for _ in range(MOST):
        step = next((said for p in loaded.problems if (said := _mend(now, p, world))), "")
        if not step:
            break
        done.append(step)
        loaded = _load(now, world)
    if loaded.task is None and any(p.diagnostic.fix is not None for p in loaded.problems):
        now, loaded, more = _fixed(now, loaded, world)
        done += more
    return FixedTask(now, loaded, done)


def _fixed(
    data: dict[str, Any], loaded: LoadedJson, world: RequestWorld
) -> tuple[dict[str, Any], LoadedJson, list[str]]:
    """Apply the fixes that the checker offers, as `formiga fix` does: a misspelt name, a missing unit."""
    name = "task.yaml"

    def check(text: str) -> tuple[Diagnostic, ...]:
        found = load_task_text(text, name, catalogue=world.catalogue, site=world.site, library=world.folders)
        return tuple(found.diagnostics)

    fixed = mend(loaded.yaml, name, check)
    if fixed.text == loaded.yaml:
        return data, loaded, []
    try:
        now = from_yaml(fixed.text, world.catalogue)
    except ValueError:
        return data, loaded, []
    now.pop("formiga", None)
    again = _load(now, world)
    better = again.task is not None or len(again.problems) < len(loaded.problems)
    return (now, again, [one.message for one in fixed.applied]) if better else (data, loaded, [])


def _load(data: Mapping[str, Any], world: RequestWorld) -> LoadedJson:
    return load_task_json(dict(data), catalogue=world.catalogue, site=world.site, library=world.folders)


def _mend(data: dict[str, Any], problem: JsonProblem, world: RequestWorld) -> str:
    """Mend one problem in place; return what was done, "" = nothing."""
    match problem.diagnostic.about:
        case LeftAirborne(role) if "steps" in data:
            _import(data)
            step = _call("ReturnHome", role)
            data["steps"].append(step if not _is_team(data, role) else _of_each(role, step))
            if not _load(data, world).task:  # on some way it stands on the ground by then
                step["when"] = f"{_agent(step)}.airborne"
            return f"{role} comes home at the end: a task may not leave it in the air"
        case OnGround(place):
            return _wrap(data, problem.path, place)
        case CommandedTwice(agent):
            return _one_by_one(data, problem.path, agent)
        case UnusedName("import", name):
            before = list(data.get("imports", ()))
            data["imports"] = [one for one in before if one != name]
            return "an import that nothing uses is gone" if data["imports"] != before else ""
        case UnusedName("role", name):
            roles = list(data.get("agents", ()))
            data["agents"] = [one for one in roles if one.get("name") != name]
            return f"nobody is borrowed as {name}, who had nothing to do" if len(data["agents"]) < len(roles) else ""
    return _airborne(data, problem) if problem.diagnostic.code == "E030" else ""


def _wrap(data: dict[str, Any], path: str, place: str) -> str:
    """Put a place that should be a position in the air at the task's height over the ground."""
    parent, key = _at(data, path)
    if not isinstance(parent, dict) or key != "expr":
        return ""
    height = _height(data)
    parent[key] = f"above({place}, {height})"
    return f"{place} is flown over at {height}"


def _height(data: dict[str, Any]) -> str:
    params = data.setdefault("params", [])
    for param in params:
        if param.get("type") == "distance" and param.get("name") in ("height", "altitude"):
            return str(param["name"])
    params.append({"name": "height", "type": "distance", "default": {"lit": "20 m"}})
    return "height"


def _airborne(data: dict[str, Any], problem: JsonProblem) -> str:
    """Let a machine take off before what needs the air, or leave out a take-off in the air."""
    found = _step_at(data, problem.path)
    if found is None:
        return ""
    steps, index = found
    step = steps[index]
    if step.get("action") == "TakeOff":
        agent = str(step.get("agent", ""))
        if "when" in step:
            return ""
        step["when"] = f"not {agent}.airborne"
        return f"{agent} takes off only if it is on the ground"
    agent = _agent(step)
    if not agent or (index and steps[index - 1].get("action") == "TakeOff" and _agent(steps[index - 1]) == agent):
        return ""
    if step.get("call") == "ReturnHome":
        step["call"] = "FetchHome"
        return f"{agent} takes off to come home"
    if step.get("action") in ("GoTo", "LandIn", "Explore") or step.get("call") in ("FlyOver", "LandNear"):
        takeoff = {"action": "TakeOff", "agent": agent, "when": f"not {agent}.airborne"}
        steps.insert(index, takeoff)
        return f"{agent} takes off first"
    return ""


def _one_by_one(data: dict[str, Any], path: str, agent: str) -> str:
    """Put the branches of a `parallel` that command one machine into one: it does them one after another."""
    at = path.rfind(".parallel[")
    holder, key = _at(data, f"{path[:at]}.parallel") if at >= 0 else (None, None)
    if not isinstance(holder, dict) or key != "parallel" or not isinstance(holder["parallel"], list):
        return ""
    branches = holder["parallel"]
    groups: list[tuple[str, list[dict[str, Any]]]] = []
    for branch in branches:
        inner = branch["sequence"] if set(branch) == {"sequence"} else [branch]
        agents = {_agent(step) for step in inner} - {""}
        same = next((steps for one, steps in groups if agents == {one}), None)
        if same is not None:
            same += inner
        else:
            groups.append((next(iter(agents)) if len(agents) == 1 else "", list(inner)))
    if len(groups) == len(branches):
        return ""
    merged = [steps[0] if len(steps) == 1 else {"sequence": steps} for _, steps in groups]
    if len(merged) == 1:
        found = _step_at(data, path[:at])
        if found is None or set(holder) != {"parallel"}:
            return ""
        steps, index = found
        steps[index : index + 1] = groups[0][1]
    else:
        holder["parallel"] = merged
    return f"{agent} does one thing after another, for it cannot do two at once"


def _agent(step: Mapping[str, Any]) -> str:
    if "agent" in step:
        return str(step["agent"])
    for one in step.get("with", ()):
        if isinstance(one, dict) and one.get("name") == "drone" and isinstance(one.get("value"), dict):
            return str(one["value"].get("expr", ""))
    return ""


def _is_team(data: Mapping[str, Any], role: str) -> bool:
    return any(one.get("name") == role and "count" in one for one in data.get("agents", ()))


def _of_each(team: str, step: dict[str, Any]) -> dict[str, Any]:
    """Return a step of a machine as one of all members of a team, at the same time."""
    step["with"][0]["value"] = {"expr": "each_one"}
    return {"for": [{"name": "each_one", "value": {"expr": team}}], "mode": "parallel", "steps": [step]}


def _call(name: str, agent: str) -> dict[str, Any]:
    return {"call": name, "with": [{"name": "drone", "value": {"expr": agent}}]}


def _import(data: dict[str, Any]) -> None:
    imports = data.setdefault("imports", [])
    if FLYING not in imports:
        imports.append(FLYING)


def _at(data: Any, path: str) -> tuple[Any, Any]:
    """Return what holds the value of a JSON path, and its key there; (None, None) if the path leads nowhere."""
    parent: Any = None
    key: Any = None
    here = data
    for match in _STEP.finditer(path.removeprefix("$")):
        parent, key = here, match[1] if match[1] is not None else int(match[2])
        try:
            here = here[key]
        except (KeyError, IndexError, TypeError):
            return None, None
    return parent, key


def _step_at(data: Any, path: str) -> tuple[list[dict[str, Any]], int] | None:
    """Return the innermost list of steps on a path and the number in it."""
    found = None
    here = data
    for match in _STEP.finditer(path.removeprefix("$")):
        key: Any = match[1] if match[1] is not None else int(match[2])
        if isinstance(here, list) and isinstance(key, int) and key < len(here) and isinstance(here[key], dict):
            one = here[key]
            if any(
                word in one for word in ("action", "call", "parallel", "sequence", "for", "repeat", "if", "ask", "wait")
            ):
                found = (here, key)
        try:
            here = here[key]
        except (KeyError, IndexError, TypeError):
            break
    return found
