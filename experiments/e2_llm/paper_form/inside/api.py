"""The names of the paper's API, each a question to the fleet in the other process."""

import math
from collections.abc import Callable
from typing import Any

from experiments.e2_llm.paper_form.inside.turns import POLL_S, Turns

Ask = Callable[[dict[str, Any]], dict[str, Any]]
"""Ask the fleet and return what it says."""


class Cartesian_Coordinates:  # noqa: N801
    """A point in metres: x east, y north, z above the ground of the base station."""

    def __init__(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
        self.x, self.y, self.z = x, y, z


class Goal(Cartesian_Coordinates):
    """A goal of GoTo."""


class Gps:
    """A point in degrees, and metres above the ground of the base station."""

    def __init__(self, latitude: float, longitude: float, altitude: float) -> None:
        self.latitude, self.longitude, self.altitude = latitude, longitude, altitude


class Result:
    """What an action ended with."""

    def __init__(self, said: dict[str, Any]) -> None:
        self.result = said["result"]
        self.inRange = said.get("in_range", False)
        self.go_to_gps = Gps(*said["go_to"]) if "go_to" in said else None


class Client:
    """An action that was asked for."""

    def __init__(self, number: str, done: dict[str, dict[str, Any]], turns: Turns) -> None:
        self._number, self._done, self._turns = number, done, turns

    def get_result(self) -> Result | None:
        """Return the result, or None as long as there is none."""
        if self._number not in self._done:
            self._turns.pause(lambda: self._number in self._done, POLL_S)
        said = self._done.get(self._number)
        return Result(said) if said is not None else None


def point(value: Any) -> list[float]:
    """Return a point as three numbers.

    Raises:
        TypeError: it is no point.
    """
    parts = [getattr(value, name, None) for name in ("x", "y", "z")]
    if any(isinstance(one, bool) or not isinstance(one, int | float) or not math.isfinite(one) for one in parts):
        raise TypeError(f"a goal has numbers x, y and z, got {type(value).__name__}")
    return [float(one) for one in parts if one is not None]


def names(ask: Ask, turns: Turns, done: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the API as the names of a program."""

    def client(said: dict[str, Any]) -> Client:
        return Client(said["id"], done, turns)

    def select_robot(preference: Any, goal: Any, types: Any) -> tuple[str, str]:
        near = point(goal) if hasattr(goal, "x") else None
        kinds = [types] if isinstance(types, str) else [str(one) for one in types]
        said = ask({"do": "select", "preference": str(preference or ""), "near": near, "types": kinds})
        return said["name"], said["type"]

    def action_client(
        robot_type: str, robot_name: str, action_name: str, goal_arg: Any, task: Any, last_task: bool = False
    ) -> Client:
        del task
        given: Any = None
        if action_name == "GoTo":
            given = point(goal_arg)
        elif action_name == "Explore":
            given = [point(one) for one in goal_arg]
        elif action_name in ("TakeOff", "LandIn") and goal_arg is not True:
            raise TypeError(f"the goal of {action_name} is True, got {type(goal_arg).__name__}")
        asked = {"type": str(robot_type), "name": str(robot_name), "action": str(action_name)}
        return client(ask({"do": "goal", **asked, "given": given, "last": bool(last_task)}))

    def cartesian(lat: float, lng: float, alt: float) -> Cartesian_Coordinates:
        return Cartesian_Coordinates(*ask({"do": "cartesian", "gps": [float(lat), float(lng), float(alt)]})["point"])

    def to_goal(value: Any) -> Goal:
        return Goal(*point(value))

    return {
        "select_robot": select_robot,
        "action_client": action_client,
        "generic_interaction_client": lambda: client(ask({"do": "confirm"})),
        "GpsToCartesian": cartesian,
        "ConvertGotoToGoal": to_goal,
        "ConvertGpsToGoal": to_goal,
        "ConvertReturnGoal": to_goal,
        "Cartesian_Coordinates": Cartesian_Coordinates,
        "find_landing_port": lambda name: Cartesian_Coordinates(*ask({"do": "port", "name": str(name)})["point"]),
        "get_base_station": lambda: Gps(*ask({"do": "base"})["gps"]),
        "task": "task",
    }
