"""Tasks that people write and that are good, though an earlier checker refused or blamed them; each beside a twin that is bad.

What the twins have in common with the good ones is the mechanism: a check that is only switched off fails here.
"""

from collections.abc import Callable
from textwrap import indent

import pytest
from msgspec.structs import replace

from formiga_bt.lang.loader import Loaded
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.site import load_site_text

Load = Callable[[str], Loaded]

ROUND = """\
          - call: FlyTo
            with: {drone: "${drone}", to: "${target}", height: 60 m}
          - call: ReturnHome
            with: {drone: "${drone}"}
"""
HELPER = f"""\
      - with_agents:
          drone: {{type: lwd, near: "${{target}}"}}
        steps:
{ROUND}"""
FLYING = "imports: [lib/flying.yaml]\nparams: {target: place}\n"
WATCHER = "agents: {watcher: {type: watcher}}\n"
HELD = 'agents: {watcher: {type: watcher}, drone: {type: lwd, near: "${target}"}}\n'
NOBODY = "      - notify: Nobody could fly.\n        to: [watcher]\n"

OVER_POSTS = """\
  - for: {post: "${posts}"}
    steps:
      - do: drone.TakeOff
        when: not drone.airborne
      - do: drone.GoTo
        with: {to: "${above(post, 60 m)}"}
"""
HOME = """\
  - do: drone.GoTo
    with: {to: "${above(drone.home, 60 m)}"}
  - do: drone.LandIn
    with: {at: "${drone.home}"}
"""
POSTS = (
    "params: {posts: {type: {list: place}}, who: {type: agent, of: [lwd]}, all: {type: bool, default: false}}\n"
    'agents: {drone: {type: lwd, id: "${who}"}}\nsteps:\n'
)
POSTS_READ = 'params: {posts: {type: {list: place}}}\nagents: {drone: {type: lwd, near: "${first(posts)}"}}\nsteps:\n'

SURVEY = """\
{agents}steps:
  - with_agents:
      drone: {{type: lwd, near: "${{centroid(field)}}"}}
    retry: {retry}
    steps:
      - call: FlyTo
        with: {{drone: "${{drone}}", to: "${{centroid(field)}}", height: 60 m}}
      - do: {who}.Explore
        with: {{region: "${{field}}", altitude: 60 m}}
        timeout: 30 min
      - call: ReturnHome
        with: {{drone: "${{drone}}"}}
"""
FIELD = "imports: [lib/flying.yaml]\nparams: {field: region}\n"

LOOK = """\
subtrees:
  Look:
    params: {drone: agent, at: place}
    steps:
      - do: drone.TakeOff
      - do: drone.GoTo
        with: {to: "${above(at, 60 m)}"}
"""
LANDED = """\
steps:
  - call: FlyAndLand
    with: {drone: "${drone}", at: "${target}"}
"""
BACK = """\
  - call: ReturnHome
    with: {drone: "${drone}"}
"""
GO_LOOK = '  - call: Look\n    with: {drone: "${drone}", at: "${target}"}\n'

PICKER = "agents: {picker: {type: picker}}\nsteps:\n"
FIND = '  - do: picker.MiniFinder\n    with: {base: "${base}"}\n    timeout: 1 min\n'

HEARD = """\
records: {find: {spot: place, how: {type: enum, values: [seen, heard]}}}
vars: {finds: {type: {list: find}}}
steps:
  - call: Hear
    save_as: found
  - set: {finds: "${[found]}"}
  - notify: ${finds[0].spot} ${finds[0].how}
    when: is_set(finds)
"""
RETURNS = """\
subtrees:
  Hear:
    steps:
      - wait: 1 s
    returns: {{spot: "${{base}}", how: "{how}"}}
"""

CASES = {
    "W069: machines of a block are brought home before what comes next": (
        FLYING + WATCHER + "steps:\n  - fallback:\n" + HELPER + NOBODY,
        FLYING + HELD + "steps:\n  - fallback:\n      - sequence:\n" + ROUND + NOBODY,
    ),
    "W069: so are those of a block that is ignored": (
        FLYING + "steps:\n" + HELPER.replace("      - with", "      - ignore_failure: true\n        with"),
        FLYING + HELD + "steps:\n      - ignore_failure: true\n        sequence:\n" + ROUND,
    ),
    "E030: a list of more than one has a round": (
        POSTS + "  - check: len(posts) > 1\n" + OVER_POSTS + HOME,
        POSTS + "  - check: len(posts) < 3\n" + OVER_POSTS + HOME,
    ),
    "E030: the other way about, and both ends": (
        POSTS + "  - check: 1 <= len(posts) and len(posts) < 9\n" + OVER_POSTS + HOME,
        POSTS + "  - check: 1 <= len(posts) or all\n" + OVER_POSTS + HOME,
    ),
    "E030: a role near its first item has one": (POSTS_READ + OVER_POSTS + HOME, POSTS + OVER_POSTS + HOME),
    "E031: home if there was a round": (
        POSTS + OVER_POSTS + "  - if: len(posts) > 0\n    then:\n" + indent(HOME, "    "),
        POSTS + OVER_POSTS + "  - if: len(posts) > 1\n    then:\n" + indent(HOME, "    "),
    ),
    "E046: another machine may do what this one may not do twice": (
        FIELD + SURVEY.format(agents="", retry="{attempts: 2, agent: another}", who="drone"),
        FIELD + SURVEY.format(agents="", retry="{attempts: 2}", who="drone"),
    ),
    "E046: but not the machine that the task holds": (
        FIELD + SURVEY.format(agents="", retry="{attempts: 3, delay: 10 s, agent: another}", who="drone"),
        FIELD
        + SURVEY.format(
            agents='agents: {eye: {type: lwd, near: "${centroid(field)}"}}\n',
            retry="{attempts: 2, agent: another}",
            who="eye",
        ),
    ),
    "W060: a name that only expect reads": (
        PICKER + FIND + "    save_as: fix\n    expect: fix.in_range\n",
        PICKER + FIND + "    save_as: fix\n    expect: result.in_range\n",
    ),
    "E013: people read any value": (
        "params: {n: {type: int, default: 3}, far: {type: distance, default: 60 m}, at: time}\n"
        + "steps:\n  - notify: ${n}\n  - notify: ${far}\n  - check: n > 2\n    message: ${at}\n",
        "params: {n: {type: int, default: 3}}\nsteps:\n  - call: Say\n    with: {text: '${n}'}\n"
        + "subtrees:\n  Say:\n    params: {text: text}\n    steps:\n      - notify: ${text}\n",
    ),
    "E013: a word that is chosen fits the enum of a record": (
        HEARD + RETURNS.format(how="${'seen' if now > today('12:00') else 'heard'}"),
        HEARD + RETURNS.format(how="${'seen' if now > today('12:00') else 'smelt'}"),
    ),
    "W095: a subtree that leaves the ground itself": (
        FLYING + HELD + LANDED + GO_LOOK + BACK + LOOK,
        FLYING + HELD + LANDED + "  - do: drone.TakeOff\n" + BACK,
    ),
    "W095: a landing at its port, by a param": (
        FLYING + HELD + LANDED.replace("${target}", "${drone.home}") + "  - do: drone.TakeOff\n" + BACK,
        FLYING + HELD + LANDED + "  - do: drone.TakeOff\n" + BACK,
    ),
}


def codes(load: Load, text: str) -> set[str]:
    unused = {"'watcher'", "'all'", "'target'"}  # beside the point here
    found = load(text).diagnostics
    return {one.code for one in found if not any(word in one.message and one.code == "W060" for word in unused)}


@pytest.mark.parametrize("name", CASES)
def test_the_good_one_is_not_blamed(name: str, load: Load) -> None:
    assert codes(load, CASES[name][0]) == set()


@pytest.mark.parametrize("name", CASES)
def test_its_bad_twin_still_is(name: str, load: Load) -> None:
    assert name.partition(":")[0] in codes(load, CASES[name][1])


SITE = """\
formiga_site: 1
name: yard
base: {lat: 66.5, lng: 25.7, ground_msl: 120 m}
ports:
  p1: {at: {east: 0 m, north: 20 m}, waiting: {east: 0 m, north: 40 m, height: 45 m}}
  p2: {at: {east: 30 m, north: 20 m}, waiting: {east: 30 m, north: 40 m, height: WAITS}}
layers: [60 m, 75 m, 90 m]
agents: {hwd_1: {type: hwd, home: p1}, crane_1: {type: crane, home: p2}}
"""


@pytest.mark.parametrize(
    ("highest_m", "waits", "found"),
    [
        (60.0, "45 m", []),
        (50.0, "45 m", ["E082"]),  # there is no layer that it could cross in
        (60.0, "70 m", ["E082"]),  # it could not wait there for its own port
    ],
)
def test_a_machine_that_flies_lower_than_others_crosses_in_a_low_layer(
    highest_m: float, waits: str, found: list[str], catalogue: Catalogue
) -> None:
    """The crane of docs/site.md beside the site of that page."""
    heavy = catalogue.types["hwd"]
    crane = replace(heavy, name="crane", limits={**heavy.limits, "max_height_m": highest_m})
    types = {**catalogue.types, "crane": crane}

    _, told, _ = load_site_text(SITE.replace("WAITS", waits), "site.yaml", replace(catalogue, types=types))

    assert [one.code for one in told] == found
