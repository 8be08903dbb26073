"""Where a drafted task came from: who asked, through which model, after which prompt; and who approved it."""

import hashlib
from pathlib import Path

import msgspec
from msgspec.structs import replace

from formiga_bt.llm.drafts import ORIGIN, Kept, keep
from formiga_bt.llm.records import Draft, Flight, Origin
from formiga_bt.site_folder import write_durably


def kept_with_origin(draft: Draft, folder: Path, *, by: str, unix_millis: int) -> Kept:
    """Keep a draft with its rounds, messages and replies, and where it came from. No keys are in it.

    Args:
        draft: what came of a request.
        folder: of the site's drafts.
        by: who asked.
        unix_millis: when.
    """
    origin = Origin(
        by=by,
        request=draft.request,
        provider=draft.provider,
        model=draft.model,
        prompt_sha256=prompt_hash(draft),
        rounds=len(draft.rounds),
        unix_millis=unix_millis,
    )
    return keep(folder, _plain(draft), origin)


def approve(kept: Kept, *, approved_by: str, bundle: str) -> Origin:
    """Write down who said that a draft may run, and the hash of the task as it was then."""
    origin = replace(kept.origin, approved_by=approved_by, bundle=bundle)
    write_durably(kept.folder / ORIGIN, msgspec.json.format(msgspec.json.encode(origin), indent=2).decode() + "\n")
    return origin


def prompt_hash(draft: Draft) -> str:
    """Return the SHA-256 (hex) of the messages of the first round; "" without one."""
    return hashlib.sha256(msgspec.json.encode(draft.rounds[0].messages)).hexdigest() if draft.rounds else ""


def _plain(draft: Draft) -> Draft:
    """Return a draft without its pictures, which a dry run makes again."""
    rounds = tuple(replace(one, flight=_facts(one.flight)) for one in draft.rounds)
    return replace(draft, flight=_facts(draft.flight), rounds=rounds)


def _facts(flight: Flight | None) -> Flight | None:
    if flight is None:
        return None
    return replace(flight, drawing=None, timeline=None, chart=None, steps=(), lines=())
