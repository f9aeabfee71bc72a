"""The frozen tasks: environments, comparison, scores, and results that anyone can verify bit for bit."""

from importlib import import_module
from typing import TYPE_CHECKING

from flockesc_env.taskset.task import Scale, Task, tasks

if TYPE_CHECKING:
    from flockesc_env.taskset.results import PolicyResult, Result, Training, read_result, write_result
    from flockesc_env.taskset.scoring import LoadedPolicy, draw_flocks, score, verify

__all__ = [
    "LoadedPolicy",
    "PolicyResult",
    "Result",
    "Scale",
    "Task",
    "Training",
    "draw_flocks",
    "read_result",
    "score",
    "tasks",
    "verify",
    "write_result",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Import results and scores at their first use: they need policies, which are slow to import."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        is_play = name in {"LoadedPolicy", "draw_flocks", "score", "verify"}
        return getattr(import_module(f"{__name__}.{'scoring' if is_play else 'results'}"), name)
