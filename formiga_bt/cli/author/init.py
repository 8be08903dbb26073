"""`formiga init`: a folder to start from, with a site and a first task that flies."""

import re
import shlex
import unicodedata
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.printing import show_next

SITE = """\
# Your site: where things are, and who works here. Metres are counted east and north from the base station.
formiga_site: 1
name: {name}
base: {{lat: 66.5, lng: 25.7, ground_msl: 120 m}}      # where the base station stands

# Each drone has a port of its own, where it starts and lands. `waiting` is where it hovers while its port is not free.
ports:
  p1: {{at: {{east: -30 m, north: 40 m}}, waiting: {{east: -30 m, north: 80 m, height: 45 m}}}}
  p2: {{at: {{east: 0 m, north: 40 m}}, waiting: {{east: 0 m, north: 80 m, height: 45 m}}}}
  p3: {{at: {{east: 30 m, north: 40 m}}, waiting: {{east: 30 m, north: 80 m, height: 45 m}}}}

# Names that tasks, and `formiga run --param target=camp`, may use. {{lat: 66.501, lng: 25.703}} works as well.
places:
  camp: {{east: 30 m, north: -40 m}}
  north_field: {{east: 20 m, north: 260 m}}
  lake_shore: {{east: 180 m, north: -160 m}}
regions:
  bog: [north_field, {{east: 140 m, north: 260 m}}, {{east: 140 m, north: 340 m}}, {{east: 20 m, north: 340 m}}]

# Corners. A request with a place outside is refused, `formiga check --site` warns of one written in a task, and no machine is
# sent out of it, whatever a task computes while it runs.
fence:
  - {{east: -600 m, north: -600 m}}
  - {{east: 600 m, north: -600 m}}
  - {{east: 600 m, north: 600 m}}
  - {{east: -600 m, north: 600 m}}
terrain: {{flat: true, relief: 5 m}}
layers: [60 m, 75 m, 90 m]                            # heights at which drones of different tasks cross
people: {{watchers: [watcher_1]}}
agents:
  lwd_1: {{type: lwd, home: p1}}                        # light drone
  lwd_2: {{type: lwd, home: p2}}
  hwd_1: {{type: hwd, home: p3}}                        # heavy drone
  picker_1: {{type: picker}}
  watcher_1: {{type: watcher}}
transports: {{zenoh: {{listen: tcp/127.0.0.1:7447}}}}     # where agents connect
mode: simulation                                      # `real` admits only the agents listed above
"""

HELLO = """\
# A first task: a light drone flies over a place, looks for a while, and comes home.
#   check it:  formiga check trees/hello.yaml --site site.yaml
#   try it:    formiga dryrun trees/hello.yaml --site site.yaml     (simulated, in virtual time)
#   fly it:    formiga up --sim     and in another terminal:  formiga run Hello --follow
formiga: 1
task: Hello
description: Fly over a place, look for a while, come home.

params:                                   # what may be said at each request: --param target=lake_shore
  target: {type: place, default: camp, label: Where to look}
  height: {type: distance, default: 40 m, min: 10 m, max: 120 m}

agents:                                   # roles: whom the task needs; all are granted together
  drone:
    type: lwd                             # any light drone that is free and at its port ...
    near: ${target}                       # ... the nearest one

steps:                                    # one after another; the first that fails ends the task, the drone comes home
  - do: drone.TakeOff
  - do: drone.GoTo
    with:
      to: ${above(target, height)}        # a place is on the ground; above() makes a position in the air of it
  - wait: 10 s
  - do: drone.GoTo                        # back, at the height that is this drone's own
    with:
      to: ${at_height(drone.home, drone.transit_height)}
  - do: drone.LandIn
    with:
      at: ${drone.home}
"""


def command(
    folder: Annotated[Path, typer.Argument(help="The folder; made if it is not there.", metavar="DIR")] = Path("."),
) -> None:
    """Make a folder to start from: site.yaml with named places, and trees/hello.yaml, a first task that flies."""
    files = {
        folder / "site.yaml": SITE.format(name=site_name(folder)),
        folder / "trees" / "hello.yaml": HELLO,
        folder / ".gitignore": ".formiga/\n",
    }
    if folder.exists() and not folder.is_dir():
        raise UnusableFile(f"{folder} is a file, not a folder; nothing was changed", help="name another folder")
    there = [str(path) for path in files if path.exists() and path.name != ".gitignore"]
    if there:
        raise UnusableFile(f"{', '.join(there)}: there already; nothing was changed", help="name another folder")
    try:
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                path.write_text(text, encoding="utf-8")
                typer.echo(f"made {path}")
    except OSError as error:
        raise UnusableFile(f"cannot write in {folder}: {error.strerror or error}") from error
    words = shlex.quote(str(folder))
    first = "" if folder.resolve() == Path.cwd() else f"cd {'-- ' if words.startswith('-') else ''}{words} && "
    show_next(f"{first}formiga up --sim", f"{first}formiga dryrun trees/hello.yaml --site site.yaml")


def site_name(folder: Path) -> str:
    """Return a name for the site of a folder: that of the folder, as far as it can be one."""
    plain = unicodedata.normalize("NFKD", folder.resolve().name)
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    word = re.sub(r"[^A-Za-z0-9_]+", "_", plain).strip("_")
    return word if re.match(r"[A-Za-z]", word) else f"site_{word}".rstrip("_")
