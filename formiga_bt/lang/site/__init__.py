"""Site files (`formiga_site: 1`): base station, ports, places, regions, layers, people and agents.

Places become metres east and north of the base; latitudes and longitudes go through `geo.Frame`. Called by the command
line, the engine's front and tests. `reader` reads the keys, `points` the places, and `whole` says what must fit together.
"""

from collections.abc import Callable
from pathlib import Path

from formiga_bt.base.diagnostics import Diagnostic, in_order
from formiga_bt.lang.files import read_file
from formiga_bt.lang.keyed import read_root, text_of
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.site.keys import (
    AGENT,
    ALLOCATOR,
    APPROVERS,
    BASE,
    CHANNEL,
    MAIL,
    MQTT,
    PILOT,
    PORT,
    RESOURCE,
    SECRET,
    SITE,
    TERRAIN,
    WEBHOOK,
)
from formiga_bt.lang.site.reader import SiteReader
from formiga_bt.lang.text.reading import Problems

__all__ = [
    "AGENT", "ALLOCATOR", "APPROVERS", "BASE", "CHANNEL", "MAIL", "MQTT", "PILOT", "PORT", "RESOURCE", "SECRET", "SITE",
    "TERRAIN", "WEBHOOK", "load_site", "load_site_text",
]  # fmt: skip


def load_site(path: Path, catalogue: Catalogue | None = None) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read a site file.

    Args:
        path: of the file.
        catalogue: the agent types that its agents may have; without one, any type is accepted.

    Returns:
        The site (None if there is any error), all problems in file order, and the file's text by its name.
    """
    problems = Problems()
    text = text_of(path, problems)
    return load_site_text(text, str(path), catalogue) if text is not None else (None, problems.found, {})


def load_site_text(
    text: str,
    file: str,
    catalogue: Catalogue | None = None,
    *,
    read: Callable[[Path], str] = read_file,
    on_disk: bool = True,
) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read the text of a site file.

    Args:
        text: of the file.
        file: its name in marks.
        catalogue: has its types.
        read: gives further texts.
        on_disk: its catalogues and libraries must be there; a journal's site was read when they were.
    """
    problems = Problems()
    keys = read_root(text, file, SITE, problems, what="site", owner="a site", begin="formiga_site: 1")
    if keys is None:
        return None, in_order(problems.found), {file: text}
    reader = SiteReader(problems, keys, catalogue, file, read, on_disk=on_disk)
    site = reader.read(text)
    return (None if problems.has_errors() else site), in_order(problems.found), {file: text, **reader.sources}
