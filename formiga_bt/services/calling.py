"""Who may call services of the engine over a wire, and as whom.

A wire that binds names to certificates serves `svc/<principal>/...` to the account of that name. One that does not serves that
only on this machine's own loopback in mode simulation; there also the bare names, whose callers are `local` as at HTTP. Any
other serves nothing.

A call is an order as any other: `speaking` knows who speaks, roles are looked at, refusals and what changes something are noted
in the audit.
"""

import logging
from collections.abc import Collection
from typing import Final

from formiga_bt.base.accounts import AccountBook
from formiga_bt.base.endpoints import is_local
from formiga_bt.base.errors import SiteError
from formiga_bt.base.roles import Deed, roles_that_may
from formiga_bt.lang.model import Site
from formiga_bt.services.http.audit import Audit
from formiga_bt.services.http.speaking import ALL, SPEAKER, Principal, require
from formiga_bt.services.pace import LATER, Pace
from formiga_bt.services.paper import PaperServices
from formiga_bt.services.refused import Refused
from formiga_bt.transport.base import AgentTransport, Listening
from formiga_bt.transport.calls import Call, CallError, CarriesCalls

log = logging.getLogger("formiga.calls")

WHENCE: Final = "wire"
"""From where, in the audit."""
DONE, NO, FORBIDDEN = 200, 409, 403
NOBODY: Final = "no_account"


class Caller:
    """Answers calls: an `AnswersCalls` of the wires.

    Args:
        paper: the services.
        accounts: who there is.
        audit: is told of what changes something, and of refusals.
        pace: counts what accounts send, here and at the doors.
    """

    def __init__(self, paper: PaperServices, accounts: AccountBook, audit: Audit, pace: Pace) -> None:
        self._paper = paper
        self._accounts = accounts
        self._audit = audit
        self._pace = pace
        self.services: Collection[str] = tuple(paper.table)
        self.urgent: Collection[str] = ("task_manager/abort_task",)

    def serve(self, site: Site, wires: Collection[AgentTransport]) -> None:
        """Serve the wires that may carry calls; before they are opened."""
        for wire in wires:
            if not isinstance(wire, CarriesCalls):
                continue
            is_open = site.mode == "simulation" and isinstance(wire, Listening) and is_local(wire.endpoint)
            if wire.binds_names or is_open:
                wire.serve_calls(self, bare=not wire.binds_names)

    def answer(self, call: Call) -> bytes | CallError:
        """Carry a call out, and return the reply, or why not."""
        deed = self._paper.table[call.service].may
        status, who = DONE, call.principal[:64]
        try:
            speaks = self._who(call.principal, deed)
            who = speaks.name
            before = SPEAKER.set(speaks)
            try:
                require(deed)
                if not (speaks.is_local or call.service in self.urgent or self._pace.takes(who, speaks.requests)):
                    raise Refused(
                        "too_many_requests", f"{who} sent more than {speaks.requests} requests within a minute", LATER
                    )
                return self._paper.carry_out(call.service, call.payload)
            finally:
                SPEAKER.reset(before)
        except Refused as refused:
            status = FORBIDDEN if refused.code in (NOBODY, "no_role", "not_listed") else NO
            return CallError(
                refused.code, refused.text, refused.help or "", tuple(refused.near), tuple(refused.problems)
            )
        finally:
            if status != DONE or self._paper.table[call.service].changes:
                self._audit.note(who, WHENCE, "CALL", call.service, status)

    def _who(self, name: str, deed: Deed) -> Principal:
        """Return who speaks.

        Raises:
            Refused: `no_account`: nobody has that name, or is shut out.
        """
        if not name:
            return ALL
        try:
            account = self._accounts.named(name)
        except SiteError as error:
            log.warning("%s", error)
            account = None
        if account is None:
            needed = " or ".join(roles_that_may(deed))
            raise Refused(
                NOBODY,
                f"there is no account '{name[:64]}' here: to {deed.value} takes one with the role {needed}",
                f"an administrator adds it: formiga access add NAME --role {roles_that_may(deed)[0]}",
            )
        return Principal.of(name, account)
