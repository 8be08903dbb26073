"""Which site a file belongs to: `site.yaml` in its folder, or in the nearest folder above.

Called by the editor's server and by `formiga check`, which judge files of several sites at once.
"""

from pathlib import Path
from typing import Final

SITE_FILE: Final = "site.yaml"
"""What a site's file is called in its folder."""


def site_near(folder: Path, top: Path | None = None) -> Path | None:
    """Return the site file of a folder, else of the nearest folder above that has one; None if there is none.

    Args:
        folder: where to begin.
        top: not looked for above this folder, nor above one that is a repository.
    """
    for place in (folder, *folder.parents, *(Path.cwd().parents if not folder.is_absolute() else ())):
        if (place / SITE_FILE).is_file():
            return place / SITE_FILE
        if place == top or (place / ".git").exists():
            break
    return None
