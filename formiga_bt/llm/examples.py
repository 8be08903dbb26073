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

from formiga_bt.llm.world import RequestWorld

MOST_OWN: Final = 40
"""Tasks of the site that are read for examples."""
LONGEST_OWN: Final = 1500
"""Characters of such an example."""
_WORD: Final = re.compile(r"[^\W_]+")
_K1, _B = 1.2, 0.6
_ALIKE, _UNLIKE, _SAME = 2.0, 1.0, 2.0
_SAYS_NOTHING: Final = frozenset(
    re.findall(
        r"\S+",
        "a an the it its it's and or of is are to by in at with on over then there m from that this one for them they "
        "drone light heavy lwd lwds hwd hwds",
    )
)
_KINDS: Final = {
    "several": r"\b(?:two|three|four|2|3|4|both|pair|another|other one|light one|heavy one|meanwhile|only then|"
    r"second (?:one|drone|lwd|hwd))\b",
    "together": r"\b(?:together|formation|row|in position|three)\b",
    "part": r"\b(?:meanwhile|part|one of them|the other|another|same time|at once|simultaneously|"
    r"one (?:flies|goes|to)|the (?:first|second))\b",
    "ask": r"\b(?:ask\w*|confirm\w*|agree\w*|says?|okay|ok|permission|yes|word)\b",
    "loop": r"\b(?:every|times|again|twice|until|repeat\w*)\b",
    "region": r"\b(?:region|area|search\w*|explore\w*|survey|all of)\b",
    "if": r"\b(?:if|unless|otherwise|whether|only)\b",
    "land": r"\bland(?:s|ing|ed)?\b",
    "figure": r"\b(?:circle|circular|round|ring|orbit|loop|zigzag\w*|triang\w+|square|line|row|legs?|corners?|pattern)\b",
}
"""Kind of mission -> words that tell of it."""
_WEIGHTS: Final = {"ask": 2.0, "several": 2.0, "loop": 2.0, "region": 2.0, "figure": 1.5}
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
    ("follow", "follows", "guide", "guides", "track", "tracker"),
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


def examples_of(world: RequestWorld, *, without: Collection[str] = ()) -> list[Example]:
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
    return found + _own(world)


def _own(world: RequestWorld) -> list[Example]:
    """Return the site's own tasks that say what they are for, as far as the short form can say them."""
    from formiga_bt.llm.editing import as_answer

    found = []
    for file, text in sorted(world.tasks.items())[:MOST_OWN]:
        try:
            purpose, answer, form = as_answer(text, world, exact=False)
        except (AssertionError, ValueError, KeyError, TypeError):  # a file with errors
            continue
        if form == "short" and len(purpose.split()) >= 3 and len(answer) <= LONGEST_OWN:
            said = json.loads(answer)
            found.append(Example(f"own:{file}", (), purpose, said["plan"], said["answer"]))
    return found


def _three(names: list[str]) -> list[str]:
    return [*names, *["base"] * 3][:3]


@cache
def _shipped() -> bytes:
    return (Path(__file__).parent / "examples.json").read_bytes()


def _filled(value: Any, names: dict[str, str], world: RequestWorld) -> Any:
    if isinstance(value, str):
        text = re.sub(r"\{([ABCR])\}", lambda m: names[m[1]], value)
        return text.replace("lwd_2", _some_agent(world, "lwd")) if "lwd_2" in text else text
    if isinstance(value, (list, tuple)):
        return [_filled(one, names, world) for one in value]
    if isinstance(value, dict):
        return {key: _filled(one, names, world) for key, one in value.items()}
    return value


def _some_agent(world: RequestWorld, type_: str) -> str:
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
    ignored = {word for name in names for word in _words(name)} | _SAYS_NOTHING
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

    wanted, kinds = kind_of(request, names), [kind_of(one.request, names) for one in examples]
    worth = [
        0.7 * score(document) + _ALIKE * _weight(wanted & kind) - _UNLIKE * _weight(kind - wanted)
        for document, kind in zip(documents, kinds, strict=True)
    ]
    chosen: list[int] = []
    while len(chosen) < min(count, len(examples)):
        left = [i for i in range(len(examples)) if i not in chosen]
        chosen.append(max(left, key=lambda i: (worth[i] - _SAME * any(kinds[i] == kinds[j] for j in chosen), -i)))
    return [examples[i] for i in reversed(chosen)]


def _weight(kinds: Collection[str]) -> float:
    return sum(_WEIGHTS.get(one, 1.0) for one in kinds)


def kind_of(request: str, names: Collection[str] = ()) -> frozenset[str]:
    """Return what kind of mission a request speaks of: several machines, people, loops, regions, figures, ..."""
    text = request.casefold()
    kinds = {name for name, pattern in _KINDS.items() if re.search(pattern, text)}
    places = sum(re.search(rf"(?<!\w){name.replace('_', '[ _-]')}(?!\w)", text) is not None for name in names)
    return frozenset(kinds | {f"{max(1, min(places, 3))} places"})


def _words(text: str) -> list[str]:
    found = []
    for word in _WORD.findall(text.casefold()):
        family = next((f[0] for f in _FAMILIES if word in f), word)
        found.append(family)
    return found
