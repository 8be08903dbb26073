"""Nothing that serves assistants or writes drafts reads or sends a person's secret (imports of imports: `.importlinter`)."""

import ast
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2] / "formiga_bt"
MAY_ASK: Final = {
    "cli/orders/access.py",
    "cli/orders/approve.py",
    "cli/operator/catalogue.py",
    "cli/operator/members.py",
    "cli/orders/duty.py",
}
PROGRAMS: Final = ("llm/**/*.py", "cli/integrator/mcp.py", "cli/author/draft*.py")
WORDS: Final = ("formiga-secret", "formiga_secret", "person_secrets", "secrets.json", "cli.proving", "services.proving")


def imports(file: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
        elif isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
    return found


def test_only_verbs_of_people_ask_for_a_secret() -> None:
    asks = {
        file.relative_to(ROOT).as_posix()
        for file in ROOT.rglob("*.py")
        if "proving" in file.read_text(encoding="utf-8") and "formiga_bt.cli.proving" in imports(file)
    }
    assert asks == MAY_ASK


def test_no_assistant_and_no_draft_knows_the_word() -> None:
    files = [file for pattern in PROGRAMS for file in ROOT.glob(pattern)]
    assert len(files) > 30, "the patterns find them no more"
    texts = {file: file.read_text(encoding="utf-8").lower() for file in files}
    assert [(file.name, word) for file, text in texts.items() for word in WORDS if word in text] == []
