"""Machines that no catalogue here has and that are to go somewhere: a truck, a submarine, `el tractor`."""

import re
from typing import Final

from formiga_bt.llm.words.mentions import unquoted
from formiga_bt.llm.words.wording import DRONES, Words, types_said
from formiga_bt.llm.world import RequestWorld

STRANGERS: Final = (
    "helicopter", "submarine", "truck", "lorry", "pickup truck", "tractor", "car", "van", "jeep", "quad bike", "rover", "robot",
    "robot dog", "boat", "motor boat", "speedboat", "ship", "raft", "canoe", "plane", "aeroplane", "airplane", "aircraft",
    "glider", "jet", "airship", "blimp", "zeppelin", "balloon", "hot-air balloon", "train", "tram", "bus", "motorbike",
    "motorcycle", "bicycle", "bike", "crane", "digger", "excavator", "bulldozer", "combine harvester", "harvester", "rocket",
    "satellite", "kite", "ambulance", "fire engine", "hovercraft",
    "helicóptero", "submarino", "camión", "camioneta", "coche", "furgoneta", "todoterreno", "barco", "barca", "lancha", "balsa",
    "avión", "avioneta", "planeador", "dirigible", "globo", "tren", "tranvía", "autobús", "moto", "motocicleta", "bicicleta",
    "grúa", "excavadora", "cosechadora", "cohete", "satélite", "cometa", "perro robot", "ambulancia",
)  # fmt: skip
"""English, Spanish. A catalogue that has a type of this name, or so labelled, has it."""
_ARTICLE: Final = (
    r"(?:(?:the|our|my|your|an?|one|that|this|another|el|la|un|una|nuestro|nuestra|mi|ese|esa|este|otro|otra)\s+)"
)
_KIND: Final = r"(?:[^\W\d_]+\s+)?"
_SEND: Final = (
    r"\b(?:send|launch|dispatch|fly|manda|mande|mandar|envía|envia|envíe|enviar|lanza|lance|despacha)\s+(?:out\s+)?"
)
_LET: Final = r"(?:\b(?:let|have|make|order|want|need|like|haz que|quiero que|necesito que)|(?:^|[.!?;:]\s*)que)\s+"
_TO: Final = r"(?:should|shall|must|will|can|could|may|has to|needs to|is to|to|debe|puede|tiene que|ha de)\s+"
_MOVES: Final = (
    r"(?:go|goes|fly|flies|land|lands|take off|takes off|hover|hovers|circle|circles|orbit|orbits|climb|climbs|look|looks|"
    r"watch|watches|visit|visits|check|checks|inspect|inspects|search|searches|explore|explores|patrol|patrols|come home|"
    r"comes home|return|returns|va|vaya|ir|vuela|vuele|volar|aterriza|aterrice|aterrizar|despega|despegue|sube|suba|"
    r"rodea|rodee|vigila|vigile|vigilar|mira|mire|revisa|revise|visita|visite|busca|busque|vuelve|vuelva|regresa|regrese)\b"
    r"(?!\s+(?:past|by|away|through|first|primero))"
)
_ONWARDS: Final = (
    r"(?=\s+(?:to|over|above|at|up|out|off|into|towards?|round|around|about|along|and|across|home|there|sobre|al|a\s+(?:el|la|los|las|"
    r"\d|un|una)|hasta|hacia|por|en|y|encima|desde)\b|\s*(?:[.,;:!?]|$))"
)
_BEGINS: Final = r"(?:^|[.!?;:]\s+)"


def stranger(words: Words, world: RequestWorld) -> str:
    """Return the words for a machine that is to go somewhere and is none of the site's types; "" = there is none.

    A truck that stands somewhere, or that somebody waits for, is none: only who is sent, or is told to fly, look or land.
    """
    text = unquoted(words.text)
    for name in sorted({*words.places.values(), *words.agents.values()}, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", lambda found: "·" * len(found[0]), text, flags=re.IGNORECASE)
    known = {word.casefold() for one in world.catalogue.types.values() for word in (one.name, one.label) if word}
    nouns = "|".join(re.escape(one) for one in sorted(STRANGERS, key=len, reverse=True) if one not in known)
    who = rf"(?P<who>{_ARTICLE}{_KIND}?(?:{nouns}))(?!\w)"
    begins = rf"{_BEGINS}(?:please\s+|then\s+|luego\s+)?{who}"
    orders = [rf"{_SEND}{who}{_ONWARDS}", rf"{_LET}{who}\s+(?:{_TO})?{_MOVES}", rf"{begins}\s+{_TO}{_MOVES}"]
    if not _speaks_of_machine(
        words, world
    ):  # else it may be what a drone is to look at: `The train goes over the bridge`
        orders += [rf"{begins}\s+{_MOVES}", rf"{begins}\s*:"]
    return next((found["who"] for order in orders if (found := re.search(order, text, re.IGNORECASE)) is not None), "")


def _speaks_of_machine(words: Words, world: RequestWorld) -> bool:
    types = world.catalogue.types
    machines = [one for one in types_said(words, world.catalogue) if not types[one].human]
    drone = re.search(rf"\b(?:{'|'.join(DRONES)})\b", words.text, re.IGNORECASE)
    return bool(machines or words.agents or drone)


def speaks_of_stranger(words: Words) -> bool:
    """Return whether a request has a word for such a machine, whatever it does."""
    nouns = "|".join(map(re.escape, STRANGERS))
    return re.search(rf"(?<!\w)(?:{nouns})s?(?!\w)", words.text, re.IGNORECASE) is not None
