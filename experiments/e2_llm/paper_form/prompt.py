"""The prompt in the paper's form (section 3.4.2): agent types and capabilities, action primitives, the API, example tasks.

The paper gives the parts of its prompt, not their words; these words are ours. The site's places stand in it in degrees, since
the API knows no names of places.
"""

import json
import re
from pathlib import Path
from typing import Final

from experiments.e2_llm.fly import World
from experiments.e2_llm.paper_form.flight import RETURN_M, TAKE_OFF_M
from experiments.e2_llm.paper_form.programs import degrees, example
from formiga_bt.llm.records import Message

SYSTEM: Final = f"""You write tasks for the fleet management system FORMIGA as Python functions.

# Agent types and capabilities
- lwd: light-weight drone. Actions: TakeOff, GoTo, LandIn, Explore.
- hwd: heavy-weight drone. Actions: TakeOff, GoTo, LandIn.
- human: a picker, who carries a tracker. Action: MiniFinder.
- watcher: a human who confirms, through generic_interaction_client.

# Action primitives
- action_client(RobotT, RobotName, "TakeOff", True, task): climbs to {TAKE_OFF_M:g} m. Only on the ground.
- action_client(RobotT, RobotName, "GoTo", goal, task): flies straight to a goal. Only in the air.
- action_client(RobotT, RobotName, "LandIn", True, task): lands straight below. Only in the air.
- action_client("lwd", RobotName, "Explore", corners, task): looks at all of a region; corners are Cartesian coordinates.
- action_client("human", username, "MiniFinder", base_gps, task): its result has inRange and go_to_gps.
Each returns a client at once. client.get_result() is None until the action is over, so wait for it:
    while client.get_result() is None:
        pass
A new action of a robot stops its running one. An action that is refused or fails aborts the task.
The last action of a robot in the task has last_task=True.

# API
- select_robot(preference, goal, types) returns (name, type): the preferred robot, or with preference None the closest one to
  the goal that is free. types is a list, as ['lwd']. Each call gives another robot.
- generic_interaction_client(): asks the watcher; its result has .result, "positive" or "negative".
- GpsToCartesian(lat, lng, alt) returns Cartesian coordinates with x (metres east), y (metres north), z (metres up).
- Cartesian_Coordinates(): a new point; set its x, y and z.
- ConvertGotoToGoal(cartesian), ConvertGpsToGoal(cartesian): the goal of GoTo for Cartesian coordinates.
- find_landing_port(RobotName), ConvertReturnGoal(target): the goal {RETURN_M:g} m above the robot's own landing port.
- get_base_station(): the base station, with latitude, longitude and altitude.
- task: this task. math, time and threading can be used; threading.Thread lets several robots act at the same time.
There are no other functions, modules or actions.

# Answer
One Python code block: the function of the task, and below it one line that calls it with the values of the request.

# Site
"""
_BLOCK: Final = re.compile(r"```[^\n`]*\n(.*?)(?:```|\Z)", re.DOTALL)


def messages(task: str, words: str, world: World) -> list[Message]:
    """Return what a model is asked for a request; for T10+ it sees T6 to T9 besides T1 to T5."""
    told = [Message("system", SYSTEM + site(world))]
    shown = ["T1", "T2", "T3", "T4", "T5", *(["T6", "T7", "T8", "T9"] if task == "T10+" else [])]
    requests = _requests()
    for name in shown:
        told.append(Message("user", requests[name]))
        told.append(Message("assistant", f"```python\n{example(name, world)}```"))
    return [*told, Message("user", words)]


def site(world: World) -> str:
    """Return the places, regions and agents of a site in words."""
    here = world.site
    lines = [f"- the base station: {degrees(world, 'base')}"]
    lines += [f"- {name.replace('_', ' ')}: {degrees(world, name)}" for name in here.places]
    lines += [f"- region {name}: corners {degrees(world, name)}" for name in here.regions]
    kinds: dict[str, list[str]] = {}
    for one in here.agents.values():
        kinds.setdefault(one.type, []).append(one.id)
    lines += [f"- {kind}: {', '.join(names)}" for kind, names in kinds.items()]
    return "\n".join(["Places as latitude, longitude:", *lines])


def program_in(answer: str) -> str:
    """Return the program of an answer: its longest code block, or all of it if it has none."""
    blocks = _BLOCK.findall(answer)
    return str(max(blocks, key=len)).strip() if blocks else answer.strip()


def _requests() -> dict[str, str]:
    rows = json.loads((Path(__file__).parents[1] / "paper_examples.json").read_text(encoding="utf-8"))
    return {one["task"]: one["request"] for one in reversed(rows)}
