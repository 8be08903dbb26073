"""The import directions of docs/architecture.md hold."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
LINT = "from importlinter.cli import lint_imports_command as lint; lint(['--no-cache'])"


def test_rooms_import_in_the_agreed_directions_only() -> None:
    done = subprocess.run([sys.executable, "-c", LINT], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_room_has_its_layer() -> None:
    layers = (ROOT / ".importlinter").read_text(encoding="utf-8")
    rooms = [p.stem for p in sorted((ROOT / "formiga_bt").iterdir()) if p.is_dir() or p.suffix == ".py"]
    assert [room for room in rooms if f"formiga_bt.{room}" not in layers and not room.startswith("_")] == []


def test_every_wire_is_kept_out_of_the_engine() -> None:
    """All of the room but the seam, and the rules that every agent follows, are wires."""
    contracts = (ROOT / ".importlinter").read_text(encoding="utf-8")
    wires = {p.stem for p in (ROOT / "formiga_bt" / "transport").glob("[a-z]*.py")} - {
        "base",
        "cards",
        "messages",
        "codec",
        "agent_side",
        "attachments",
        "calls",
    }
    assert [wire for wire in sorted(wires) if f"formiga_bt.transport.{wire}" not in contracts] == []
