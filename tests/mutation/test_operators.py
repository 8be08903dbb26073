"""The faults of `benchmarks/mutation.py`, a part of them in the suite: slips that must never pass, on one mission."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from tests.mutation.operators import faults

CATALOGUE = load_catalogue([folder("actions") / "base.yaml"])[0]
SITE = load_site(folder("trees") / "demo-site.yaml", CATALOGUE)[0]
NEVER_PASS = (
    "misspelt_action", "misspelt_key", "misspelt_field", "unknown_name", "unknown_agent_field", "dropped_definition",
    "wrong_unit", "missing_unit", "wrong_literal", "ground_for_air", "dropped_landing", "landing_on_one_path",
    "ignored_failure", "other_action", "step_twice", "short_task",
)  # fmt: skip


def plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [plain(value) for value in data]
    return int(data) if re.fullmatch(r"-?\d+", data) else data


def codes(data: Any) -> set[str]:
    text = yaml.safe_dump(data, sort_keys=False, width=10_000)
    loaded = load_task_text(text, "pick_up.yaml", catalogue=CATALOGUE, site=SITE, folder_=Path(folder("trees")))
    return {one.code for one in loaded.diagnostics}


PICK_UP = plain(yaml.load((folder("trees") / "pick_up.yaml").read_text(encoding="utf-8"), yaml.BaseLoader))


def test_the_mission_itself_passes() -> None:
    assert codes(PICK_UP) == set()


@pytest.mark.parametrize("operator", NEVER_PASS)
def test_a_fault_of_this_kind_is_told(operator: str) -> None:
    mine = [fault for fault in faults(PICK_UP) if fault.operator == operator]

    assert mine or operator == "unknown_agent_field"
    assert [f"{fault.where}: {fault.what}" for fault in mine if not codes(fault.data)] == []
