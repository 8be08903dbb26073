"""Task files for an engine that runs: what verbs send of them. The engine checks all of it itself, and trusts nothing of it.

Called by `formiga load`, `formiga run FILE` and `formiga draft --run`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from formiga_bt.base.packaged import folder
from formiga_bt.cli.inputs import UnusableFile, read_world, readable
from formiga_bt.client import ApiError, Client
from formiga_bt.show.facts import TaskLoaded

if TYPE_CHECKING:
    from formiga_bt.lang.model import Catalogue
    from formiga_bt.safety.drafted import Drafted
    from formiga_bt.services.kept.drafted import Known

BODY_LIMIT: Final = 1_000_000
"""As `services.http.door` has it."""


@dataclass(frozen=True, slots=True)
class TaskFiles:
    """A task file and what it imports, besides what ships with formiga_bt."""

    file: str
    texts: dict[str, str]
    """By path below the site's folder."""
    drafted: "Drafted | None" = None
    """A model wrote it, as the folder here knows; the engine may be elsewhere, with another one."""


def is_file_word(word: str) -> bool:
    """Return whether a word of the command line means a task file, and not a task's name."""
    return word.endswith((".yaml", ".yml")) or "/" in word


def load_file(client: Client, path: Path, *, by: str, site: Path | None = None, quiet: bool = False) -> TaskLoaded:
    """Have an engine check and serve a task file, after the files of the site's own tasks that it requests.

    Args:
        client: of the engine.
        path: of the file.
        by: who loads it.
        site: the site file that names the engine, if one was given.
        quiet: do not tell what became of it.

    Returns:
        What the engine said of the file.

    Raises:
        UnusableFile: it cannot be read, or lies outside of the site's folder.
        ApiError: the engine refuses it.
    """
    from formiga_bt.safety.drafted import written

    answer: TaskLoaded | None = None
    for bundle in bundles_of(path, site_root(client, site), site):
        said = {"drafted": written(bundle.drafted)} if bundle.drafted is not None else {}
        answer = _send(client, bundle, {"file": bundle.file, "texts": bundle.texts, "by": by, **said})
        if not quiet and answer.what != "same":
            for text in answer.warnings:
                typer.echo(f"warning: {text}\n", err=True)
            typer.echo(answer.text, err=True)
    assert answer is not None, "the file itself is the last"
    return answer


def _send(client: Client, bundle: TaskFiles, body: dict[str, Any]) -> TaskLoaded:
    try:
        return client.post(TaskLoaded, "/v1/library", body)
    except ApiError as error:
        if error.code != "too_large":
            raise
        most = f"an engine takes at most {BODY_LIMIT:,} bytes at once"
        what = "the file is" if len(bundle.texts) == 1 else "the file and what it imports are"
        raise ApiError(
            error.code,
            f"{bundle.file}: {what} too large: {most}",
            help="split it into smaller tasks that import less, or leave out what no task needs",
            status=error.status,
        ) from error


def site_root(client: Client, site: Path | None) -> Path:
    """Return the folder below which task files are: that of the engine's site, or for one elsewhere the one here."""
    if client.address.folder:
        return Path(client.address.folder).parent.parent.resolve()
    return (site.parent if site is not None else Path()).resolve()


def bundles_of(path: Path, root: Path, site: Path | None = None) -> list[TaskFiles]:
    """Return what to send for a task file: first the tasks that it requests, then itself.

    Args:
        path: of the file.
        root: the folder of the site.
        site: its file, which names its catalogues; None = `site.yaml` in that folder, if there is one.

    Raises:
        UnusableFile: a file cannot be read, or lies outside of `root` or in a hidden folder.
    """
    from formiga_bt.services.kept.drafted import known_below

    file = (site or root / "site.yaml").resolve()
    catalogue = read_world((), file if file.is_file() else None).catalogue
    return list(_bundles(readable(path).resolve(), root, catalogue, set(), known_below(root)))


def _bundles(file: Path, root: Path, catalogue: "Catalogue", seen: set[Path], known: "Known") -> Iterator[TaskFiles]:
    from formiga_bt.lang.loader import load_task
    from formiga_bt.services.kept.drafted import who_drafted

    seen.add(file)
    loaded = load_task(file, catalogue=catalogue)
    for other in (Path(one) for one in loaded.task.requests.values() if one) if loaded.task is not None else ():
        if other not in seen and not _ships(other):
            yield from _bundles(other, root, catalogue, seen, known)
    if str(file) not in loaded.sources:
        raise UnusableFile(f"cannot read {file}: {loaded.diagnostics[0].message if loaded.diagnostics else 'no text'}")
    # Labels of what ships are short, all others are whole paths, as the task's own is.
    own = {name: text for name, text in loaded.sources.items() if Path(name).is_absolute()}
    own = {name: text for name, text in own.items() if name == str(file) or not _ships(Path(name))}
    wrote = who_drafted(loaded.task, known, own.values()) if loaded.task is not None else None
    yield TaskFiles(_below(file, root), {_below(Path(name), root): text for name, text in own.items()}, wrote)


def _ships(path: Path) -> bool:
    return path.resolve().is_relative_to(folder("trees").resolve())


def _below(path: Path, root: Path) -> str:
    real = path.resolve()
    if not real.is_relative_to(root):
        raise UnusableFile(
            f"{path} lies outside of the site's folder {root}", help=f"cp {path} {root / 'trees'}/, and name that file"
        )
    inside = real.relative_to(root)
    if any(part.startswith(".") for part in inside.parts):
        raise UnusableFile(f"{path} is hidden", help=f"cp {path} {root / 'trees'}/NAME.yaml, and name that file")
    return inside.as_posix()
