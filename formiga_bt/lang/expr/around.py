"""An environment in which one name has a value of its own: `item`, or `now` at another instant."""

from typing import Any

from formiga_bt.lang.model import Env
from formiga_bt.lang.types import AgentRef, Value


class EnvWith:
    """An environment with one more name, whose value may be changed."""

    __slots__ = ("_env", "_name", "value")

    def __init__(self, env: Env, name: str, value: Value = None) -> None:
        self._env = env
        self._name = name
        self.value = value

    def name(self, name: str) -> Value:
        """Return the value, or what the name means around."""
        return self.value if name == self._name else self._env.name(name)

    def is_set(self, name: str) -> bool:
        """Return whether the name has a value."""
        return name == self._name or self._env.is_set(name)

    def agent_field(self, agent: AgentRef, name: str) -> Value:
        """Return an agent's field as last known."""
        return self._env.agent_field(agent, name)

    def members(self, agent_type: str) -> tuple[AgentRef, ...]:
        """Return the agents of a type."""
        return self._env.members(agent_type)

    def lat_lng(self, point: Any) -> tuple[float, float]:
        """Return degrees."""
        return self._env.lat_lng(point)

    def place(self, lat: float, lng: float) -> Any:
        """Return a place."""
        return self._env.place(lat, lng)

    def ground_up_m(self, place: Any) -> float:
        """Return the height of the ground over the base's."""
        return self._env.ground_up_m(place)
