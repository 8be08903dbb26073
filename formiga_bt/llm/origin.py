"""Where a drafted task came from: who asked, through which model, after which prompt; and who approved it."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from formiga_bt.base.packaged import files
from formiga_bt.base.site_folder import write_durably
from formiga_bt.lang.loader import load_task_text
from formiga_bt.lang.model import Site, Task
from formiga_bt.lang.text.document import Listing, Mapping_, parse_file
from formiga_bt.llm.drafts import ORIGIN, KeptDraft, keep
from formiga_bt.llm.records import Draft, Origin, RehearsedFlight
from formiga_bt.llm.world import RequestWorld
from formiga_bt.safety.approval import approval_digest, others_than
from formiga_bt.safety.drafted import Drafted, drafted, said_in, stamped
from formiga_bt.safety.meaning import meaning
from formiga_bt.services.crew import standing
from formiga_bt.services.kept.drafted import note


def kept_with_origin(
    draft: Draft, folder: Path, world: RequestWorld, *, by: str, unix_millis: int, people: Sequence[str] = ()
) -> KeptDraft:
    """Keep a draft with its rounds, messages and replies, and where it came from. No keys are in it.

    Its text begins with the line that says who had it written (`safety.drafted`), and what it does is written down beside the
    drafts (`services.kept.drafted`): on a site in mode real another person approves it.

    Args:
        draft: what came of a request.
        folder: of the site's drafts.
        world: its site and catalogue.
        by: who asked.
        unix_millis: when.
        people: under which other names that person is known.
    """
    record = drafted([by], f"{draft.provider} {draft.model}", people)
    origin = Origin(
        by=by,
        request=draft.request,
        provider=draft.provider,
        model=draft.model,
        prompt_sha256=prompt_hash(draft),
        rounds=len(draft.rounds),
        unix_millis=unix_millis,
    )
    texts = dict.fromkeys([draft.yaml, *(one.yaml for one in draft.rounds)])
    if draft.yaml:
        draft = replace(draft, yaml=stamped(draft.yaml, record))
    kept = keep(folder, _plain(draft), origin)
    tasks = [task for text in texts if (task := _task(text, world)) is not None]
    note_drafted(folder.parent, tasks, record, world, draft=kept.number, unix_millis=unix_millis)
    return kept


def note_drafted(
    runtime: Path, tasks: Sequence[Task], record: Drafted, world: RequestWorld, *, draft: int, unix_millis: int
) -> None:
    """Write down what a model wrote; not tasks of the site and of the library that people wrote, which it only said again."""
    texts = [*world.tasks.values(), *(path.read_text(encoding="utf-8") for path in files("trees"))]
    by_people = [text for text in texts if said_in(text) is None and any(_may_do_the_same(text, one) for one in tasks)]
    of_people = {meaning(task) for text in by_people if (task := _task(text, world)) is not None}
    new = [one for one in tasks if meaning(one) not in of_people]
    note(runtime, new, record, draft=draft, unix_millis=unix_millis)


def _task(text: str, world: RequestWorld) -> Task | None:
    loaded = load_task_text(text, "draft.yaml", catalogue=world.catalogue, site=world.site, library=world.folders)
    return loaded.task


def _may_do_the_same(text: str, task: Task) -> bool:
    """Return False if a text has more or fewer steps in a section than a task: it does something else."""
    root, _ = parse_file(text, "draft.yaml")
    if not isinstance(root, Mapping_):
        return False
    sections = {"steps": task.steps, "on_failure": task.on_failure, "on_abort": task.on_abort, "finally": task.finally_}
    for key, steps in sections.items():
        entry = root.get(key)
        if len(entry.value.items if entry is not None and isinstance(entry.value, Listing) else ()) != len(steps):
            return False
    return True


def approve(kept: KeptDraft, *, approved_by: str, bundle: str) -> Origin:
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


def _facts(flight: RehearsedFlight | None) -> RehearsedFlight | None:
    if flight is None:
        return None
    return replace(flight, drawing=None, timeline=None, chart=None, steps=(), lines=())


# -- proposals of assistants -------------------------------------------------------------------------------------------
class Asker(Struct, frozen=True):
    """For whom an assistant, or a model, wrote a task."""

    model: str
    people: tuple[str, ...] = ()
    """The first name is told, the others are known."""

    @property
    def record(self) -> Drafted:
        """Return what is kept of it."""
        return drafted(self.people[:1], self.model, self.people[1:])

    def marked(self, yaml: str) -> str:
        """Return a task's text with the line that says who had it written."""
        return stamped(yaml, self.record)

    def approver(self, site: Site) -> str:
        """Return an approver of the site who did not ask for it, or `NAME`."""
        return next(iter(others_than(self.people, site.people.get("approvers", ()))), "NAME")


def approved(runtime: Path) -> Callable[[Task, Site], bool]:
    """Return what tells whether a task stands approved on a site, as its runtime folder says now.

    Raises:
        SiteError: what the folder says cannot be read.
    """
    given = {one.digest for one in standing(runtime)}
    return lambda task, site: bool(given) and approval_digest(task, site) in given
