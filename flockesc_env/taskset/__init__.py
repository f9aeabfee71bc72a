"""The frozen tasks: environments, comparison, scores, and results that anyone can verify bit for bit."""

from flockesc_env.taskset.results import PolicyResult, Result, Training, read_result, write_result
from flockesc_env.taskset.scoring import LoadedPolicy, draw_flocks, score, verify
from flockesc_env.taskset.task import Scale, Task, tasks

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
