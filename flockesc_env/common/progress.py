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


@contextmanager
def progress_bar(
    title: str, total: float, *, always: bool = False, form: str | None = None
) -> Iterator[Callable[..., None]]:
    """Show a progress bar; yield a callback for the argument ``progress`` of ``sweep`` and ``rollout``.

    It also takes a note, which the bar ends with. Without a terminal, only ``always`` shows the bar. ``form``
    is tqdm's ``bar_format``.
    """
    from tqdm import tqdm  # slow to import

    hidden = IN_JOB.get() or not total or sys.stderr is None or (False if always else None)
    with tqdm(total=total, desc=title, file=sys.stderr, disable=hidden, bar_format=form) as bar:

        def report(done: float, _: float, note: str = "") -> None:
            bar.set_postfix_str(note, refresh=False)
            bar.update(done - bar.n)

        yield report
        bar.update(total - bar.n)  # the last callback may report less than the total
