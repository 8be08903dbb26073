"""What is wrong in files, in the forms that programs read: JSON, SARIF 2.1.0, annotations of GitHub.

Called by `formiga check`. The shapes are described in docs/authoring.md.
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from formiga_bt import __version__
from formiga_bt.base.diagnostics import Diagnostic, Mark

SARIF_SCHEMA: Final = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def as_dict(diagnostic: Diagnostic) -> dict[str, Any]:
    """Return a diagnostic as a JSON object: code, severity, file and span, message, help, within, fix."""
    fix = diagnostic.fix
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        **_span(diagnostic.mark),
        "message": diagnostic.message,
        "help": diagnostic.help,
        "within": diagnostic.within,
        "fix": {"mark": _span(fix.mark), "text": fix.text} if fix else None,
    }


def _span(mark: Mark) -> dict[str, Any]:
    return {"file": mark.file, "line": mark.line, "col": mark.col, "end_line": mark.end_line, "end_col": mark.end_col}


def as_json(problems: Iterable[Diagnostic], head: dict[str, Any]) -> str:
    """Return one JSON object: the keys of `head`, then `diagnostics`."""
    return json.dumps({**head, "diagnostics": [as_dict(d) for d in problems]}, indent=2)


def as_sarif(problems: Sequence[Diagnostic], about: dict[str, str]) -> str:
    """Return a SARIF 2.1.0 log with one run.

    Args:
        problems: the results.
        about: what a code means, in a line, for the rules; a code that is missing has none.
    """
    codes = sorted({d.code for d in problems})
    rules = [
        {
            "id": code,
            **({"shortDescription": {"text": about[code]}} if code in about else {}),
            "defaultConfiguration": {"level": "warning" if code.startswith("W") else "error"},
        }
        for code in codes
    ]
    driver = {"name": "formiga", "semanticVersion": __version__, "rules": rules}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(d, codes.index(d.code)) for d in problems],
    }
    return json.dumps({"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2)


def _result(diagnostic: Diagnostic, rule: int) -> dict[str, Any]:
    text = diagnostic.message + (f"\nhelp: {diagnostic.help}" if diagnostic.help else "")
    place: dict[str, Any] = {"physicalLocation": {**_artifact(diagnostic.mark), "region": _region(diagnostic.mark)}}
    if diagnostic.within:
        place["logicalLocations"] = [{"fullyQualifiedName": diagnostic.within}]
    result: dict[str, Any] = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule,
        "level": diagnostic.severity,
        "message": {"text": text},
        "locations": [place],
    }
    fix = diagnostic.fix
    if fix is not None:
        replacement = {"deletedRegion": _region(fix.mark), "insertedContent": {"text": fix.text}}
        result["fixes"] = [
            {
                "description": {"text": diagnostic.help or diagnostic.message},
                "artifactChanges": [{**_artifact(fix.mark), "replacements": [replacement]}],
            }
        ]
    return result


def _artifact(mark: Mark) -> dict[str, Any]:
    path = Path(mark.file)
    if path.is_absolute():
        here = Path.cwd()
        uri = quote(path.relative_to(here).as_posix()) if path.is_relative_to(here) else path.as_uri()
    else:
        uri = quote(path.as_posix())
    return {"artifactLocation": {"uri": uri}}


def _region(mark: Mark) -> dict[str, int]:
    region = {"startLine": mark.line, "startColumn": mark.col}
    if mark.end_line:
        region |= {"endLine": mark.end_line, "endColumn": mark.end_col}
    return region


def as_github(diagnostic: Diagnostic) -> str:
    """Return a diagnostic as a workflow command that GitHub shows beside the line."""
    mark = diagnostic.mark
    keys = {"file": _relative(mark.file), "line": str(mark.line), "col": str(mark.col)}
    if mark.end_line == mark.line and mark.end_col > mark.col:
        keys["endColumn"] = str(mark.end_col)
    elif mark.end_line > mark.line:
        keys["endLine"] = str(mark.end_line)
    keys["title"] = diagnostic.code
    said = ",".join(f"{key}={_escaped(value, ':,')}" for key, value in keys.items())
    text = diagnostic.message + (f"\nhelp: {diagnostic.help}" if diagnostic.help else "")
    return f"::{diagnostic.severity} {said}::{_escaped(text)}"


def _relative(file: str) -> str:
    path, here = Path(file), Path.cwd()
    return path.relative_to(here).as_posix() if path.is_absolute() and path.is_relative_to(here) else path.as_posix()


def _escaped(text: str, more: str = "") -> str:
    for char in "%\r\n" + more:
        text = text.replace(char, f"%{ord(char):02X}")
    return text
