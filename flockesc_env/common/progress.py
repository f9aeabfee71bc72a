"""Progress bars on stderr (tqdm)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

from flockesc_env.common.in_job import is_in_job


@contextmanager
def progress_bar(title: str, total: int, *, always: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar; yield a callback for the argument ``progress`` of ``sweep`` and ``rollout``.

    Args:
        title: text in front of the bar.
        total: number of steps.
        always: whether to show it even if stderr is not a terminal.
    """
    # None: tqdm hides it without a terminal.
    hidden = True if is_in_job() else False if always else None
    with tqdm(total=total, desc=title, file=sys.stderr, disable=hidden) as bar:
        yield lambda done, _: bar.update(done - bar.n)
        bar.update(total - bar.n)  # the last callback may report less than the total
