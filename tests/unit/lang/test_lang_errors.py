"""The museum of mistakes: each file of tests/lang_errors is refused (or warned about) with exactly these words.

`pytest tests/unit/lang/test_lang_errors.py --update-golden` rewrites the expected texts; read the difference.
"""

import re
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.lang.loader import load_catalogue, load_site, load_task
from formiga_bt.lang.model import Catalogue
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
MUSEUM = ROOT / "tests" / "lang_errors"
FILES = sorted(path.name for path in MUSEUM.glob("*.yaml"))


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue(
        [ROOT / "actions" / "base.yaml", MUSEUM / "catalogue" / "kite.yaml", MUSEUM / "catalogue" / "yard.yaml"]
    )

    assert not problems
    return found


def read(name: str, catalogue: Catalogue) -> tuple[list[Diagnostic], str]:
    path = Path(name)
    if name.startswith("site_"):
        _, found, sources = load_site(path, catalogue)
    elif name.startswith("catalogue_"):
        _, found, sources = load_catalogue([path])
    else:
        file = ROOT / "trees" / "demo-site.yaml" if "of_site" in name else MUSEUM / "catalogue" / "hall-site.yaml"
        site = load_site(file, catalogue)[0] if "of_site" in name or "of_hall" in name else None
        loaded = load_task(path, catalogue=catalogue, site=site)
        found, sources = loaded.diagnostics, dict(loaded.sources)
        assert (loaded.task is None) == any(d.severity == "error" for d in found)
    return found, "\n\n".join(render(d, sources) for d in found) + "\n"


@pytest.mark.parametrize("name", FILES)
def test_the_mistake_is_reported_in_these_words(
    name: str, catalogue: Catalogue, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(MUSEUM)
    found, text = read(name, catalogue)

    wording.file(MUSEUM / name.replace(".yaml", ".expected.txt"), text)
    code = re.match(r"[EW]\d{3}", name)
    assert code is None or code[0] in {d.code for d in found}


def test_every_code_that_the_loader_reports_is_in_the_museum() -> None:
    pinned = set(re.findall(r": ([EW]\d{3}): ", "".join(p.read_text() for p in MUSEUM.glob("*.expected.txt"))))
    source = "".join(path.read_text() for path in (ROOT / "formiga_bt" / "lang").rglob("*.py"))
    of_requests = {"E063"}  # a value given from outside has no file

    assert set(re.findall(r'"([EW]\d{3})"', source)) - of_requests <= pinned
