"""Reference trees of the second set in one line a step: `d fly north_field 40 m`, `d home`. For their authors only.

`ask w` wants a yes, `ask w anyway` goes on after any answer, `ask w as reply` keeps it. What is no line of text stays as it is
in the language, but for the steps in it.
"""

import re
from collections.abc import Mapping
from typing import Any, Final

import yaml

_LISTS: Final = ("steps", "then", "else", "sequence", "parallel", "fallback", "default")


_PLACES: Final = re.compile(r"\b(?:\w+_field|lake_shore|camp)\b")
_REGIONS: Final = re.compile(r"\b(?:lake|bog)\b")


def _hole(text: str) -> str:
    """Return an expression in which places and regions of the demo site stand by their names."""
    return "${" + _REGIONS.sub(r"site.regions.\g<0>", _PLACES.sub(r"site.places.\g<0>", text)) + "}"


def task_text(reference: Mapping[str, Any]) -> str:
    """Return the task file of a reference: `agents` (role -> type, or the role's own mapping) and `steps`."""
    agents = {role: {"type": one} if isinstance(one, str) else one for role, one in reference["agents"].items()}
    task = {
        "formiga": 1,
        "task": "Reference",
        "imports": ["lib/flying.yaml"],
        **{key: value for key, value in reference.items() if key not in ("agents", "steps")},
        "agents": agents,
        "steps": [step(one) for one in reference["steps"]],
    }
    return yaml.safe_dump(task, sort_keys=False, allow_unicode=True, width=1000)


def step(given: Any) -> dict[str, Any]:
    """Return a step of the language."""
    if isinstance(given, Mapping):
        return {key: [step(one) for one in value] if key in _LISTS else value for key, value in given.items()}
    words = str(given).split()
    if words[0] == "wait":
        return {"wait": " ".join(words[1:])}
    if words[0] == "ask":
        return _ask(words)
    return _of_agent(words)


def _ask(words: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {"ask": "Shall it go on?", "of": [words[1]], "timeout": "15 min"}
    if words[2:] == ["anyway"]:  # whatever the answer
        return found
    if len(words) > 2:  # ask w as reply
        return found | {"save_as": words[3]}
    return found | {"expect": "result.answer == 'yes'"}


def _of_agent(words: list[str]) -> dict[str, Any]:
    role, verb, *rest = words
    drone = {"drone": f"${{{role}}}"}
    match verb:
        case "fly":
            return {"call": "FlyTo", "with": {**drone, "to": _hole(rest[0]), "height": " ".join(rest[1:])}}
        case "land":
            return {"call": "FlyAndLand", "with": {**drone, "at": _hole(" ".join(rest))}}
        case "home":
            return {"call": "FetchHome", "with": drone}
        case "explore":
            return {"do": f"{role}.Explore", "with": {"region": _hole(rest[0]), "altitude": " ".join(rest[1:])}}
        case "ring":  # d ring CENTRE RADIUS m HEIGHT m
            center, radius, height = rest[0], " ".join(rest[1:3]), " ".join(rest[3:5])
            points = _hole(f"circle(above({center}, {height}), {radius}, points=24)")
            return {"for": {"spot": points}, "steps": [{"do": f"{role}.GoTo", "with": {"to": "${spot}"}}]}
    raise ValueError(f"no such step: {' '.join(words)}")
