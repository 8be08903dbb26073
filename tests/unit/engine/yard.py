"""A small yard for tests of the engine: carts that drive, people that answer, no flying; agents do what the test says."""

import tempfile
from functools import cache
from pathlib import Path

from formiga_bt.lang.loader import load_catalogue, load_site
from formiga_bt.lang.model import Catalogue, Site, Task
from formiga_bt.rehearsal.testing import Bench, ScriptedAgent, task_of

CATALOGUE = """\
types:
  cart:
    label: cart
    mobility: air
    actions: [Rise, Move, Haul, Home, Park]
    recover: back.yaml#Back
    limits: {speed: 10 m/s}
  person:
    label: person
    human: true
    shared: true
    actions: [Confirm]
    suspect_after: 30 s
    lost_after: 5 min
actions:
  Rise: {effect: {airborne: true}, repeatable: true, typical: 1 s}
  Move: {fields: {far: {type: int, default: 1}}, result: {n: int}, repeatable: true, typical: 1 s}
  Haul: {result: {n: int}, typical: 1 s}
  Home: {effect: {airborne: false}, repeatable: true, typical: 1 s}
  Park: {effect: {airborne: false}, repeatable: true, typical: 1 s}
  Confirm:
    fields:
      question: {type: text}
      options: {list: text}
    result: {answer: text, by: text, at: time, form: any}
    repeatable: true
    concurrency: 1
    typical: 1 s
"""
BACK = """\
formiga: 1
subtrees:
  Back:
    params: {one: agent}
    steps:
      - do: one.Home
"""
SITE = """\
formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7, ground_msl: 120 m}
ports:
  a: {at: {east: 0 m, north: 0 m}}
  b: {at: {east: 40 m, north: 0 m}}
  c: {at: {east: 80 m, north: 0 m}}
  d: {at: {east: 120 m, north: 0 m}}
places: {far: {east: 200 m, north: 0 m}}
terrain: {flat: true, relief: 1 m}
people: {watchers: [ann, bob], approvers: [ann]}
agents:
  c1: {type: cart, home: a}
  c2: {type: cart, home: b}
  c3: {type: cart, home: c}
  ann: {type: person}
  bob: {type: person}
mode: MODE
"""

MODES = {"simulation": "simulation", "real": "real\npilots: [{id: pia, max_airborne: 3}]"}


@cache
def yard(mode: str = "simulation") -> tuple[Site, Catalogue]:
    """Return the site and catalogue."""
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        texts = (("catalogue.yaml", CATALOGUE), ("back.yaml", BACK), ("site.yaml", SITE.replace("MODE", MODES[mode])))
        for file, text in texts:
            (here / file).write_text(text, encoding="utf-8")
        catalogue, found, _ = load_catalogue([here / "catalogue.yaml"], [here])
        assert not found, found
        site, found, _ = load_site(here / "site.yaml")
        assert site is not None, found
        return site, catalogue


def task(text: str, name: str = "Try") -> Task:
    """Return a checked task."""
    return task_of(text, *yard(), name=name)


CART = "agents: {cart: {type: cart}}\n"
TWO = "agents: {cart: {type: cart}, ann: {type: person, id: '${who}'}}\nparams: {who: {type: agent, of: [person]}}\n"


class Yard(Bench):
    """A bench with one cart `c1`, whose moves take a second, and `ann`; the tasks given, or one called Try."""

    def __init__(self, *tasks: Task | str, carts: int = 1, people: int = 1, mode: str = "simulation") -> None:
        made = [t if isinstance(t, Task) else task(t) for t in tasks]
        super().__init__(*yard(mode), made)
        self.carts = [self.agent(f"c{i + 1}", "cart") for i in range(carts)]
        self.people = [self.agent(name, "person") for name in ("ann", "bob")[:people]]
        self.run_for(0.5)

    @property
    def cart(self) -> ScriptedAgent:
        """Return c1."""
        return self.carts[0]

    @property
    def ann(self) -> ScriptedAgent:
        """Return ann."""
        return self.people[0]

    def start(self, name: str = "Try", **params: object) -> str:
        """Submit a task and let its first goals arrive."""
        found = self.submit(name, params)
        self.run_for(0.2)
        return found

    def end(self, task_id: str, limit_s: float = 600) -> tuple[str, str]:
        """Run until a task has ended; return its status and code."""
        assert self.run_until_ended(task_id, limit_s=limit_s), self.task(task_id)
        return self.outcome(task_id)

    def outcome(self, task_id: str) -> tuple[str, str]:
        """Return a task's status and code."""
        return self.task(task_id).status, self.task(task_id).outcome.code
