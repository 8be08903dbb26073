"""Regions where a place is due: `Explore` where the request wants all of it looked at, else the middle of it.

Small models write `FlyTo: lake` for both. What is put right is told.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final

from formiga_bt.llm.shaping.lifting import split_list
from formiga_bt.llm.vocabulary import AgentVerb
from formiga_bt.llm.words.wording import Words

_EXPLORE: Final = (
    r"\b(?:explor(?:e|es|ing|a|an|en|ar)|search(?:es|ing)?(?!\s+for\b)|survey(?:s|ing)?|scan(?:s|ning)?|sweep(?:s|ing)?|"
    r"look(?:s|ing)? (?:at|over) (?:all|every part|every bit|the whole|the entire)|"
    r"rastre(?:a|an|en|ar)|registr(?:a|an|en|ar)|pein(?:a|an|en|ar)|inspeccion(?:a|an|en|ar) (?:todo|toda))\b"
)
_ELSE: Final = (
    r"\b(?:fly|flies|flying|hovers?|hovering|lands?|landing|circles?|circling|goes|go|returns?|comes?|looks?|waits?|takes?|"
    r"orbits?|passes|pass|stays?|vuelan?|vuelen|aterriz\w+|rodean?|vuelven?|regres\w+|esperan?|pasan?|van?)\b"
)
"""What begins something else, between `explore` and a region."""
_LOOKS: Final = re.compile(r"explor|survey|scan|search|sweep|\blook", re.IGNORECASE)
_TO: Final = ("to", "at")
_HEIGHTS: Final = ("altitude", "height")
_CENTROID: Final = re.compile(r"centroid\(\s*([A-Za-z_]\w*)\s*\)")
Step = Mapping[str, Any]


def looked_at(words: Words, regions: Collection[str]) -> frozenset[str]:
    """Return the regions of which a request wants all looked at: `search the bog and the lake`."""
    found = set()
    for name in regions:
        said = re.escape(words.places.get(name, ""))
        way = rf"{_EXPLORE}(?:(?!{_ELSE})[^.;])*?(?<!\w){said}(?!\w)"
        if said and re.search(way, words.text, re.IGNORECASE):
            found.add(name)
    return frozenset(found)


def explorer(verbs: Mapping[str, AgentVerb]) -> AgentVerb | None:
    """Return the one verb of a vocabulary that looks at all of a region, whatever it is called there."""
    found = [
        verb
        for verb in verbs.values()
        if [verb.fields[key] for key in verb.required] == ["region"] and _LOOKS.search(f"{verb.name} {verb.help}")
    ]
    return found[0] if len(found) == 1 else None


class Regions:
    """Puts right where machines of one tree are sent.

    Args:
        words: the request.
        regions: of the site.
        verbs: the vocabulary.
        tree: in the short form.
        added: is told what was put right.
    """

    def __init__(
        self, words: Words, regions: Collection[str], verbs: Mapping[str, AgentVerb], tree: Step, added: list[str]
    ) -> None:
        self._regions = regions
        self._added = added
        self._explore = explorer(verbs)
        told = [text for one in _all(tree) for text in one.values() if isinstance(text, str) and "do" in one]
        named = [name for text in told for name in re.findall(r"[A-Za-z_]\w*", text)]
        explored = {
            one for step in _all(tree) for one in step.values() if self._is_exploring(step) and isinstance(one, str)
        }
        self._wanted = looked_at(words, regions) - explored
        self._once = {one for one in self._wanted if named.count(one) == 1 and _is_said_once(one, words)}

    def fitting(self, name: str, type_: str, count: int, own: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """Return the verb that is meant, with its values.

        Args:
            name: of the verb.
            type_: of the machine.
            count: how many they are: a team explores as many regions.
            own: the values.
        """
        where = next((key for key in _TO if isinstance(own.get(key), str)), "")
        if not where:
            return name, own
        text = own[where].strip()
        parts = split_list(text[1:-1]) if text.startswith("[") and text.endswith("]") else [text]
        named = [match[1] if (match := _CENTROID.fullmatch(one)) else one for one in parts]
        if not any(one in self._regions for one in named):
            return name, own
        if name in ("FlyTo", "GoTo") and self._wanted & {*named}:
            is_each = {*named} <= self._once and len(named) == count
            return self._exploring(named, type_, own) or (name, own) if is_each else (name, own)
        plain = [f"centroid({one})" if one in self._regions else one for one in parts]
        if plain == parts:
            return name, own
        self._tell(f"the middle of {' and '.join(one for one in parts if one in self._regions)} is the place to fly to")
        return name, {
            **own,
            where: plain[0] if len(parts) == 1 and not text.startswith("[") else f"[{', '.join(plain)}]",
        }

    def _exploring(self, regions: list[str], type_: str, own: dict[str, Any]) -> tuple[str, dict[str, Any]] | None:
        """Return the step in which one machine looks at one region, or a team at as many, each at one."""
        verb = self._explore
        if verb is None or (verb.types and type_ not in verb.types):
            return None
        self._tell(f"all of {' and '.join(regions)} is looked at, as the request says")
        text = regions[0] if len(regions) == 1 else f"[{', '.join(regions)}]"
        height = next((key for key in _HEIGHTS if key in verb.fields), "")
        return verb.name, {verb.required[0]: text} | ({height: own["height"]} if height and "height" in own else {})

    def _is_exploring(self, step: Step) -> bool:
        return self._explore is not None and step.get("do") == self._explore.name

    def _tell(self, what: str) -> None:
        if what not in self._added:
            self._added.append(what)


def _is_said_once(name: str, words: Words) -> bool:
    return len(words.spans(name)) == 1


def _all(node: Any) -> Iterator[Step]:
    """Yield the objects below a node."""
    if isinstance(node, dict):
        yield node
    for one in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _all(one)
