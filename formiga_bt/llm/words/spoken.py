"""How names of a site are said: `north_field` is `north field`, `North-field`, and `campo norte` to who speaks Spanish.

Only names made of common words of the land are known in another language; any other name is said as it is written.
"""

import re
from collections.abc import Mapping
from typing import Final

SPANISH: Final[Mapping[str, tuple[str, ...]]] = {
    "barn": ("granero",), "base": ("base",), "bay": ("bahía",), "beach": ("playa",), "big": ("grande",),
    "bog": ("turbera", "ciénaga"), "bridge": ("puente",), "camp": ("campamento",), "chapel": ("capilla",),
    "church": ("iglesia",), "clearing": ("claro",), "cliff": ("acantilado",), "creek": ("arroyo",), "dam": ("presa",),
    "depot": ("almacén", "depósito"), "east": ("este",), "edge": ("borde",), "farm": ("granja",), "field": ("campo",),
    "forest": ("bosque",), "garden": ("jardín", "huerto"), "gate": ("puerta", "portón"), "grove": ("arboleda",),
    "harbour": ("puerto",), "hill": ("colina", "cerro"), "island": ("isla",), "lake": ("lago",),
    "landing": ("aterrizaje",), "lower": ("bajo", "baja"), "marsh": ("pantano", "marisma"),
    "meadow": ("prado", "pradera"), "middle": ("medio", "central"), "mill": ("molino",), "new": ("nuevo", "nueva"),
    "north": ("norte",), "office": ("oficina",), "old": ("viejo", "vieja"), "orchard": ("huerto",),
    "parking": ("aparcamiento",), "path": ("sendero", "camino"), "pond": ("estanque",), "quarry": ("cantera",),
    "ridge": ("cresta",), "river": ("río",), "road": ("camino", "carretera"), "rock": ("roca",),
    "sawmill": ("aserradero",), "shed": ("cobertizo",), "shore": ("orilla", "ribera"),
    "small": ("pequeño", "pequeña"), "south": ("sur",), "spring": ("manantial",), "square": ("plaza",),
    "station": ("estación",), "store": ("almacén",), "stream": ("arroyo",), "tower": ("torre",),
    "trail": ("sendero",), "upper": ("alto", "alta"), "valley": ("valle",), "village": ("pueblo",),
    "vineyard": ("viñedo",), "warehouse": ("almacén",), "well": ("pozo",), "west": ("oeste",), "wood": ("bosque",),
    "woods": ("bosque",), "yard": ("patio",),
}  # fmt: skip
_ENGLISH: Final = re.compile(
    r"\b(?:the|an|and|to|of|at|over|from|for|its|it|then|with|by|in|is|are|while|until|back|home)\b", re.IGNORECASE
)
_OTHER: Final = re.compile(
    r"\b(?:un|una|el|la|los|las|y|de|del|al|en|con|sobre|desde|hasta|que|su|sus|se|luego|dron|"
    r"ja|sitten|kun|paikkaan|korkeudella|jälkeen|lentää|palaa)\b",
    re.IGNORECASE,
)
_PART: Final = re.compile(r"[_\s-]+")
_OF: Final = r"\s+(?:(?:del|de la|de los|de las|de)\s+)?"


def pattern_of(name: str) -> str:
    """Return a pattern of the ways a name of a site is said, for a search that ignores case."""
    parts = _PART.split(name)
    ways = [r"[_\s-]*".join(map(re.escape, parts))]
    if len(parts) <= 2 and all(part.casefold() in SPANISH for part in parts):
        said = ["(?:" + "|".join(map(re.escape, SPANISH[part.casefold()])) + ")" for part in parts]
        ways.append(_OF.join(reversed(said)))  # orilla del lago, campo norte
    return rf"(?<!\w)(?:{'|'.join(ways)})(?!\w)"


def said(name: str, request: str) -> str:
    """Return the words of a request that name something of the site; "" = none."""
    found = re.search(pattern_of(name), request, re.IGNORECASE)
    return found[0] if found is not None else ""


def is_known(name: str) -> bool:
    """Return whether it is known how a name is said in Spanish."""
    return all(part.casefold() in SPANISH for part in _PART.split(name))


def is_english(request: str) -> bool:
    """Return whether a request has more of the small words of English than of the other languages."""
    return len(_OTHER.findall(request)) <= len(_ENGLISH.findall(request))
