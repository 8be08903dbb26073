"""Puts a proposal where a person finds it: `.formiga/<site>/drafts/<n>/`, as a draft that came from an assistant.

Nothing here starts anything. What it writes is data for `formiga draft`; only a person's word makes a run of it.
"""

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec

from formiga_bt.errors import FormigaError
from formiga_bt.llm.records import Draft, Flight, Origin, Value
from formiga_bt.mcp_server.outside import cleaned
from formiga_bt.mcp_server.records import FlightOut
from formiga_bt.site_folder import FOLDER, write_durably

MOST_OPEN: Final = 50
"""Proposals of assistants that may wait; one that writes without end is stopped here."""
DRAFTS: Final = "drafts"


def drafts_folder(site_file: str | None, site: str) -> Path:
    """Return the folder of a site's drafts; that of the demo site lies below the current folder."""
    beside = Path(site_file).resolve().parent if site_file is not None else Path.cwd()
    return beside / FOLDER / site / DRAFTS


def draft_of(
    yaml: str, flight: FlightOut, params: Mapping[str, str], why: str, client: str, warnings: list[str], unix_millis: int = 0
) -> tuple[Draft, Origin]:
    """Return a proposal as the draft that a person is shown, and where it came from."""
    told = Flight(
        task=flight.task,
        status=flight.status,
        code=flight.code,
        reason=flight.reason,
        duration_s=flight.duration_s,
        agents={role: tuple(ids) for role, ids in flight.agents.items()},
        asked=tuple(dict.fromkeys(one.who for one in flight.questions)),
        crashes=flight.crashes,
        least_battery=flight.least_battery_percent,
    )
    name = f"mcp:{cleaned(client, 60) or 'unknown'}"
    draft = Draft(
        request=why,
        kind="task",
        plan="; ".join(warnings),
        task=flight.task,
        yaml=yaml,
        values=tuple(Value(one, text) for one, text in params.items()),
        flight=told,
        provider=name,
    )
    return draft, Origin(by=name, request=why, provider=name, model="", prompt_sha256="", rounds=1, unix_millis=unix_millis)


def keep(folder: Path, draft: Draft, origin: Origin) -> tuple[int, Path]:
    """Write a proposal under the next number; return that and its folder.

    Raises:
        FormigaError: too many wait already, or it cannot be written.
    """
    if sum(1 for _ in folder.glob("*/origin.json")) >= MOST_OPEN:
        raise FormigaError(
            f"{MOST_OPEN} proposals wait in {folder}\n  help: a person looks at them first, and removes what is not wanted"
        )
    try:
        number, place = _next(folder)
        write_durably(place / "task.yaml", draft.yaml if draft.yaml.endswith("\n") else draft.yaml + "\n")
        write_durably(place / "origin.json", _json(origin))
        write_durably(place / "draft.json", _json(draft))
    except OSError as error:
        raise FormigaError(f"the proposal cannot be written to {folder}: {error.strerror or error}") from error
    return number, place


def _next(folder: Path) -> tuple[int, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    number = max((int(name) for name in os.listdir(folder) if name.isascii() and name.isdigit()), default=0)
    while True:
        number += 1
        with suppress(FileExistsError):
            place = folder / str(number)
            place.mkdir()
            return number, place


def _json(value: Any) -> str:
    return msgspec.json.format(msgspec.json.encode(value), indent=2).decode() + "\n"
