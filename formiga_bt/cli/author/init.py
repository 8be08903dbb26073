"""`formiga init`: a folder to start from, with a site and a first task that flies."""

import re
import shlex
import unicodedata
from pathlib import Path
from typing import Annotated

import typer

from formiga_bt.cli.author.starts import start
from formiga_bt.cli.inputs import UnusableFile
from formiga_bt.cli.printing import show_next


def command(
    folder: Annotated[Path, typer.Argument(help="The folder; made if it is not there.", metavar="DIR")] = Path("."),
) -> None:
    """Make a folder to start from: site.yaml with named places, and trees/hello.yaml, a first task that flies."""
    files = {
        folder / "site.yaml": start("site").replace("@site", site_name(folder)),
        folder / "trees" / "hello.yaml": start("hello"),
        folder / ".gitignore": ".formiga/\n",
    }
    if folder.exists() and not folder.is_dir():
        raise UnusableFile(f"{folder} is a file, not a folder; nothing was changed", help="name another folder")
    there = [str(path) for path in files if path.exists() and path.name != ".gitignore"]
    if there:
        raise UnusableFile(f"{', '.join(there)}: there already; nothing was changed", help="name another folder")
    try:
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists():
                path.write_text(text, encoding="utf-8")
                typer.echo(f"made {path}")
    except OSError as error:
        raise UnusableFile(f"cannot write in {folder}: {error.strerror or error}") from error
    words = shlex.quote(str(folder))
    first = "" if folder.resolve() == Path.cwd() else f"cd {'-- ' if words.startswith('-') else ''}{words} && "
    show_next(f"{first}formiga up --sim", f"{first}formiga dryrun trees/hello.yaml --site site.yaml")


def site_name(folder: Path) -> str:
    """Return a name for the site of a folder: that of the folder, as far as it can be one."""
    plain = unicodedata.normalize("NFKD", folder.resolve().name)
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    word = re.sub(r"[^A-Za-z0-9_]+", "_", plain).strip("_")
    return word if re.match(r"[A-Za-z]", word) else f"site_{word}".rstrip("_")
