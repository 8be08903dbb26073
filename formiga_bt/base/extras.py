"""What to install for a part of formiga_bt that needs more packages than the rest: a command that works wherever that is.

It names the packages themselves, and the interpreter that runs: so it is right in a checkout, for a wheel from a file, and in
any virtual environment.
"""

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec
from typing import Final, Literal

from formiga_bt.base.errors import UnusableFile

DISTRIBUTION: Final = "formiga-bt"
Extra = Literal["lsp", "mcp", "llm", "local-llm", "postgres", "parquet", "charts", "news"]
"""Those of pyproject.toml that somebody who uses formiga_bt may lack."""


def packages(extra: Extra) -> list[str]:
    """Return what an extra requires, as `pip` takes it; nothing if the installation does not know."""
    try:
        lines = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return []
    parts = [line.partition(";") for line in lines]
    return [
        name.strip() for name, _, when in parts if re.search(rf"""\bextra\s*==\s*["']{re.escape(extra)}["']""", when)
    ]


def install(extra: Extra) -> str:
    """Return the command that installs what an extra requires."""
    named = packages(extra) or [f"{DISTRIBUTION}[{extra}]"]
    return f"{shlex.quote(sys.executable)} -m pip install {shlex.join(named)}"


def need_charts(what: str, otherwise: str = "") -> None:
    """Look whether the packages that draw are there; they are found, not imported.

    Args:
        what: is to be drawn, as the subject of a sentence in the plural: "charts".
        otherwise: what can be had without them.

    Raises:
        UnusableFile: one is missing.
    """
    if missing := [name for name in ("matplotlib", "resvg_py") if find_spec(name) is None]:
        more = f"\n        or {otherwise}" if otherwise else ""
        raise UnusableFile(
            f"{what} need {' and '.join(missing)}, not installed here", help=f"{install('charts')}{more}"
        )
