"""Site files (`formiga_site: 1`): base station, ports, places, regions, layers, people and agents.

Places become metres east and north of the base; latitudes and longitudes go through `geo.Frame`. Called by the command
line, the engine's front and tests. `reader` reads the keys, `points` the places, and `whole` says what must fit together.
"""

from pathlib import Path

from formiga_bt.diagnostics import Diagnostic, Mark, in_order
from formiga_bt.lang.document import parse
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.lang.reading import Problems, read_keys, read_mapping
from formiga_bt.lang.site.keys import AGENT, APPROVERS, BASE, PILOT, PORT, SITE, TERRAIN
from formiga_bt.lang.site.reader import SiteReader

__all__ = ["AGENT", "APPROVERS", "BASE", "PILOT", "PORT", "SITE", "TERRAIN", "load_site", "load_site_text"]


def load_site(path: Path, catalogue: Catalogue | None = None) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read a site file.

    Args:
        path: of the file.
        catalogue: the agent types that its agents may have; without one, any type is accepted.

    Returns:
        The site (None if there is any error), all problems in file order, and the file's text by its name.
    """
    file = str(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return None, [Diagnostic("E008", Mark(file, 1, 1), f"the file cannot be read: {error}")], {}
    return load_site_text(text, file, catalogue)


def load_site_text(
    text: str, file: str, catalogue: Catalogue | None = None
) -> tuple[Site | None, list[Diagnostic], dict[str, str]]:
    """Read the text of a site file; `file` is its name in marks, and `catalogue` has the types of its agents."""
    problems = Problems()
    node, found = parse(text, file)
    problems.extend(found)
    if node is None and not found:
        problems.add("E008", Mark(file, 1, 1), "the file is empty", "begin with: formiga_site: 1")
    root = read_mapping(node, problems, "site") if node is not None else None
    site = None
    if root is not None:
        keys = read_keys(root, SITE, problems, "a site")
        site = SiteReader(problems, keys, catalogue, file).read(text)
    return (None if problems.has_errors() else site), in_order(problems.found), {file: text}
