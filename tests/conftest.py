"""Shared by all tests: with FORMIGA_EXTERNAL set, a test marked `external` that skips itself fails instead.

`wording` and --update-golden are explained in `golden`. How slowly Hypothesis draws on a busy machine is no fault of what
is tested. Files with long tests begin first (`in_order`).
"""

import gc
import os
import time
from collections.abc import Generator, Iterable
from itertools import groupby

import pytest
from hypothesis import HealthCheck, settings

from tests.golden import Golden, Wording

settings.register_profile("formiga", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("formiga")

WAIT = ("tests/e2e/", "tests/contract/")
"""Folders of long tests that mostly wait for processes."""
COMPUTE = ("tests/simulation/", "tests/safety/", "tests/missions/", "tests/property/")
"""Folders of long tests that compute, the longest first."""
GOLDEN = pytest.StashKey[Golden]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write wording.txt and other golden files as they are now"
    )


def pytest_configure(config: pytest.Config) -> None:
    os.environ["TZ"] = "UTC"  # times of day that people read are local
    time.tzset()
    update = config.getoption("update_golden")
    if update and config.getoption("numprocesses", None):
        raise pytest.UsageError("--update-golden writes files, which one process does: leave out -n")
    config.stash[GOLDEN] = Golden(update)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if session.config.getoption("update_golden"):
        session.config.stash[GOLDEN].write()


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    return request.config.stash[GOLDEN]


@pytest.fixture
def wording(request: pytest.FixtureRequest, golden: Golden) -> Wording:
    return Wording(golden, request.node.nodeid)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Function) -> Generator[None, None, None]:
    yield
    if isinstance(found := item.funcargs.get("wording"), Wording):
        found.end()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without the garbage collector, which would go through all tests again and again, now and in each test."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()


@pytest.fixture
def set_aside_again() -> Generator[None, None, None]:
    """Take the collected tests from the garbage collector again, after a test that gave it all (`gc.unfreeze`)."""
    yield
    gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not any("::" in arg for arg in config.args) and not config.getoption("lf", False):
        config.stash[GOLDEN].files |= {item.nodeid.partition("::")[0] for item in items}
        config.stash[GOLDEN].tests |= {item.nodeid for item in items if gives_wording(item)}
    if config.getoption("update_golden"):
        items[:] = [item for item in items if gives_wording(item)]
    items[:] = in_order(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


def gives_wording(item: pytest.Item) -> bool:
    return "wording" in getattr(item, "fixturenames", ())


def in_order(items: Iterable[pytest.Item], workers: int) -> list[pytest.Item]:
    """Return tests in the order in which they run, so that no worker has a long one left when the others are done.

    Workers get equal parts of the list at first, and then take from the end of another's part. So each part begins with
    files of long tests: each second part with those that wait, the others with those that compute meanwhile. A file stays
    whole, because its fixtures may be the file's.
    """
    files = [list(tests) for _, tests in groupby(items, key=lambda item: item.path)]
    parts: list[list[pytest.Item]] = [[] for _ in range(max(1, workers))]
    for file in sorted(files, key=_rank):
        of = (parts[::2], parts[1::2] or parts, parts)[_rank(file)[0]]
        min(of, key=len).extend(file)
    return [item for part in parts for item in part]


def _rank(file: list[pytest.Item]) -> tuple[int, int]:
    for kind, folders in enumerate((WAIT, COMPUTE)):
        for rank, folder in enumerate(folders):
            if file[0].nodeid.startswith(folder):
                return kind, rank
    return 2, not any(item.get_closest_marker(name) for item in file for name in ("slow", "external"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if os.environ.get("FORMIGA_EXTERNAL") and report.skipped and item.get_closest_marker("external"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        report.outcome = "failed"
        report.longrepr = f"an external test could not run here: {reason}"
    return report
