"""Files to start from, which stand beside this one: of `formiga init` the site and its first task, of `formiga new` its kinds.

`@Task`, `@file` and `@site` in them become the names of the new file. Checked and flown by the tests of both verbs.
"""

from pathlib import Path


def start(name: str) -> str:
    """Return the text of a file to start from."""
    return (Path(__file__).parent / f"{name}.yaml").read_text(encoding="utf-8")
