"""Who speaks in a request, and whether they may: the account whose token came, or `local`.

`local` is who calls on the engine's own machine: without a token in mode simulation, with the site's token elsewhere. Its `by`
is taken as it is said, since the engine cannot know better. The word of an account is always its own.
"""

from collections.abc import Callable
from contextvars import ContextVar
from typing import Final

from msgspec import Struct

from formiga_bt.base.accounts import LOCAL, OPEN_TASKS, REQUESTS, Account
from formiga_bt.base.roles import MAY, Deed, Role, roles_that_may
from formiga_bt.services.refused import Refused


class Principal(Struct, frozen=True):
    """Who speaks."""

    name: str
    roles: tuple[Role, ...]
    agent: str = ""
    tasks: tuple[str, ...] = ()
    requests: int = REQUESTS
    """A minute, at most; of an account."""
    open_tasks: int = OPEN_TASKS

    @classmethod
    def of(cls, name: str, account: Account) -> "Principal":
        """Return who speaks with a token of an account."""
        return cls(name, account.roles, account.agent, account.tasks, account.requests, account.open_tasks)

    @property
    def is_local(self) -> bool:
        """Return whether it is nobody's account."""
        return self.name == LOCAL

    @property
    def most_open(self) -> int | None:
        """Return how many of its tasks may be under way at once; None: any number."""
        return None if self.is_local else self.open_tasks

    def may(self, deed: Deed) -> bool:
        """Return whether one of the roles may do it."""
        return any(deed in MAY[role] for role in self.roles)


ALL: Final = Principal(LOCAL, tuple(Role))
SPEAKER: Final[ContextVar[Principal]] = ContextVar("speaker", default=ALL)
"""Of the request that is served; the doors set it."""


def require(deed: Deed) -> Principal:
    """Return who speaks, if they may do it.

    Raises:
        Refused: `no_role`.
    """
    who = SPEAKER.get()
    if who.may(deed):
        return who
    needed = " or ".join(roles_that_may(deed))
    raise Refused(
        "no_role", f"{who.name} may not {deed.value}: that takes the role {needed}",
        f"an administrator gives it: formiga access role {who.name} {roles_that_may(deed)[0]}",
    )  # fmt: skip


def speaker(said: str) -> str:
    """Return in whose name a request is carried out: the account's, whatever it says; of `local`, what it says."""
    who = SPEAKER.get()
    return said or "http" if who.is_local else who.name


def spoken_as(agent: str) -> str:
    """Return the agent that answers or tells of an event; an account is the agent that it names, and no other.

    Raises:
        Refused: `not_you`, `no_agent`.
    """
    who = SPEAKER.get()
    if who.is_local:
        return agent
    if not who.agent:
        said = f"{who.name} is the account of no agent, so nobody asks it"
        raise Refused("no_agent", said, f"an administrator says which: formiga access agent {who.name} AGENT")
    if agent not in ("", who.agent):
        raise Refused("not_you", f"this token is of {who.name}, who is {who.agent} and not {agent}", "")
    return who.agent


def require_task(task: str) -> Principal:
    """Return who requests a task, if the account may request it.

    Raises:
        Refused: `no_role`, `not_listed`.
    """
    who = require(Deed.REQUEST)
    if who.tasks and task not in who.tasks:
        listed = ", ".join(who.tasks)
        raise Refused("not_listed", f"{who.name} may request {listed}, and not {task}", "")
    return who


def require_abort(requested_by: Callable[[], str]) -> None:
    """Let the end of a task pass: of one's own, or of any with a role for that.

    Args:
        requested_by: returns who requested the task; asked only if it matters.

    Raises:
        Refused: `no_role`.
    """
    who = SPEAKER.get()
    if not (who.may(Deed.ABORT) or (who.may(Deed.ABORT_OWN) and requested_by() == who.name)):
        require(Deed.ABORT)
