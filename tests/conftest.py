"""Shared by all tests: with FORMIGA_EXTERNAL set, a test marked `external` that skips itself fails instead.

How slowly Hypothesis draws on a busy machine is no fault of what is tested.
"""

import os
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("formiga", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("formiga")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if os.environ.get("FORMIGA_EXTERNAL") and report.skipped and item.get_closest_marker("external"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        report.outcome = "failed"
        report.longrepr = f"an external test could not run here: {reason}"
    return report
