"""A speed that a step writes down is held against max_speed of the envelope, as a height is against max_height."""

from pathlib import Path

import pytest

from formiga_bt.lang.loader import load_catalogue, load_task_text

ROOT = Path(__file__).parents[3]
TASK = """\
formiga: 1
task: Drives
params: {{shelf: place}}
agents: {{rover: {{type: rover, near: "${{shelf}}"}}}}
%s
steps:
  - do: rover.Drive
    with: {{to: "${{shelf}}", speed: {speed}}}
"""


@pytest.mark.parametrize(
    ("speed", "envelope", "said"),
    [
        ("2 m/s", "", []),
        ("3 m/s", "", [("E062", "speed 3 m/s is above the limit of 2 m/s for rover")]),
        ("6 m/s", "", [("E062", "speed 6 m/s is above the limit of 2 m/s for rover")]),
        (
            "1.5 m/s",
            "envelope: {max_speed: 1 m/s}",
            [("E062", "speed 1.5 m/s is above the limit of 1 m/s for this task")],
        ),
    ],
)
def test_a_speed_is_held_against_the_envelope(speed: str, envelope: str, said: list[tuple[str, str]]) -> None:
    catalogue = load_catalogue([ROOT / "actions" / f"{name}.yaml" for name in ("base", "ground")])[0]

    found = load_task_text(TASK.format(speed=speed) % envelope, "drives.yaml", catalogue=catalogue).diagnostics

    assert [(one.code, one.message) for one in found if one.severity == "error"] == said
