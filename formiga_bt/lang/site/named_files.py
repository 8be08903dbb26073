"""The files beside a site file that its text names: catalogues, the heights of its ground, and what else is named.

The files that `news` names are secrets: whoever copies a site copies none of them, so that its copy tells nobody anything.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import assert_never

from formiga_bt.lang.text.document import Listing, Mapping_, Node, Scalar, parse_file


def named_files(text: str, file: Path) -> list[Path]:
    """Return the files that some word of a site's text is the path of, looked up beside the site file; no secrets of news."""
    root, _ = parse_file(text, str(file))
    parts = root.entries if isinstance(root, Mapping_) else ()
    words = (word for part in parts if part.key.text != "news" for word in _words(part.value))
    found = (file.parent / word for word in words if word and "\0" not in word and len(word) < 1000)
    return list(dict.fromkeys(one for one in found if _is_file(one)))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a word that can be no path
        return False


def _words(node: Node | None) -> Iterator[str]:
    match node:
        case None:
            return
        case Scalar():
            yield node.text
        case Listing():
            for item in node.items:
                yield from _words(item)
        case Mapping_():
            for entry in node.entries:
                yield from _words(entry.value)
        case _:
            assert_never(node)
