"""Sites to practise on: other places, fleets and agent types each time, and verbs by other names in another order.

Every practice has two worlds. In the flown one agent types and the site are new, and actions have the names of the shipped
catalogue, which the simulated machines obey. In the shown one actions, their fields and the subtrees of the library have new
names too; a prompt is made of it, and the checker reads every renamed tree against it.
"""

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import yaml
from msgspec import structs

from experiments.e2_llm.train.renaming import Renaming, catalogue_of, library_of, verbs_renamed
from experiments.e2_llm.train.speaker import Spot, side_in
from formiga_bt.base.geo import Frame, Place
from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.model import Site
from formiga_bt.llm.prompt import brief_prompt
from formiga_bt.llm.vocabulary import AgentVerb, offered, verbs_of
from formiga_bt.llm.world import RequestWorld

PLACES: Final[Mapping[str, tuple[str, str]]] = {
    "barn": ("the barn", "el granero"),
    "old_mill": ("the old mill", "el molino viejo"),
    "orchard": ("the orchard", "el huerto"),
    "bridge": ("the bridge", "el puente"),
    "quarry": ("the quarry", "la cantera"),
    "dam": ("the dam", "la presa"),
    "greenhouse": ("the greenhouse", "el invernadero"),
    "silo": ("the silo", "el silo"),
    "well": ("the well", "el pozo"),
    "chapel": ("the chapel", "la capilla"),
    "lookout": ("the lookout", "el mirador"),
    "pond": ("the pond", "el estanque"),
    "sawmill": ("the sawmill", "el aserradero"),
    "radio_mast": ("the radio mast", "la antena"),
    "meadow": ("the meadow", "el prado"),
    "ridge": ("the ridge", "la cresta"),
    "hut": ("the hut", "la cabaña"),
    "jetty": ("the jetty", "el muelle"),
    "depot": ("the depot", "el depósito"),
    "crossing": ("the crossing", "el cruce"),
    "stable": ("the stable", "el establo"),
    "spring": ("the spring", "el manantial"),
    "clearing": ("the clearing", "el claro"),
    "hill_top": ("the hill top", "la colina"),
    "south_gate": ("the south gate", "la puerta sur"),
    "car_park": ("the car park", "el aparcamiento"),
    "pump_house": ("the pump house", "la caseta de bombeo"),
    "vineyard": ("the vineyard", "el viñedo"),
    "plot_a": ("plot A", "la parcela A"),
    "plot_b": ("plot B", "la parcela B"),
    "row_12": ("row 12", "la hilera 12"),
    "checkpoint_2": ("checkpoint 2", "el punto de control 2"),
    "north_slope": ("the north slope", "la ladera norte"),
    "east_bank": ("the east bank", "la orilla este"),
    "ferry": ("the ferry", "el transbordador"),
    "yard": ("the yard", "el patio"),
    "north_field": ("the north field", "el campo norte"),
    "upper_meadow": ("the upper meadow", "el prado alto"),
    "old_bridge": ("the old bridge", "el puente viejo"),
    "small_pond": ("the small pond", "el estanque pequeño"),
    "forest_edge": ("the forest edge", "el borde del bosque"),
    "west_parking": ("the west parking", "el aparcamiento oeste"),
    "river_path": ("the river path", "el sendero del río"),
    "church": ("the church", "la iglesia"),
    "old_farm": ("the old farm", "la granja vieja"),
    "garden": ("the garden", "el jardín"),
    "east_hill": ("the east hill", "la colina del este"),
    "warehouse": ("the warehouse", "el almacén"),
    "village_square": ("the village square", "la plaza del pueblo"),
    "lower_field": ("the lower field", "el campo bajo"),
}
REGIONS: Final[Mapping[str, tuple[str, str]]] = {
    "marsh": ("the marsh", "la marisma"),
    "grove": ("the grove", "la arboleda"),
    "pasture": ("the pasture", "el pasto"),
    "beach": ("the beach", "la playa"),
    "heath": ("the heath", "el brezal"),
    "delta": ("the delta", "el delta"),
    "reed_bed": ("the reed bed", "el carrizal"),
    "young_forest": ("the young forest", "el bosque joven"),
}
KINDS: Final[Mapping[str, tuple[tuple[str, str, str], ...]]] = {
    "lwd": (
        ("lwd", "light drone", "dron ligero"),
        ("lwd", "light drone", "dron ligero"),
        ("scout", "scout drone", "dron explorador"),
        ("quad", "quadcopter", "cuadricóptero"),
        ("mini", "mini drone", "minidron"),
        ("swift", "swift drone", "dron rápido"),
        ("eye", "camera drone", "dron con cámara"),
    ),
    "hwd": (
        ("hwd", "heavy drone", "dron pesado"),
        ("hwd", "heavy drone", "dron pesado"),
        ("carrier", "carrier drone", "dron de carga"),
        ("hexa", "hexacopter", "hexacóptero"),
        ("mule", "mule drone", "dron mula"),
        ("lifter", "lifter drone", "dron elevador"),
    ),
    "picker": (
        ("picker", "picker", "recolector"),
        ("picker", "picker", "recolector"),
        ("ranger", "ranger", "guarda"),
        ("farmer", "farmer", "agricultor"),
        ("hiker", "hiker", "senderista"),
    ),
    "watcher": (
        ("watcher", "watcher", "vigilante"),
        ("watcher", "watcher", "vigilante"),
        ("operator", "operator", "operador"),
        ("foreman", "foreman", "capataz"),
        ("doctor", "doctor", "médico"),
    ),
}
"""Agent types: name, label, in Spanish; the shipped names more often than the others."""
SITES: Final = (
    "valley",
    "finca",
    "north_station",
    "estate",
    "hillside",
    "granja",
    "riverside",
    "campus",
    "upland",
    "soto",
)


@dataclass(frozen=True, slots=True)
class Practice:
    """A site to practise on."""

    number: int
    flown: RequestWorld
    verbs: Mapping[str, AgentVerb]
    shown: RequestWorld
    shown_verbs: Mapping[str, AgentVerb]
    renaming: Renaming
    system: str
    kinds: Mapping[str, tuple[str, str, str]]
    """Shipped type -> name, label, in Spanish."""
    ids: Mapping[str, tuple[str, ...]]
    """Shipped type -> agents of it."""

    def spot(self, name: str) -> Spot:
        """Return a place or region by name."""
        en, es = (PLACES | REGIONS)[name]
        return Spot(name, en, es, (name,))

    def beside(self, name: str, side: str, m: int) -> Spot:
        """Return a spot so far to one side of a place."""
        en, es = PLACES[name]
        return Spot(
            f"offset({name}, {side}={m} m)",
            f"{m} m {side} of {en}",
            f"{m} m al {side_in('es', side)} de {es}",
            (name,),
        )

    def degrees(self, east_m: float, north_m: float, form: int) -> Spot:
        """Return a spot by its degrees."""
        site = self.flown.site
        lat, lng = Frame(site.lat, site.lng, site.ground_msl_m).lat_lng(Place(east_m, north_m))
        said = (f"{lat:.5f}, {lng:.5f}", f"{lat:.5f} N {lng:.5f} E", f"lat {lat:.5f} lng {lng:.5f}")[form]
        return Spot(f"{lat:.5f}, {lng:.5f}", said, said)


def practice(number: int, seed: int) -> Practice:
    """Return the practice of a number, always the same."""
    rng = random.Random(f"site/{seed}/{number}")
    kinds = {key: rng.choice(options) for key, options in KINDS.items()}
    renaming = Renaming.drawn(rng, {key: one[:2] for key, one in kinds.items()})
    ids = {key: tuple(f"{kinds[key][0]}_{i + 1}" for i in range(rng.randint(*_HOW_MANY[key]))) for key in KINDS}
    with TemporaryDirectory() as name:
        place = Path(name)
        flown_catalogue, _, _ = load_catalogue(
            [_written(place / "flown.yaml", catalogue_of(renaming.types_only(), _base()))]
        )
        (place / "site.yaml").write_text(_site(rng, kinds, ids), encoding="utf-8")
        site, problems, _ = load_site(place / "site.yaml", flown_catalogue)
        wrong = [one for one in problems if one.severity == "error"]
        if site is None or wrong:
            raise AssertionError(f"practice {number}: {wrong}")
    flown = RequestWorld(flown_catalogue, _people_aside(site))
    verbs = verbs_of(flown)
    shown = _shown(renaming, site)
    shown_verbs = verbs_renamed(verbs, renaming)
    told = list(verbs_renamed(offered(verbs), renaming))
    if rng.random() < 0.7:
        rng.shuffle(told)
    system = renaming.text(brief_prompt(shown, {name: shown_verbs[name] for name in told}))
    return Practice(number, flown, verbs, shown, shown_verbs, renaming, system, kinds, ids)


def _people_aside(site: Site) -> Site:
    """Return a site whose simulated people stand where nobody lands, and say so.

    They are put at its first places; the engine asks `watchers`, whatever the site calls them.
    """
    aside = {f"aside_{i + 1}": Place(10.0 * i, -20.0) for i in range(4)}
    watchers = tuple(one for members in site.people.values() for one in members)
    return structs.replace(site, places={**aside, **site.places}, people={**site.people, "watchers": watchers})


_HOW_MANY: Final = {"lwd": (2, 4), "hwd": (1, 3), "picker": (1, 2), "watcher": (1, 2)}


@cache
def _base() -> Any:
    return yaml.safe_load((folder("actions") / "base.yaml").read_text(encoding="utf-8"))


def library_folder(renaming: Renaming, root: Path) -> Path:
    """Write the shipped libraries with other names; return the folder."""
    (root / "lib").mkdir(parents=True, exist_ok=True)
    for path in sorted((folder("trees") / "lib").glob("*.yaml")):
        _written(root / "lib" / path.name, library_of(renaming, yaml.safe_load(path.read_text(encoding="utf-8"))))
    return root


_FOLDERS: Final[list[TemporaryDirectory[str]]] = []


def _shown(renaming: Renaming, site: Any) -> RequestWorld:
    """Return the shown world; its library lies in a folder for as long as the program runs."""
    kept = TemporaryDirectory()
    _FOLDERS.append(kept)
    root = library_folder(renaming, Path(kept.name))
    catalogue, problems, _ = load_catalogue([_written(root / "catalogue.yaml", catalogue_of(renaming, _base()))])
    wrong = [one for one in problems if one.severity == "error"]
    if wrong:
        raise AssertionError(wrong[0].message)
    return RequestWorld(catalogue, site, (root,))


def _written(path: Path, data: Any) -> Path:
    path.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=1000), encoding="utf-8")
    return path


def _site(rng: random.Random, kinds: Mapping[str, tuple[str, str, str]], ids: Mapping[str, Sequence[str]]) -> str:
    names = rng.sample(sorted(PLACES), rng.randint(4, 8))
    regions = rng.sample(sorted(REGIONS), rng.randint(1, 2))
    machines = [*ids["lwd"], *ids["hwd"]]
    spots = _spread(rng, len(names) + len(regions))
    at = dict(zip([*names, *regions], spots, strict=True))
    ports = {
        f"p{i + 1}": {
            "at": _xy(30 * i - 105, 40),
            "waiting": _xy(30 * i - 105, 80) | {"height": "45 m"},
        }
        for i in range(len(machines) + 1)
    }
    data = {
        "formiga_site": 1,
        "name": rng.choice(SITES),
        "base": {
            "lat": round(rng.uniform(36, 68), 3),
            "lng": round(rng.uniform(1, 30), 3),
            "ground_msl": f"{rng.randint(2, 400)} m",
        },
        "ports": ports,
        "places": {name: _xy(*at[name]) for name in names},
        "regions": {name: [_xy(x, y) for x, y in _corners(rng, at[name])] for name in regions},
        "fence": [_xy(-600, -600), _xy(600, -600), _xy(600, 600), _xy(-600, 600)],
        "terrain": {"flat": True, "relief": "5 m"},
        "layers": ["60 m", "75 m", "90 m"],
        "separation": "15 m",
        "people": {f"{kinds['watcher'][0]}s": list(ids["watcher"])},
        "agents": {
            **{name: {"type": name.rsplit("_", 1)[0], "home": f"p{i + 1}"} for i, name in enumerate(machines)},
            **{name: {"type": name.rsplit("_", 1)[0]} for key in ("picker", "watcher") for name in ids[key]},
        },
        "transports": {"zenoh": {"listen": "tcp/127.0.0.1:7447"}},
        "mode": "simulation",
    }
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True)


def _xy(east: int, north: int) -> dict[str, str]:
    return {"east": f"{east} m", "north": f"{north} m"}


def _spread(rng: random.Random, count: int) -> list[tuple[int, int]]:
    """Return spots at least 100 m from each other and from the ports."""
    found: list[tuple[int, int]] = []
    while len(found) < count:
        spot = (rng.randrange(-400, 401, 10), rng.randrange(-400, 401, 10))
        clear = abs(spot[1] - 40) > 100 or abs(spot[0]) > 250
        if clear and all(math.dist(spot, one) >= 100 for one in found):
            found.append(spot)
    return found


def _corners(rng: random.Random, at: tuple[int, int]) -> list[tuple[int, int]]:
    wide, deep = rng.randrange(60, 121, 10), rng.randrange(60, 121, 10)
    x, y = at
    return [(x, y), (x + wide, y), (x + wide, y + deep), (x, y + deep)]
