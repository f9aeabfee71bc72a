"""``train``: a learner of a task, to its policy."""

from pathlib import Path
from pkgutil import resolve_name

from flockesc_env.common.extras import require
from training.run import Run

_OWN = {
    "search": "training.search:SearchRounds",
    "gradient": "training.gradient:GradientRounds",
    "imitation": "training.imitation:ImitationRounds",
    "rule": "training.rule_search:RuleRounds",
}
"""Algorithms of this project. They are imported late, because importing torch takes seconds."""


def train(run: Run, *, resume: bool = False) -> Path:
    """Train, or continue an unfinished run, and return the path of the policy.

    Raises:
        InputError: if a hyperparameter is unknown or out of bounds, or see ``Run.begin``.
    """
    if run.learner.algorithm == "gradient":
        require("jax", ["jax", "optax"])
    if run.learner.algorithm not in _OWN:
        from training import sb3

        return sb3.train(run, resume=resume)
    path: Path = resolve_name(_OWN[run.learner.algorithm])(run).train(resume=resume)
    return path
