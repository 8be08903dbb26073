"""`formiga new NAME --for TYPE`: a task that does what a type can, each action once, for any type of any catalogue.

What flies goes up first and comes home; a field that must be given gets a sample of its type within its limits. An action of
which that is not known (whom to follow) stands there as a comment.
"""

from collections.abc import Iterator, Mapping
from typing import Final

from msgspec import Struct

from formiga_bt.base.asking import CONFIRM
from formiga_bt.base.clock import SECOND
from formiga_bt.base.geo import Place, Region
from formiga_bt.base.units import format_number, format_quantity
from formiga_bt.lang.model import ActionSpec, AgentType, Catalogue, FieldSpec, Site
from formiga_bt.lang.naming import actions_of, takes_off
from formiga_bt.lang.own_names import why_taken
from formiga_bt.lang.text.formatting import format_text
from formiga_bt.lang.types import Type

NUMBERS: Final[Mapping[str, float]] = {
    "number": 1.0, "int": 1.0, "percent": 50.0, "distance": 5.0, "duration": 5.0, "speed": 1.0, "angle": 90.0, "mass": 1.0,
}  # fmt: skip
"""Samples, SI."""
TEXTS: Final[Mapping[str, str]] = {
    "text": "hello", "bool": "true", "place": "{east: 10 m, north: 5 m}", "position": "{east: 10 m, north: 5 m, height: 10 m}",
}  # fmt: skip
LEAST_S: Final = 600
"""So long an action may take at least."""

HEAD: Final = """\
# Each action of a {label}, once: change it into what you want done.
#   check it:  formiga check {file}
#   try it:    formiga dryrun {file}
formiga: 1
task: {name}
version: 0.1.0
description: Try each action of a {label}.
"""


class _Home(Struct, frozen=True):
    """What a machine of a type is brought home with."""

    file: str
    subtree: str
    param: str


def sample(type_: Type, least: float | None = None, most: float | None = None) -> str:
    """Return a value of a type as a task file writes it, within limits (SI); empty: there is none that fits anywhere."""
    if type_.name in NUMBERS:
        value = NUMBERS[type_.name]
        value = value if most is None else min(value, most)
        value = value if least is None else max(value, least)
        return format_number(value) if type_.name in ("number", "int") else format_quantity(type_.name, value)
    if type_.name == "enum":
        return type_.values[0] if type_.values else ""
    if type_.name == "list" and type_.item is not None:
        item = sample(type_.item)
        return f"[{item}]" if item else ""
    if type_.name == "record":
        parts = {name: sample(of) for name, of in type_.fields.items()}
        return f"{{{', '.join(f'{name}: {text}' for name, text in parts.items())}}}" if all(parts.values()) else ""
    return TEXTS.get(type_.name, "")


def text_for(kind: AgentType, name: str, file: str, catalogue: Catalogue, site: Site | None) -> str:
    """Return a task that does what a type can."""
    return _Writer(kind, catalogue, site).text(name, file)


class _Writer:
    def __init__(self, kind: AgentType, catalogue: Catalogue, site: Site | None) -> None:
        self.kind = kind
        self.site = site
        self.specs = [spec for spec in actions_of((kind.name,), catalogue) if not spec.cuts]
        word = kind.name
        self.role = "who" if why_taken(word) else word
        self.home = _home_of(kind)

    def text(self, name: str, file: str) -> str:
        """Return the file."""
        label = self.kind.label or self.kind.name
        steps = list(self._steps())
        head = HEAD.format(label=label, file=file, name=name)
        imports = f"\nimports: [{self.home.file}]\n" if self.home is not None and self._rises else ""
        body = "\n".join([f"\nagents:\n  {self.role}:\n    type: {self.kind.name}\n\nsteps:", *steps, ""])
        text = head + imports + body
        return format_text(text, file).text or text

    @property
    def _rises(self) -> bool:
        """Return whether the task brings a machine into the air: only one that has a way home."""
        return self.home is not None and any(takes_off(spec) for spec in self.specs)

    def _steps(self) -> Iterator[str]:
        ways = [spec for spec in self.specs if not takes_off(spec) and spec.effect != "grounded" and not spec.lands]
        low = [spec for spec in ways if spec.requires != "airborne"]
        for spec in low:
            yield from self._step(spec)
        up = next((spec for spec in self.specs if takes_off(spec)), None)
        if up is not None and self._rises and self.home is not None:
            yield from self._step(up)
            for spec in ways:
                if spec not in low:
                    yield from self._step(spec)
            yield f"  - call: {self.home.subtree}\n    with: {{{self.home.param}: '${{{self.role}}}'}}"
        elif not low:
            yield f"  - notify: Nothing to try yet with ${{{self.role}.id}}."

    def _step(self, spec: ActionSpec) -> Iterator[str]:
        if spec.name == CONFIRM:
            yield f"  - ask: Do you read this?\n    of: [{self.role}]\n    options: [yes, no]\n    timeout: 10 min"
            return
        needed = [field for field in spec.fields.values() if not field.optional and field.default is None]
        given = {field.name: self._sample(field) for field in needed}
        lines = [f"- do: {self.role}.{spec.name}"]
        if given:
            lines += ["  with:", *(f"    {name}: {text or '...'}" for name, text in given.items())]
        lines.append(f"  timeout: {format_quantity('duration', float(max(LEAST_S, 3 * spec.typical_us // SECOND)))}")
        start = "  " if all(given.values()) else "  # "
        yield "\n".join(start + line for line in lines)

    def _sample(self, field: FieldSpec) -> str:
        """Return a value of a field: a place and a region of the site where it has them."""
        site = self.site
        if field.type.name == "position" and self.kind.flies:
            return f"${{at_height({self.role}.home, {self.role}.transit_height)}}"
        if field.type.name == "place" and site is not None:
            spots = [one for one in site.places.values() if isinstance(one, Place)]
            return _place(spots[0]) if spots else TEXTS["place"]
        if field.type.name == "region" and site is not None:
            regions = [one for one in site.regions.values() if isinstance(one, Region)]
            return f"[{', '.join(map(_place, regions[0].corners))}]" if regions else ""
        return sample(field.type, field.min, field.max)


def _home_of(kind: AgentType) -> _Home | None:
    if kind.recover is None:
        return None
    return _Home(kind.recover_ref.partition("#")[0], kind.recover.name, next(iter(kind.recover.params)))


def _place(at: Place) -> str:
    return f"{{east: {format_number(at.east_m)} m, north: {format_number(at.north_m)} m}}"
