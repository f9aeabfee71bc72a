"""Progress bars on stderr for calls that report (finished, all)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

from flockesc_env.common.in_job import is_in_job


@contextmanager
def progress_bar(title: str, total: int, *, always: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar; yields the callback that ``sweep`` and ``rollout`` take as ``progress``.

    Args:
        title: text before the bar.
        total: number of steps.
        always: whether to show it even if stderr is not a terminal.
    """
    # None: tqdm hides it without a terminal.
    hidden = True if is_in_job() else False if always else None
    with tqdm(total=total, desc=title, file=sys.stderr, disable=hidden) as shown:
        yield lambda done, _: shown.update(done - shown.n)
        shown.update(total - shown.n)  # the last call may come before the end
