"""The benchmark: frozen tasks, normalized scores and results that anyone can verify bit for bit."""

from flockesc_env.tasks.results import PolicyResult, Result, Training, read_result, write_result
from flockesc_env.tasks.scoring import LoadedPolicy, draw_flocks, score, verify
from flockesc_env.tasks.task import Control, Shortcut, Task, World, task_of

__all__ = [
    "Control",
    "LoadedPolicy",
    "PolicyResult",
    "Result",
    "Shortcut",
    "Task",
    "Training",
    "World",
    "draw_flocks",
    "read_result",
    "score",
    "task_of",
    "verify",
    "write_result",
]
