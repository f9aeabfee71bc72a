"""Results on six held-out flocks instead of 1,000."""

from collections.abc import Iterator

import pytest

from flockesc_env.cli import tasks
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.taskset import results, scoring


@pytest.fixture(scope="module")
def few_flocks() -> Iterator[range]:
    """Score policies of a module of tests on six flocks; return their seeds."""
    flocks = HELD_OUT[:6]
    with pytest.MonkeyPatch.context() as patch:
        for module in (results, scoring, tasks):
            patch.setattr(module, "FLOCKS", flocks)
        yield flocks
