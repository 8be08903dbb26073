"""docs/reasons.md is the closed table of codes: every code in the source stands in it."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATTERNS = (
    r'\.fail\(\s*"([a-z_]+)"',
    r'Failure\(\s*(?:code=)?"([a-z_:]+)"',
    r'\bHold\("([a-z_]+)"',
    r'\bRefuse\("([a-z_]+)"',
    r'\bAlarm\("([a-z_]+)"',
    r'\.alarm\("([a-z_]+)"',
    r'_fail\(view, "([a-z_]+)"',
    r'return "([a-z_]+)", (?:agent|missing|role|"|f"|home)',
    r'\brefused = "([a-z_]+)"',
    r'return "" if [^\n]* else "([a-z_]+)", home',
)


def test_every_code_of_the_source_is_documented() -> None:
    documented = set(re.findall(r"`([a-z_]+)`", (ROOT / "docs/reasons.md").read_text()))
    found: dict[str, str] = {}
    for room in ("engine", "nodes", "safety"):
        for path in (ROOT / "formiga_bt" / room).rglob("*.py"):
            for pattern in PATTERNS:
                found |= dict.fromkeys(re.findall(pattern, path.read_text()), path.name)

    assert len(found) > 25, "the patterns no longer find the codes"
    assert {code: where for code, where in found.items() if code not in documented} == {}
