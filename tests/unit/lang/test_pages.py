"""Every code of the checker has a page whose wrong example has that mistake, and whose right one has none at all."""

import re
from pathlib import Path

import pytest

from formiga_bt.base.diagnostics import Diagnostic, render
from formiga_bt.lang.loader import load_catalogue, load_task_text
from formiga_bt.lang.pages import PageExample, pages, reasons, reasons_of, whole
from formiga_bt.lang.site import load_site, load_site_text
from tests.golden import Wording

ROOT = Path(__file__).parents[3]
BASE = ROOT / "actions" / "base.yaml"
REQUESTS_ONLY = {"E063"}
"""Codes of what a request gives, not of files."""


def checked(example: PageExample, folder: Path) -> tuple[list[Diagnostic], str]:
    files = [BASE]
    if example.of == "catalogue":
        more = folder / "more.yaml"
        more.write_text(example.text.partition("---\n")[0], encoding="utf-8")
        files.append(more)
    elif example.of == "library":
        path = folder / example.text.partition("\n")[0].removeprefix("# ")
        path.parent.mkdir(exist_ok=True)
        path.write_text(example.text.partition("---\n")[0], encoding="utf-8")
    catalogue, found, _ = load_catalogue(files)
    text = whole(example)
    if example.of == "site":
        return load_site_text(text, str(folder / "site.yaml"), catalogue)[1], text
    site = load_site(ROOT / "trees" / "demo-site.yaml", catalogue)[0]
    loaded = load_task_text(text, "example.yaml", catalogue=catalogue, site=site, folder_=folder)
    return [*found, *loaded.diagnostics], text


@pytest.mark.parametrize("code", [code for code in pages() if code not in REQUESTS_ONLY])
def test_the_page_of_a_code_shows_the_mistake_and_its_repair(code: str, tmp_path: Path) -> None:
    page = pages()[code]
    assert page.wrong is not None, f"docs/errors.md has no wrong example for {code}"
    assert page.right is not None, f"docs/errors.md has no right example for {code}"

    found, text = checked(page.wrong, tmp_path)
    assert code in {d.code for d in found}, "\n".join([text, *(render(d, {"example.yaml": text}) for d in found)])
    found, text = checked(page.right, tmp_path)
    assert not found, "\n".join([text, *(render(d, {"example.yaml": text}) for d in found)])


@pytest.mark.parametrize("code", pages())
def test_a_page_says_why_before_it_shows_anything(code: str) -> None:
    assert re.match(r"[A-Z`][^\n]{30,}", pages()[code].text)


def test_there_is_no_page_of_a_code_that_is_not() -> None:
    text = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")

    assert re.findall(r"^## (\w\d{3})$", text, re.MULTILINE) == sorted(pages(), key=list(pages()).index)


def test_reason_codes_are_found_with_and_without_their_own_part(wording: Wording) -> None:
    wording(reasons_of("rejected")[0].group)
    assert reasons_of("failed:blocked")[0].codes == ("failed:<code>",)
    assert any("envelope.reserve" in one.codes for one in reasons_of("envelope.reserve"))
    assert {one.group for one in reasons_of("timeout")} == {"Why a step failed", "Why a task ended"}
    assert reasons_of("nonsense") == ()
    assert len(reasons()) > 60
