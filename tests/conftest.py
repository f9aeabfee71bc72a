"""Configuration of all tests: helper modules, threads, time limits, skipped tests, hypothesis profiles."""

import os
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# Makes support/ importable. The repository root stays off the path, so that the installed
# package is tested instead of the source tree.
sys.path.append(str(Path(__file__).parent / "support"))

# SDL opens no windows, on machines with and without a display.
os.environ["SDL_VIDEODRIVER"] = "dummy"

# Workers share the cores; several torch threads in each make training tests four times slower
# and change sums. NPROC is the number of threads of XLA.
os.environ["OMP_NUM_THREADS"] = os.environ["NPROC"] = "1"
# Compiling takes most of the time of tests of JAX.
os.environ["JAX_DISABLE_MOST_OPTIMIZATIONS"] = "1"

# No deadline, because machines are shared. Derandomized, so that only code changes make a test fail.
settings.register_profile("suite", deadline=None, derandomize=True, database=None, print_blob=True)
settings.load_profile("suite")

# Reasons that the machine of a continuous integration may have.
EXPECTED_SKIPS = (
    "only Linux on x86-64 can intercept CPUID",
    "this processor cannot intercept CPUID",
    "needs the right to make a namespace of process ids",
)


@pytest.fixture(autouse=True, scope="session")
def repository() -> None:
    """Run all tests in the repository, wherever pytest was started. No file needs to survive a power cut."""
    os.fsync = lambda _: None  # type: ignore[assignment]
    os.chdir(Path(__file__).parents[1])


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Any:
    """Return a function that runs a command in this process: ``cli("simulate", "fixed:9").out``."""
    from cli_runs import Ran  # slow to import

    return partial(Ran, capsys)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """End tests that hang. The environments of `make compat` have no pytest-timeout."""
    if config.pluginmanager.hasplugin("timeout"):
        for item in items:
            item.add_marker(pytest.mark.timeout(1800 if "slow" in item.path.parts else 300))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Print in one line what was skipped, and how to have it. If CI is set, unexpected skips fail."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skips = reporter.stats.get("skipped", []) if reporter else []  # a worker has no reporter
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in skips)
    if reasons:
        counts = "; ".join(f"{count} ({reason})" for reason, count in reasons.most_common())
        reporter.line(f"\nskipped tests: {counts}")
    if os.environ.get("CI") and not all(reason.startswith(EXPECTED_SKIPS) for reason in reasons):
        reporter.line("failed: CI is set, and not all reasons are in EXPECTED_SKIPS of tests/conftest.py")
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
