"""Short lists of what a machine does at the end: `When done: centre, port, land`; `Then: middle, home`."""

import re
from typing import Final

_LIST: Final = re.compile(
    r"\b(?P<lead>(?:when|once|as soon as) (?:(?:that|this|it|all) is |it has )?(?:done|over|finished|complete|ready)"
    r"|after (?:that|it|this)|afterwards|and then|then|finally|lastly|(?:in|at) the end|to (?:finish|end)"
    r"|luego|después|al (?:terminar|acabar|final)|por último|finalmente|cuando (?:termine|acabe)|para (?:terminar|acabar))"
    r"\s*(?::|–|—|\s-\s)\s*(?P<list>[^.:;!?\n]+)",
    re.IGNORECASE,
)
_BREAK: Final = re.compile(
    r"\s*(?:,|/|→|->|–|—|\s-\s)\s*(?:(?:and|then|y|luego)\s+)*|\s+(?:and then|and|then|y luego|y|luego)\s+",
    re.IGNORECASE,
)
_STATIONS: Final = {
    "centre": r"(?:(?:back )?(?:to |over )?(?:the |its )?(?:centre|center|middle|mid-?point)(?: point)?"
    r"|(?:al |el )?(?:centro|medio))",
    "home": r"(?:(?:back )?(?:to )?(?:its |the )?(?:own )?(?:home )?port|(?:back )?home"
    r"|(?:a |al |el |su |a su )?(?:puerto|casa))",
    "land": r"(?:land|lands|landing|touch ?down|down|aterriza|aterrizar|aterrizaje|tierra|a tierra)",
}
_AS_SAID: Final = {
    "en": {"centre": "it goes back to the centre", "home": "comes home", "land": "lands"},
    "es": {"centre": "vuelve al centro", "home": "vuelve a casa", "land": "aterriza"},
}
_SPANISH: Final = re.compile(r"luego|después|al |por|finalmente|cuando|para", re.IGNORECASE)


def stations(request: str) -> tuple[str, ...]:
    """Return the stations of the list at the end of a request: `centre`, `home`, `land`; of other ones their words."""
    found: tuple[str, ...] = ()
    for match in _LIST.finditer(request):
        found = _read(match["list"])
    return found


def ends_home(request: str) -> bool:
    """Return whether such a list ends at home: nothing but a landing follows it."""
    listed = stations(request)
    return "home" in listed and set(listed[listed.index("home") + 1 :]) <= {"land"}


def written_out(request: str) -> str:
    """Return a request with such a list as a sentence, if it has nothing but the centre of a ring, home and a landing."""

    def sentence(match: re.Match[str]) -> str:
        listed = _read(match["list"])
        if not listed or not set(listed) <= set(_STATIONS):
            return match[0]
        if "home" in listed and listed[-1] == "land":
            listed = listed[:-1]  # that is how it comes home
        said = _AS_SAID["es" if _SPANISH.match(match["lead"]) else "en"]
        parts = [said[one] for one in listed]
        if said is _AS_SAID["en"]:
            parts[0] = parts[0] if parts[0].startswith("it ") else f"it {parts[0]}"
        link = " y " if said is _AS_SAID["es"] else " and "
        return f"{match['lead']} {link.join([*[', '.join(parts[:-1])] * (len(parts) > 1), parts[-1]])}"

    return _LIST.sub(sentence, request)


def _read(listed: str) -> tuple[str, ...]:
    parts = [one.strip().casefold() for one in _BREAK.split(listed) if one.strip()]
    return tuple(
        next((name for name, pattern in _STATIONS.items() if re.fullmatch(pattern, one)), one) for one in parts
    )
