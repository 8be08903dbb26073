"""`formiga new agent rover.py`: an agent of one's own to start from, with a task that sends it its first goal.

The agent's type is the file's name. Where the site's catalogue has such a type, the file gets a method for each of its actions;
where it has none, it gets one action of its own, and a catalogue file is written beside it.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import typer

from formiga_bt.base.endpoints import is_tls
from formiga_bt.cli.author.first_task import sample
from formiga_bt.cli.author.init import site_name
from formiga_bt.cli.inputs import CheckWorld, UnusableFile, read_world
from formiga_bt.cli.printing import show_next
from formiga_bt.lang.model import ActionSpec, AgentType
from formiga_bt.lang.types import Type

ANNOTATIONS: Final[Mapping[str, str]] = {
    "number": "float", "int": "int", "text": "str", "bool": "bool", "percent": "Percent", "distance": "Metres",
    "duration": "Seconds", "speed": "MetresPerSecond", "angle": "Degrees", "mass": "Kilograms", "time": "Time",
    "place": "Place", "position": "Position", "region": "Region", "agent": "AgentId",
}  # fmt: skip

SAMPLES: Final[Mapping[str, str]] = {
    "number": "0.0", "int": "0", "text": '""', "bool": "False", "percent": "0.0", "distance": "0.0", "duration": "0.0",
    "speed": "0.0", "angle": "0.0", "mass": "0.0", "time": "self.now()", "place": "Place(0.0, 0.0)",
    "position": "Position(0.0, 0.0, 0.0)", "region": "Region(())", "agent": "self.id",
}  # fmt: skip
"""A value of each type in Python; in a task file: `first_task.sample`."""

SITE: Final = """\
# A small site for trying agents. Metres are counted east and north from the base station.
formiga_site: 1
name: {site}
base: {{lat: 66.5, lng: 25.7, ground_msl: 120 m}}
fence:
  - {{east: -100 m, north: -100 m}}
  - {{east: 100 m, north: -100 m}}
  - {{east: 100 m, north: 100 m}}
  - {{east: -100 m, north: 100 m}}
actions: [base{catalogue}]
agents:
  {agent}: {{type: {kind}}}
transports: {{zenoh: {{listen: {listen}}}}}
mode: simulation
"""

OWN: Final = '''\
    @action(moves_to="to", repeatable=True)
    async def {action}(self, to: Place, speed: Annotated[MetresPerSecond, Between(0.1, 2.0)] = 1.0) -> None:
        """Go to a place and look around there."""
        here = self.at
        seconds = math.hypot(to.east_m - here.east_m, to.north_m - here.north_m) / speed
        for tenth in range(1, 11):
            await self.sleep(seconds / 10)  # your machine drives; a cancel arrives here, as asyncio.CancelledError
            share = tenth / 10
            self.at = Place(
                here.east_m + share * (to.east_m - here.east_m), here.north_m + share * (to.north_m - here.north_m)
            )
            self.status(pose=self.at)
            self.feedback(progress=share)
'''

HEAD: Final = '''\
"""{doc}

Run it:  python {file}           (the engine: formiga up)
"""

{imports}


class {name}(Agent, type="{kind}", mobility="{mobility}"{more}):
    """{summary}"""

'''


def make(file: str, folder: Path | None) -> None:
    """Write an agent, its catalogue entry if none is known, a task that tries it, and a site if there is none.

    Raises:
        UnusableFile: the name cannot be one, or a file is there already.
    """
    path = (folder or Path()) / file
    kind = path.stem
    if path.suffix != ".py" or not re.fullmatch(r"[a-z][a-z0-9_]*", kind):
        raise UnusableFile(f"an agent is a Python file in small letters, this is '{file}'", help="such as: rover.py")
    root = path.parent
    site_file = root / "site.yaml"
    world = read_world(site=site_file) if site_file.exists() else read_world()
    site, listen = _site_of(site_file, root)
    name, agent = _camel(kind), f"{kind}_1"
    known = world.catalogue.types.get(kind)
    if known is not None and known.human:
        raise UnusableFile(f"a {kind} is a person, and no program", help="choose another name, such as: rover.py")
    own = root / "actions" / f"{kind}.yaml"
    task = root / "trees" / f"try_{kind}.yaml"
    own_steps = _step(kind, f"Visit{name}", ["to: {east: 10 m, north: 5 m}"])
    steps = own_steps if known is None else _steps(known, world)
    files = {path: _agent(name, kind, path.name, agent, site, listen, known, world, f"Visit{name}")}
    if known is None:
        files[own] = ""  # written by the class itself, below
    if steps:
        files[task] = _task(name, kind, steps)
    if not site_file.exists():
        own_name = f", actions/{kind}.yaml" if known is None else ""
        files[site_file] = SITE.format(site=site, agent=agent, kind=kind, listen=listen, catalogue=own_name)
    there = [str(one) for one in files if one.exists()]
    if there:
        raise UnusableFile(f"{', '.join(there)}: there already; nothing was changed", help="choose another name")
    if known is None:
        files[own] = _catalogue(files[path], path)
    try:
        for one, text in files.items():
            one.parent.mkdir(parents=True, exist_ok=True)
            one.write_text(text, encoding="utf-8")
            typer.echo(f"made {one}")
    except OSError as error:
        raise UnusableFile(f"cannot write in {root}: {error.strerror or error}") from error
    more = f" --actions {own}" if known is None and site_file not in files else ""
    where = f" --site {site_file}" if root != Path() else ""
    keys = f" --keys .formiga/{site}/keys/{agent}" if is_tls(listen) else ""
    show_next(
        *([f"formiga access agent {agent}{where}"] if keys else []),
        f"formiga up{more}{where}",
        f"python {path}{keys}",
        *([f"formiga run Try{name} --follow{where}"] if steps else []),
    )


def _site_of(site_file: Path, root: Path) -> tuple[str, str]:
    """Return the name of a site and where its engine listens, as far as the file says."""
    text = site_file.read_text(encoding="utf-8") if site_file.exists() else ""
    name = re.search(r"^name:\s*([A-Za-z][\w-]*)", text, re.MULTILINE)
    listen = re.search(r"listen:\s*[\"']?([^\s\"'},]+)", text)
    return name[1] if name else site_name(root), listen[1] if listen else "tcp/127.0.0.1:7447"


def _camel(kind: str) -> str:
    return "".join(part[:1].upper() + part[1:] for part in kind.split("_") if part)


def _catalogue(source: str, path: Path) -> str:
    """Return the catalogue entry of an agent's source: what the class itself prints."""
    from formiga_bt.agent.agent import Agent
    from formiga_bt.agent.catalogue import catalogue_of

    names: dict[str, object] = {"__name__": path.stem}
    exec(compile(source, str(path), "exec"), names)
    found = [one for one in names.values() if isinstance(one, type) and issubclass(one, Agent) and one is not Agent]
    return f"# Make it anew:  python {path.name} --catalogue\n" + catalogue_of(found[0])


def _task(name: str, kind: str, steps: list[str]) -> str:
    lines = [
        f"# Sends {kind}_1 its first goal:  formiga run Try{name} --follow",
        "formiga: 1",
        f"task: Try{name}",
        "agents:",
        f"  {kind}: {{type: {kind}}}",
        "steps:",
    ]
    return "\n".join([*lines, *steps, ""])


def _step(kind: str, action: str, with_: list[str]) -> list[str]:
    """Return the lines of a step that orders an action."""
    given = ["    with:", *(f"      {one}" for one in with_)] if with_ else []
    return [f"  - do: {kind}.{action}", *given, "    timeout: 10 min"]


def _steps(kind: AgentType, world: CheckWorld) -> list[str]:
    """Return steps that try a type: what flies goes up and lands, others do what a plain task can ask for; or none."""
    specs = [world.catalogue.actions[name] for name in kind.actions]
    if kind.flies:
        up = next((one for one in specs if one.starts_rotors), None)
        down = next((one for one in specs if one.lands and one.moves_to), None)
        if up is None or down is None:
            return []
        return [
            *_step(kind.name, up.name, []),
            *_step(kind.name, down.name, [f"{down.moves_to}: ${{{kind.name}.home}}"]),
        ]
    for spec in specs:
        needed = [field for field in spec.fields.values() if not field.optional and field.default is None]
        samples = [sample(field.type, field.min, field.max) for field in needed]
        if all(samples) and not spec.cuts:
            with_ = [f"{field.name}: {sample}" for field, sample in zip(needed, samples, strict=True)]
            return _step(kind.name, spec.name, with_)
    return []


def _agent(
    name: str,
    kind: str,
    file: str,
    agent: str,
    site: str,
    listen: str,
    known: AgentType | None,
    world: CheckWorld,
    own_action: str,
) -> str:
    """Return the Python file of an agent."""
    body = list(_methods(known, world)) if known is not None else [OWN.format(action=own_action)]
    records = list(_records(known, world)) if known is not None else []
    mobility = known.mobility if known is not None else "ground"
    lands = known is not None and mobility == "air"
    if lands:
        body.append(_LINK_LOST)
    start = [] if mobility == "none" else [_START if known is None else _START_HERE]
    text = "\n".join([*start, *body, *([] if mobility == "none" else [_MAIN])])
    run = f'\n\nif __name__ == "__main__":\n    run({name}, id="{agent}", site="{site}"'
    run += ")\n" if listen == "tcp/127.0.0.1:7447" or is_tls(listen) else f', connect="{listen}")\n'
    used = text + "".join(records)
    wanted = ["Agent", "action", "run", *(one for one in (*ANNOTATIONS.values(), "Between") if _uses(used, one))]
    known_names = set(ANNOTATIONS.values()) - {"float", "int", "str", "bool"} | {"Agent", "action", "run", "Between"}
    from_agent = sorted({one for one in wanted if one in known_names})
    typing = [one for one in ("Annotated", "Literal", "TypedDict") if _uses(used, one)]
    imports = [
        *(["import math"] if "math." in used else []),
        *([f"from typing import {', '.join(typing)}"] if typing else []),
    ]
    imports += ([""] if imports else []) + [f"from formiga_bt.agent import {', '.join(from_agent)}"]
    summary = f"A {known.label if known is not None else kind.replace('_', ' ')}."
    head = HEAD.format(
        doc=f"{summary[:-1]} of your own: fill in what your machine does.", file=file, name=name, kind=kind,
        mobility=mobility, summary=summary, imports="\n".join([*imports, *(["", "", *records] if records else [])]).rstrip(),
        more=_status_fields(known),
    )  # fmt: skip
    return head + text + run


def _uses(text: str, name: str) -> bool:
    return re.search(rf"\b{name}\b", text) is not None


_START: Final = """\
    at = Place(0.0, 0.0)
"""
_START_HERE: Final = """\
    at = Position(0.0, 0.0, 0.0)  # where it stands; read it from your machine
"""
_MAIN: Final = """\
    async def main(self) -> None:
        while True:  # beside the actions: how it is
            self.status(pose=self.at, battery=100.0)
            await self.sleep(1.0)
"""
_LINK_LOST: Final = """\
    async def link_lost(self) -> None:
        \"\"\"Nothing was heard of the engine for too long, in the air: fly home and land.\"\"\"
"""


def _status_fields(known: AgentType | None) -> str:
    fields = known.fields if known is not None else {}
    return f", fields={{{', '.join(f'{name!r}: {_annotation(of)}' for name, of in fields.items())}}}" if fields else ""


def _methods(known: AgentType, world: CheckWorld) -> Iterator[str]:
    for name in known.actions:
        spec = world.catalogue.actions[name]
        if spec.cuts:
            continue  # of those that announce it
        params = "".join(f", {one}" for one in _params(spec))
        returns = f"{name}Result" if spec.result else "None"
        yield "\n".join(
            [
                "    @action",
                f"    async def {name}(self{params}) -> {returns}:",
                f'        """{spec.help or name}"""',
                "        await self.sleep(1.0)  # a cancel arrives here, as asyncio.CancelledError",
                "        self.feedback(progress=1.0)",
                *([f"        return {_result(spec)}"] if spec.result else []),
                "",
            ]
        )


def _params(spec: ActionSpec) -> Iterator[str]:
    """Return the parameters of an action: first those that must be given."""
    needed = [one for one in spec.fields.values() if not one.optional and one.default is None]
    for field in needed:
        yield f"{field.name}: {_annotation(field.type)}"
    for field in spec.fields.values():
        if field not in needed:
            default = field.default.const if field.default is not None and field.default.is_const else None
            if isinstance(default, bool | int | float | str):
                yield f"{field.name}: {_annotation(field.type)} = {default!r}"
            else:
                yield f"{field.name}: {_annotation(field.type)} | None = None"


def _records(known: AgentType, world: CheckWorld) -> Iterator[str]:
    for name in known.actions:
        spec = world.catalogue.actions[name]
        if spec.result:
            lines = [f"    {field}: {_annotation(of)}" for field, of in spec.result.items()]
            yield "\n".join([f"class {name}Result(TypedDict):", *lines, "", ""])


def _result(spec: ActionSpec) -> str:
    return _mapping(spec.result)


def _mapping(fields: Mapping[str, Type]) -> str:
    return "{" + ", ".join(f'"{name}": {_in_python(of)}' for name, of in fields.items()) + "}"


def _in_python(type_: Type) -> str:
    if type_.name == "list":
        return "[]"
    if type_.name == "record":
        return _mapping(type_.fields)
    return repr(type_.values[0]) if type_.values else SAMPLES.get(type_.name, "None")


def _annotation(type_: Type) -> str:
    if type_.name == "list" and type_.item is not None:
        return f"list[{_annotation(type_.item)}]"
    if type_.name == "record":
        return "dict[str, object]"
    if type_.values:
        return f"Literal[{', '.join(repr(one) for one in type_.values)}]"
    return ANNOTATIONS.get(type_.name, "str")
