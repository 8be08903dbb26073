"""Flies the ten missions as dry runs and draws their Gantt charts and maps as SVG: `make pictures`. The same each time.

python docs/pictures/make_flights.py [FOLDER [ENDING [SCENARIO...]]]
"""

import sys
from pathlib import Path

from formiga_bt.cli.app import run as formiga
from formiga_bt.cli.author.flown import draw_steps
from formiga_bt.cli.integrator.scenarios import read_scenario
from formiga_bt.rehearsal.simulation import VirtualRun, site_of

MISSIONS = {
    "MoveTask": ["robot=lwd_1"],
    "ExploreRegion": ["region=lake"],
    "PickUp": ["target=north_field", "user=picker_1"],
    "WatchDogSOS": ["alarmtype=sos", "target=lake_shore"],
    "WatchDogRequest": ["alarmtype=lost", "target=north_field", "username=picker_2"],
    "Circle": ["center=north_field", "radius=30 m", "points=12"],
    "Triangle": ["corner=north_field", "leg=60 m"],
    "ZigZag": ["start=south_field", "end=lake_shore", "amplitude=30 m"],
    "PatrolAndEscort": ["target=west_field"],
    "Delivery": ["target=north_field", "next_stop=east_field"],
}
"""What of the demo site each mission is flown with."""


def make(folder: Path, ending: str = ".svg", scenarios: tuple[str, ...] = ()) -> None:
    """Write all pictures into `gantt` and `map` of a folder."""
    for kind in ("gantt", "map"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    for mission, params in MISSIONS.items():
        outs = [word for kind in ("gantt", "map") for word in (f"--{kind}", str(folder / kind / f"{mission}{ending}"))]
        given = [word for param in params for word in ("--param", param)]
        code = formiga(["dryrun", mission, "--site", "demo", *given, *outs])
        if code:
            raise SystemExit(f"{mission} ended with {code}")
    for name in scenarios:
        scenario = read_scenario(name)
        run = VirtualRun(scenario)
        run.run()
        run.close()
        paths = [folder / kind / f"{name}{ending}" for kind in ("gantt", "map")]
        draw_steps(run.steps, site_of(scenario), list(scenario.tasks.values()), *paths)


if __name__ == "__main__":
    given = sys.argv[1:]
    make(
        Path(given[0]) if given else Path(__file__).parent,
        given[1] if len(given) > 1 else ".svg",
        tuple(given[2:]),
    )
