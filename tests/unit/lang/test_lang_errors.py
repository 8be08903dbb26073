"""The museum of mistakes: each file of tests/lang_errors is refused (or warned about) with exactly these words.

`pytest tests/unit/lang/test_lang_errors.py --update-golden` rewrites the expected texts; read the difference.
"""

import re

import pytest

import formiga_bt.base.wires as wires
from formiga_bt.base.diagnostics import render
from formiga_bt.lang.loader import load_catalogue
from formiga_bt.lang.model import Catalogue
from formiga_bt.lang.pages import messages, pages
from formiga_bt.lang.text import document
from tests.golden import Wording
from tests.unit.lang.museum import (
    CATALOGUES,
    FILES,
    MUSEUM,
    ROOT,
    WIRES,
    Place,
    Visits,
    expected,
    page_of_messages,
    places,
    read,
)

UNREACHED = {
    ("lang/request/value_files.py", "the file is larger than"): "a megabyte, which the museum does not hold",
    ("lang/site/ground.py", "is larger than"): "a hundred megabytes, which the museum does not hold",
    ("lang/site/ground.py", "cannot be read"): "a file that is there and whose rights, or disk, refuse it",
}
"""Places that no file of the museum reaches, by their file and a piece of their text, and why."""


@pytest.fixture(autouse=True)
def in_the_museum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(MUSEUM)
    monkeypatch.setattr(wires, "entry_points", lambda **given: WIRES.select(**given))


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue(CATALOGUES)

    assert not problems
    return found


@pytest.mark.parametrize("name", FILES)
def test_the_mistake_is_reported_in_these_words(name: str, catalogue: Catalogue, wording: Wording) -> None:
    found, sources = read(name, catalogue)

    text = "\n\n".join(render(d, sources) for d in found).replace(f"{ROOT}/", "")
    wording.file(expected(name), f"{text}\n")
    code = re.match(r"[EW]\d{3}", name)
    assert code is None or code[0] in {d.code for d in found}


def test_every_place_that_reports_a_problem_is_reached(catalogue: Catalogue) -> None:
    there = places()
    visits = Visits(there)
    document._parsed.cache_clear()  # what a test before has read would be read no more
    for name in FILES:
        with visits:
            read(name, catalogue)

    missed = [
        str(place) for place in there if place not in visits.passed and not any(_is(place, one) for one in UNREACHED)
    ]
    assert not missed, "\n".join(missed)
    needless = [one for one in UNREACHED if not any(_is(place, one) and place not in visits.passed for place in there)]
    assert not needless


def _is(place: Place, one: tuple[str, str]) -> bool:
    return place.file.endswith(f"formiga_bt/{one[0]}") and one[1] in place.text


def test_the_page_of_messages_is_as_they_are(wording: Wording) -> None:
    wording.file(ROOT / "docs" / "messages.md", page_of_messages())


def test_each_code_has_messages_on_that_page() -> None:
    assert set(messages()) == set(pages())
