"""The shipped catalogue and demo site, read once for all tests of the language."""

from collections.abc import Callable
from pathlib import Path

import pytest

from formiga_bt.lang.loader import Loaded, load_catalogue, load_site, load_task_text
from formiga_bt.lang.model import Catalogue, Site, Task

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def catalogue() -> Catalogue:
    found, problems, _ = load_catalogue([ROOT / "actions" / "base.yaml"])

    assert problems == []
    return found


@pytest.fixture(scope="session")
def demo_site(catalogue: Catalogue) -> Site:
    found, problems, _ = load_site(ROOT / "trees" / "demo-site.yaml", catalogue)

    assert problems == []
    assert found is not None
    return found


@pytest.fixture
def load(catalogue: Catalogue) -> Callable[[str], Loaded]:
    """Load a task from its text; `formiga:` and `task:` are put before it."""

    def read(text: str) -> Loaded:
        return load_task_text("formiga: 1\ntask: Example\n" + text, "example.yaml", catalogue=catalogue)

    return read


@pytest.fixture
def task(load: Callable[[str], Loaded]) -> Callable[[str], Task]:
    """Load a task that has no problems at all."""

    def read(text: str) -> Task:
        loaded = load(text)
        assert loaded.diagnostics == []
        assert loaded.task is not None
        return loaded.task

    return read
