"""All agents as a policy sees them, with what each look at them found out once for all requests that ask the same.

Thousands of requests mostly ask for the same: whom a role refuses, whatever the place, is found once a look and role. Equal
verdicts are one object, over all looks, for each waiting task keeps one of every agent.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

from formiga_bt.engine.allocator.candidate import Candidate
from formiga_bt.engine.allocator.filters import refused_anywhere
from formiga_bt.engine.kernel.records import RoleRequest, Verdict

MOST_SAID: Final = 200_000
"""So many verdicts are kept to be shared; beyond, sharing begins anew."""

Asked = tuple[object, ...]
"""What a role asks for, without its places and its count."""


class Looked(NamedTuple):
    """What a role thinks of all agents before it knows where they are to go."""

    verdicts: list[Verdict | None]
    """None: it fits, as far as that goes."""
    fit: tuple[int, ...]
    """Where those are."""
    types: frozenset[int]
    """Where the agents of its types are."""


class Roster(list[Candidate]):
    """The agents, in the order of their admission."""

    def __init__(self, agents: Iterable[Candidate] = ()) -> None:
        super().__init__(agents)
        self._said: dict[tuple[str, str, str, str], Verdict] = {}
        self._lists: dict[tuple[Asked, ...], tuple[Verdict, ...]] = {}
        self._looked: dict[Asked, Looked] = {}
        self._places: dict[str, int] = {agent.id: place for place, agent in enumerate(self)}
        self._strangers: dict[tuple[str, tuple[str, ...]], tuple[list[Verdict | None], tuple[int, ...]]] = {}

    def put(self, agent: Candidate) -> None:
        """Add an agent, or say how it is now."""
        place = self._places.get(agent.id)
        if place is None:
            self._places[agent.id] = len(self)
            self.append(agent)
            self._strangers.clear()
        else:
            if self[place].type != agent.type:
                self._strangers.clear()
            self[place] = agent

    def find(self, agent_id: str) -> Candidate | None:
        """Return an agent as it is now."""
        place = self._places.get(agent_id)
        return self[place] if place is not None else None

    def begin(self) -> None:
        """Begin a look: agents may have changed since the last one."""
        self._looked.clear()
        if len(self._said) > MOST_SAID:
            self._said.clear()
        if len(self._lists) > MOST_SAID // 100:
            self._lists.clear()
        if len(self._strangers) > MOST_SAID // 100:
            self._strangers.clear()

    def verdict(self, role: str, agent: str, code: str, detail: str) -> Verdict:
        """Return a verdict without a cost, the same object each time."""
        key = (role, agent, code, detail)
        found = self._said.get(key)
        if found is None:
            found = self._said[key] = Verdict(role, agent, code, None, detail)
        return found

    def look(self, role: RoleRequest) -> Looked:
        """Return what a role thinks of all agents, wherever they are to go."""
        asked = asked_by(role)
        looked = self._looked.get(asked)
        if looked is None:
            strangers, types = self._of_other_types(role)
            verdicts, fit = strangers.copy(), []
            for place in types:
                agent = self[place]
                refused = refused_anywhere(agent, role)
                if refused is None:
                    fit.append(place)
                else:
                    verdicts[place] = self.verdict(role.role, agent.id, *refused)
            looked = self._looked[asked] = Looked(verdicts, tuple(fit), frozenset(types))
        return looked

    def _of_other_types(self, role: RoleRequest) -> tuple[list[Verdict | None], tuple[int, ...]]:
        """Return the verdicts on agents of other types, None for those of the role's, and where these are."""
        key = role.role, role.types
        found = self._strangers.get(key)
        if found is None:
            of, name = frozenset(role.types), role.role
            types = tuple(place for place, agent in enumerate(self) if agent.type in of)
            verdicts = [
                None if agent.type in of else self.verdict(name, agent.id, "wrong_type", agent.type) for agent in self
            ]
            found = self._strangers[key] = verdicts, types
        return found

    def shared(self, roles: Iterable[RoleRequest], verdicts: Iterable[Verdict]) -> tuple[Verdict, ...]:
        """Return verdicts as the tuple that another request that asks the same has, if that is equal."""
        found = tuple(verdicts)
        key = tuple(asked_by(role) for role in roles)
        known = self._lists.get(key)
        if known == found:
            return known
        self._lists[key] = found
        return found


def asked_by(role: RoleRequest) -> Asked:
    """Return what a role asks for, without its places and its count."""
    only = role.by_hand if role.is_full_by_hand else ()
    return (
        role.role, role.types, role.shared, role.id, role.battery_min, role.away, role.actions, role.but_not,
        role.taken_back, only,
    )  # fmt: skip
