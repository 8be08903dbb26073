"""Example requests with their answers, and the few that are most similar to a new request.

They ship as `examples.json`, written with `{A}`, `{B}`, `{C}` for places and `{R}` for a region, which are filled with names
of the site: a small model copies what it sees. Similar is what shares rare words (BM25); no model is needed for that.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Collection, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

from msgspec import Struct

from formiga_bt.llm.world import World

_WORD: Final = re.compile(r"[^\W_]+")
_K1, _B = 1.2, 0.6
_FAMILIES: Final = (
    ("circle", "round", "around", "ring", "circular", "circles", "orbit", "ympyrä"),
    ("zigzag", "zig", "zag"),
    ("land", "lands", "landing", "laskeudu"),
    ("two", "both", "pair", "second", "other"),
    ("ask", "asks", "confirm", "confirms", "confirmation", "confirmed", "says", "loaded"),
    ("together", "formation", "triangle", "simultaneously"),
    ("explore", "search", "region", "area", "all"),
    ("wait", "waits", "hover", "hovers", "stay", "seconds", "minute", "minutes"),
    ("home", "back", "return", "returns", "base"),
    ("follow", "follows", "track", "tracker"),
    ("if", "unless", "whether"),
    ("drone", "drones", "uav"),
)
"""Words that count as one."""


class Example(Struct, frozen=True):
    """A request and the right answer."""

    id: str
    types: tuple[str, ...]
    """Agent types that it uses."""
    request: str
    plan: str
    answer: dict[str, Any]

    @property
    def text(self) -> str:
        """Return the answer as a model should write it."""
        return json.dumps({"plan": self.plan, "answer": self.answer}, ensure_ascii=False, separators=(", ", ": "))


def examples_of(world: World, *, without: Collection[str] = ()) -> list[Example]:
    """Return the examples that make sense at a site, filled with its names.

    Args:
        world: the site.
        without: ids that are left out; measurements use it.
    """
    import msgspec

    site = world.site
    names = dict(zip("ABC", _three([*site.places] or [*site.ports]), strict=True))
    names["R"] = next(iter(site.regions), "")
    found = []
    for one in msgspec.json.decode(_shipped(), type=list[Example]):
        uses_region = "{R}" in one.request
        if one.id in without or not set(one.types) <= set(world.catalogue.types) or (uses_region and not names["R"]):
            continue
        found.append(msgspec.convert(_filled(msgspec.to_builtins(one), names, world), Example))
    return found


def _three(names: list[str]) -> list[str]:
    return [*names, *["base"] * 3][:3]


@cache
def _shipped() -> bytes:
    return (Path(__file__).parent / "examples.json").read_bytes()


def _filled(value: Any, names: dict[str, str], world: World) -> Any:
    if isinstance(value, str):
        text = re.sub(r"\{([ABCR])\}", lambda m: names[m[1]], value)
        return text.replace("lwd_2", _some_agent(world, "lwd")) if "lwd_2" in text else text
    if isinstance(value, (list, tuple)):
        return [_filled(one, names, world) for one in value]
    if isinstance(value, dict):
        return {key: _filled(one, names, world) for key, one in value.items()}
    return value


def _some_agent(world: World, type_: str) -> str:
    ids = [agent.id for agent in world.site.agents.values() if agent.type == type_]
    return ids[min(1, len(ids) - 1)] if ids else "lwd_2"


def most_similar(request: str, examples: Sequence[Example], count: int, names: Collection[str] = ()) -> list[Example]:
    """Return the examples most similar to a request, the most similar one last: models heed best what stands near the end.

    Args:
        request: in words.
        examples: to choose from.
        count: so many.
        names: words that say nothing about similarity: the site's places.
    """
    ignored = {word for name in names for word in _words(name)}
    documents = [Counter(w for w in _words(one.request) if w not in ignored) for one in examples]
    if not documents:
        return []
    mean = sum(map(Counter.total, documents)) / len(documents) or 1.0
    spread = Counter(word for document in documents for word in document)
    asked = {word for word in _words(request) if word not in ignored}

    def score(document: Counter[str]) -> float:
        total = 0.0
        for word in asked & document.keys():
            rare = math.log(1 + (len(documents) - spread[word] + 0.5) / (spread[word] + 0.5))
            often = document[word]
            total += rare * often * (_K1 + 1) / (often + _K1 * (1 - _B + _B * document.total() / mean))
        return total

    ranked = sorted(range(len(examples)), key=lambda i: (-score(documents[i]), i))[:count]
    return [examples[i] for i in reversed(ranked)]


def _words(text: str) -> list[str]:
    found = []
    for word in _WORD.findall(text.casefold()):
        family = next((f[0] for f in _FAMILIES if word in f), word)
        found.append(family)
    return found
