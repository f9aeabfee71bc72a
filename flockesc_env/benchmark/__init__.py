"""The benchmark: frozen tasks, normalized scores and results that anyone can verify bit for bit."""

from flockesc_env.benchmark.results import Result, Training, read_result, write_result
from flockesc_env.benchmark.scoring import score, verify
from flockesc_env.benchmark.tasks import Task, World, task_of

__all__ = [
    "Result",
    "Task",
    "Training",
    "World",
    "read_result",
    "score",
    "task_of",
    "verify",
    "write_result",
]
