"""The frozen tasks: environments, comparison, scores, and results that anyone can verify bit for bit."""

from flockesc_env.tasks.comparison import Comparison, compare
from flockesc_env.tasks.results import PolicyResult, Result, Training, read_result, write_result
from flockesc_env.tasks.scoring import LoadedPolicy, draw_flocks, score, verify
from flockesc_env.tasks.task import Control, Scale, Shortcut, Task, tasks

__all__ = [
    "Comparison",
    "Control",
    "LoadedPolicy",
    "PolicyResult",
    "Result",
    "Scale",
    "Shortcut",
    "Task",
    "Training",
    "compare",
    "draw_flocks",
    "read_result",
    "score",
    "tasks",
    "verify",
    "write_result",
]
