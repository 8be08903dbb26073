"""Mistakes that people make, written by hand: reads them, makes them in their task, and says what finds each."""

import re
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

import yaml

from formiga_bt.base.packaged import folder
from formiga_bt.lang.loader import load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Catalogue, Site
from formiga_bt.rehearsal.cases.coverage import Coverage
from formiga_bt.rehearsal.cases.judging import judge
from formiga_bt.rehearsal.cases.reading import load_cases
from formiga_bt.rehearsal.cases.running import play

HERE: Final = Path(__file__).parent
BASES: Final = ("look", "patrol", "team", "deliver", "carry", "survey", "guard", "relay")

Decidable = Literal["yes", "test", "no"]
By = Literal["check", "test", "nothing"]


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake in one of the tasks beside this file."""

    base: str
    wrong: str
    decidable: Decidable
    pairs: tuple[tuple[str, str], ...]
    """What stands there, and what is written instead."""

    @property
    def text(self) -> str:
        """Return the task with the mistake in it.

        Raises:
            ValueError: what is replaced does not stand there just once.
        """
        text = base_text(self.base)
        for old, new in self.pairs:
            text = _replaced(text, old, new)
        return text


@dataclass(frozen=True, slots=True)
class Found:
    """What finds a mistake."""

    by: By
    what: str
    """Codes of the checker, the cases that fail, or the steps that no case reaches any more."""


@lru_cache(maxsize=1)
def mistakes() -> tuple[Mistake, ...]:
    """Return all mistakes, in the order of the file."""
    return tuple(_read(yaml.safe_load((HERE / "mistakes.yaml").read_text(encoding="utf-8"))))


def _read(data: list[dict[str, Any]]) -> Iterator[Mistake]:
    words: dict[Any, Decidable] = {True: "yes", False: "no", "test": "test"}
    for one in data:
        pairs = [(one["old"], one["new"]), *(tuple(pair) for pair in one.get("also", ()))]
        yield Mistake(one["base"], one["wrong"], words[one["decidable"]], tuple(pairs))


def base_text(base: str) -> str:
    """Return a task without a mistake."""
    return (HERE / f"{base}.yaml").read_text(encoding="utf-8")


def _replaced(text: str, old: str, new: str) -> str:
    pattern = r"\n *".join(re.escape(line.lstrip(" ")) for line in old.removesuffix("\n").split("\n"))
    whole = old.endswith("\n")
    spans = [match.span() for match in re.finditer(pattern + ("\n" if whole else ""), text)]
    if len(spans) != 1:
        raise ValueError(f"stands there {len(spans)} times: {old!r}")
    start, end = spans[0]
    line = text.rfind("\n", 0, start) + 1
    indent = re.match(" *", text[line:])[0]  # type: ignore[index]
    if not new:
        return text[: line if whole else start] + text[end:]
    return text[:start] + new.removesuffix("\n").replace("\n", "\n" + indent) + ("\n" if whole else "") + text[end:]


@lru_cache(maxsize=2)
def ground(base: str) -> tuple[Site, Catalogue]:
    """Return the site and the catalogue of a task."""
    files = ["base", "ground", "building"] if base == "carry" else ["base"]
    catalogue = load_catalogue([folder("actions") / f"{name}.yaml" for name in files])[0]
    site = load_site(site_of(base), catalogue)[0]
    assert site is not None
    return site, catalogue


def site_of(base: str) -> Path:
    """Return the site file of a task."""
    return folder("trees") / ("warehouse/site.yaml" if base == "carry" else "demo-site.yaml")


def said(base: str, text: str) -> list[str]:
    """Return the codes that the checker says of a task on its site, in order."""
    site, catalogue = ground(base)
    loaded = load_task_text(text, f"{base}.yaml", catalogue=catalogue, site=site, folder_=HERE)
    return sorted({problem.code for problem in loaded.diagnostics})


def found(mistake: Mistake) -> Found:
    """Say what finds a mistake: the checker, else the cases of its task and their coverage, else nothing."""
    codes = said(mistake.base, mistake.text)
    if codes:
        return Found("check", " ".join(codes))
    failed = played(mistake.base, mistake.text)
    return Found("test", "; ".join(failed)) if failed else Found("nothing", "")


def played(base: str, text: str) -> list[str]:
    """Return the cases of a task that fail with this text, and the steps that no case reaches."""
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        (here / f"{base}.yaml").write_text(text, encoding="utf-8")
        shutil.copy(site_of(base), here / "site.yaml")
        cases = (HERE / f"{base}.test.yaml").read_text(encoding="utf-8").replace("../../trees/warehouse/", "")
        (here / f"{base}.test.yaml").write_text(cases, encoding="utf-8")
        loaded = load_cases(here / f"{base}.test.yaml")
        if loaded.cases is None:
            return ["the test file does not fit"]
        coverage = Coverage(loaded.cases.task)
        failed = [case.name for case in loaded.cases.cases if judge(case, play(loaded.cases, case, coverage))]
        missed = [f"never reached: {step.title}" for step in coverage.missed]
        return [*failed, *missed, *(f"never taken: {step.title} {way}" for step, way in coverage.untaken)]
