"""The site's agents as simulated ones, each in a process of its own, beside a running engine: `formiga up --sim`."""

import shutil
from collections import Counter
from collections.abc import Container
from types import TracebackType
from typing import Final

from agents_sim.launch import FleetProcesses
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal import fleet_of
from formiga_bt.services.host import EngineHost

STARTS: Final = 3
"""So often an agent whose process ended by itself is started again."""


class Simulated:
    """A context manager: the agents run inside, none is left after.

    Args:
        host: the engine they connect to; entered already when this is.
        site, catalogue: which agents there are.
        without: people who answer at the desk.
    """

    def __init__(self, host: EngineHost, site: Site, catalogue: Catalogue, *, without: Container[str] = ()) -> None:
        self._host = host
        self._specs = [spec for spec in fleet_of(site, catalogue) if spec.id not in without]
        self._site = site.name
        self._fleet: FleetProcesses | None = None
        self._again: Counter[str] = Counter()
        self._left: set[str] = set()

    def look(self) -> list[str]:
        """Start agents again whose processes ended by themselves, `STARTS` times each; return what to tell."""
        told = []
        ended = self._fleet.ended() if self._fleet is not None else {}
        for agent, code in ended.items():
            if agent in self._left or self._fleet is None:
                continue
            what = f"the process of the simulated {agent} ended with status {code}: {self._fleet.last_words(agent)}"
            if self._again[agent] < STARTS:
                self._again[agent] += 1
                self._fleet.start(agent)
                told.append(f"{what}\n  it was started again ({self._again[agent]} of at most {STARTS} times)")
            else:
                self._left.add(agent)
                told.append(
                    f"{what}\n  it is not started again; what it printed: {self._fleet.log_of(agent)}\n"
                    "  help: end the engine and start it again: formiga down, then formiga up --sim"
                )
        return told

    def __enter__(self) -> "Simulated":
        # Afresh at each start: this engine would know nothing of goals that an old body still flies.
        state_dir = self._host.runtime_folder / "sim"
        shutil.rmtree(state_dir, ignore_errors=True)
        self._fleet = FleetProcesses(self._specs, site=self._site, connect=self._host.endpoint, state_dir=state_dir)
        self._fleet.__enter__()
        self._host.with_simulated = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._fleet is not None:
            self._fleet.close()
