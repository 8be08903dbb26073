"""What to install for a part of formiga_bt that needs more packages than the rest: a command that works wherever that is.

It names the packages themselves, and the interpreter that runs: so it is right in a checkout, for a wheel from a file, and in
any virtual environment.
"""

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, requires
from typing import Final, Literal

DISTRIBUTION: Final = "formiga-bt"
Extra = Literal["lsp", "mcp", "llm", "local-llm", "postgres", "parquet"]
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
