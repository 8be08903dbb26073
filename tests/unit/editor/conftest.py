"""Files in an editor, with the position where `|` stands."""

from pathlib import Path

import pytest

from formiga_bt.base.packaged import folder
from formiga_bt.editor.checks import check
from formiga_bt.editor.project import Document, Project

TASK = """\
formiga: 1
task: Look
imports: [lib/flying.yaml]
params:
  target: place
  height: {type: distance, default: 60 m, help: How high it looks from.}
  robot: {type: agent, of: [lwd], optional: true}
vars:
  spots: ${circle(above(target, height), 5 m)}
  rounds: 2
agents:
  drone:
    type: lwd
    near: ${target}
    prefer: ${robot}
steps:
  - call: FlyTo
    with:
      drone: ${drone}
      to: ${target}
      height: ${height}
  - ask: Is ${target} clear?
    of: [watchers]
    timeout: 5 min
    save_as: reply
    expect: result.answer == 'yes'
  - for:
      spot: ${spots}
    steps:
      - do: drone.GoTo
        when: reply.by != drone.id
        with: {to: "${spot}"}
  - call: ReturnHome
    with: {drone: "${drone}"}
"""


class Editor:
    """One file that is open and was checked."""

    def __init__(self, text: str, folder_: Path, name: str = "look.yaml", site: Path | None = None) -> None:
        self.project = Project(site=site)
        self.document = Document(folder_ / name, text, 1)
        self.project.open[self.document.path] = self.document
        self.recheck()

    def recheck(self) -> None:
        found = check(self.project, self.document)
        self.document.diagnostics = found.diagnostics
        if found.seen is not None:
            self.document.seen = found.seen
        self.document.index()

    def type(self, text: str) -> None:
        """Put another text into the file, which is not checked yet."""
        self.document = self.document.changed(text, self.document.version + 1)
        self.project.open[self.document.path] = self.document

    def cursor(self, old: str, new: str = "") -> tuple[int, int]:
        """Replace `old` by `new`, in which `|` is the cursor; return line and column of it."""
        text = self.document.text
        assert old in text
        place = text.index(old)
        written = new or old
        at = place + written.index("|") if "|" in written else place
        self.type(text[:place] + written.replace("|", "", 1) + text[place + len(old) :])
        before = self.document.text[:at]
        return before.count("\n"), at - before.rfind("\n") - 1


@pytest.fixture
def editor(tmp_path: Path) -> Editor:
    return Editor(TASK, tmp_path, site=folder("trees") / "demo-site.yaml")
