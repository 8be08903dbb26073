"""Resources of the site: which of the blocks that wait for some get them, in order of priority and age.

A block gets all that it asks for at once, if it is free, if no block before it waits for the same, and if then everybody could
still end (`allocator.holders`). Who holds a resource already is before all who hold none: they may wait for it. Called by
`allocation` at each of its looks.
"""

from collections.abc import Callable, Mapping, Sequence

from formiga_bt.engine.allocator.holders import Holders
from formiga_bt.engine.kernel import changes as ch
from formiga_bt.engine.kernel.core import Core
from formiga_bt.engine.kernel.records import AgentRequest, Verdict
from formiga_bt.engine.resource_use import use_of
from formiga_bt.engine.tasks import claims
from formiga_bt.engine.tasks.tasks import Tasks
from formiga_bt.safety.resources import holders_of


class Resources:
    """Grants claims; keeps nothing itself."""

    def __init__(self, core: Core, tasks: Tasks, holders: Holders) -> None:
        self._core = core
        self._tasks = tasks
        self._holders = holders

    def serve(
        self,
        requests: Sequence[AgentRequest],
        blocked: Mapping[str, tuple[str, str]],
        explain: Callable[[str, tuple[Verdict, ...]], None],
    ) -> None:
        """Serve those that wait, in their order; those that are `blocked` are not, and hold up nobody."""
        first: dict[str, str] = {}
        for request in requests:
            if request.task in blocked:
                explain(request.task, (Verdict("", "", *_blocked(blocked[request.task])),))
                continue
            refused = self._never(request)
            if refused:
                self._tasks.refuse_request(request, refused)
                continue
            code, detail = self._why_not(request, first)
            if not code:
                self._core.emit(ch.RequestPut(request.task, None))
                claims.grant(self._core, request)
                continue
            explain(request.task, (Verdict("", "", code, None, detail),))
            for name in request.units:
                first.setdefault(name, request.holder)

    def _never(self, request: AgentRequest) -> str:
        for name, units in request.units.items():
            resource = self._core.site.resources.get(name)
            if resource is None:
                return f"this site has no resource '{name}'"
            if units > resource.capacity:
                return f"'{name}' has {resource.capacity} in all, {units} are asked for"
        return ""

    def _why_not(self, request: AgentRequest, first: Mapping[str, str]) -> tuple[str, str]:
        """Return (code, detail) of why a block does not get its resources now; the code "" = it does."""
        core = self._core
        for name, units in request.units.items():
            use = use_of(core, name)
            if use.taken_by_others(request.holder) + use.claimed.get(request.holder, 0) + units > use.capacity:
                return "resource_busy", f"{name}: {', '.join(holders_of(use, '')) or 'nobody'}"
        if not core.task(request.holder).resources.claims:
            for name in request.units:
                if name in first:
                    return "resource_queue", f"{name}: {first[name]}"
        waits = self._holders.held_up_by_units(request)
        return ("safe_order", waits) if waits else ("", "")


def _blocked(why: tuple[str, str]) -> tuple[str, None, str]:
    return why[0], None, why[1]
