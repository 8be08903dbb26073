"""`--actions`: the option of all verbs that read a catalogue."""

from pathlib import Path
from typing import Annotated

import typer

ActionsOption = Annotated[
    list[Path] | None,
    typer.Option(
        help="Catalogue beside those of the site: a file, or the name of one that ships; may be repeated.",
        metavar="FILE",
    ),
]
