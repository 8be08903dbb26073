"""`formiga new`: a commented task file to start from. Each kind checks without a warning and flies in `formiga dryrun`."""

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final

import typer

from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.printing import show_next


class StartKind(StrEnum):
    """What a new task does."""

    survey = "survey"
    fetch = "fetch"
    ask = "ask"
    patrol = "patrol"
    empty = "empty"


HEAD: Final = """\
# {what}
#   check it:  formiga check {file}
#   try it:    formiga dryrun {file}{given}
formiga: 1
task: {name}
version: 0.1.0
description: {what}
"""

KINDS: Final[dict[str, tuple[str, str, str]]] = {
    "survey": (
        "A light drone flies over a place, looks for a while, and comes home.",
        " --param target=north_field",
        """\
imports: [lib/flying.yaml]                            # subtrees FlyTo, ReturnHome, ...

params:                                               # what each request says: --param target=...
  target: {type: place, label: Where to look}
  height: {type: distance, default: 40 m, min: 10 m, max: 120 m, label: Height of flight}
  look: {type: duration, default: 30 s, label: How long to look}

agents:                                               # whom the task needs; granted together before the first step
  drone:
    type: lwd                                         # any light drone that is free and fit ...
    near: ${target}                                   # ... the nearest one
    battery_min: 40 %

steps:                                                # one after another; after a failure the drone comes home by itself
  - call: FlyTo
    with:
      drone: ${drone}
      to: ${target}
      height: ${height}
  - wait: ${look}                                     # a real survey: do: drone.Explore with a region
  - call: ReturnHome
    with:
      drone: ${drone}
""",
    ),
    "fetch": (
        "A heavy drone lands beside a person, waits until it is loaded, and brings the load home.",
        " --param target=north_field",
        """\
imports: [lib/flying.yaml]                            # subtrees FlyTo, ReturnHome, ...

params:                                               # what each request says: --param target=...
  target: {type: place, label: Where to fetch}
  height: {type: distance, default: 60 m, min: 10 m, max: 120 m, label: Height of flight}

agents:                                               # whom the task needs; granted together before the first step
  drone:
    type: hwd
    near: ${target}
  picker:
    type: picker                                      # people are shared: they may serve several tasks at once
    near: ${target}

steps:
  - call: FlyTo
    with:
      drone: ${drone}
      to: ${target}
      height: ${height}
  - do: drone.LandIn                                  # away from its port: people are first asked to stand clear
    with:
      at: ${target}
  - ask: Is it loaded, and do you stand 15 m away?
    of: [picker, watchers]                            # the picker first, then whoever watches the site
    options: [loaded, nothing_to_load, not_yet]
    clears: {role: drone, on: [loaded, nothing_to_load]}
    escalate_after: 5 min
    timeout: 15 min
    retry: {attempts: 3, delay: 1 min}
    expect: result.answer != 'not_yet'
  - do: drone.TakeOff
  - call: ReturnHome
    with:
      drone: ${drone}
""",
    ),
    "ask": (
        "Ask people, and notify others of what they said.",
        "",
        """\

params:
  question: {type: text, default: Do you need anything?, label: Question}

agents:
  picker:
    type: picker

steps:
  - ask: ${question}
    of: [picker]
    options: [all_well, water, help]
    timeout: 10 min                                   # nobody may ever answer
    save_as: reply                                    # {answer, by, at}
    ignore_failure: true
  - if: is_set(reply)                                 # nobody answered: there is no reply
    then:
      - switch: reply.answer                          # each answer has its case, or there is a default
        cases:
          all_well:
            - notify: All is well with ${picker.id}.
          water:
            - notify: ${picker.id} needs water.
          help:
            - notify: ${picker.id} needs help.
              severity: alarm
    else:
      - notify: ${picker.id} does not answer.
        severity: warning
""",
    ),
    "patrol": (
        "A light drone circles a place until its charge or the time is up, and comes home.",
        " --param target=north_field",
        """\
imports: [lib/flying.yaml]                            # subtrees FlyTo, ReturnHome, ...

params:
  target: {type: place, label: What to circle}
  radius: {type: distance, default: 20 m, min: 5 m, max: 200 m, label: Radius}
  height: {type: distance, default: 40 m, min: 10 m, max: 120 m, label: Height of flight}
  rounds: {type: int, default: 3, min: 1, max: 100, label: Most rounds}

agents:
  drone:
    type: lwd
    near: ${target}
    battery_min: 60 %

steps:
  - call: FlyTo
    with:
      drone: ${drone}
      to: ${target}
      height: ${height}
  - repeat: ${rounds}
    steps:
      - break_if: drone.battery < 50 %                # leaves the loop; what follows it runs
      - for:                                          # a round: every point of the circle, the first one again at the end
          spot: ${circle(above(target, height), radius, points=8)}
        steps:
          - do: drone.GoTo
            with:
              to: ${spot}
  - call: ReturnHome
    with:
      drone: ${drone}
""",
    ),
    "empty": (
        "Say what it does.",
        "",
        """\

# params:                                             # what each request says
#   target: place
# agents:                                             # whom the task needs
#   drone: {type: lwd, near: "${target}"}

steps:
  - notify: Hello.
""",
    ),
}

_NAME: Final = re.compile(r"[A-Z][A-Za-z0-9]*")


def command(
    name: Annotated[str, typer.Argument(help="The task's name, CamelCase; or `agent`.", metavar="NAME")],
    file: Annotated[
        str,
        typer.Argument(help="After `agent`: its Python file, such as rover.py.", metavar="FILE", show_default=False),
    ] = "",
    kind: Annotated[StartKind, typer.Option(help="What it does.")] = StartKind.survey,
    folder: Annotated[
        Path | None, typer.Option("--in", help="The folder. Default: trees/ if there is one, else this.", metavar="DIR")
    ] = None,
) -> None:
    """Make a task file to start from: it checks without a warning and flies in `formiga dryrun`. Or an agent of your own.

    `formiga new agent rover.py` makes a machine in Python, a task that sends it its first goal, and what of the catalogue and
    the site is not there yet. Exit code 2: the name cannot be one, or the file is there already.
    """
    if name == "agent" or file:
        from formiga_bt.cli.author import new_agent

        if name != "agent" or not file:
            raise UnusableFile("name the agent's Python file", help="such as: formiga new agent rover.py")
        new_agent.make(file, folder)
        return
    if not _NAME.fullmatch(name):
        words = re.findall(r"[A-Za-z0-9]+", name)
        meant = "".join(word[:1].upper() + word[1:] for word in words)
        hint = f"; such as: {meant}" if _NAME.fullmatch(meant) else "; such as: LookAround"
        raise UnusableFile(f"a task's name is CamelCase, this is '{name}'{hint}")
    place = folder if folder is not None else Path("trees") if Path("trees").is_dir() else Path()
    path = place / f"{re.sub(r'(?<=[a-z0-9])(?=[A-Z])', '_', name).lower()}.yaml"
    what, given, body = KINDS[kind.value]
    try:
        place.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as new:
            new.write(HEAD.format(what=what, file=path, given=given, name=name) + body)
    except FileExistsError as error:
        raise UnusableFile(f"{path} is there already; nothing was changed", help="choose another name") from error
    except OSError as error:
        raise UnusableFile(f"cannot write {path}: {error.strerror or error}") from error
    typer.echo(f"made {path}")
    show_next(f"formiga check {path}", f"formiga dryrun {path}{given}")
