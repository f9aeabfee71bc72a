"""Progress bars on stderr (tqdm)."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from flockesc_env.common.checks import IN_JOB, as_callback

Progress = Callable[[int, int], None]


@contextmanager
def reporting(progress: Progress | bool | None, title: str, total: int) -> Iterator[Progress | None]:
    """Yield the callback that an argument ``progress`` stands for: ``True`` shows a progress bar."""
    if progress is True:
        with progress_bar(title, total, always=True) as bar:
            yield bar
    else:
        yield as_callback(None if progress is False else progress)


def is_hidden(*, always: bool) -> bool | None:
    """Return ``disable`` of tqdm: None hides a bar without a terminal, and ``always`` shows it even then."""
    return True if sys.stderr is None else False if always else None


@contextmanager
def progress_bar(title: str, total: int, *, always: bool = False) -> Iterator[Callable[..., None]]:
    """Show a progress bar; yield a callback for the argument ``progress`` of ``sweep`` and ``rollout``.

    It also takes a note, which the bar ends with.
    """
    from tqdm import tqdm  # slow to import

    hidden = IN_JOB.get() or is_hidden(always=always)
    with tqdm(total=total, desc=title, file=sys.stderr, disable=hidden) as bar:

        def report(done: int, _: int, note: str = "") -> None:
            bar.set_postfix_str(note, refresh=False)
            bar.update(done - bar.n)

        yield report
        bar.update(total - bar.n)  # the last callback may report less than the total
