"""``train``: a learner of a task, to its policy."""

from pathlib import Path

from flockesc_env.common.extras import require
from training.run import Run


def train(run: Run, *, resume: bool = False) -> Path:
    """Train, or continue an unfinished run, and return the path of the policy.

    Raises:
        InputError: if a hyperparameter is unknown or out of bounds, or see ``Run.begin``.
    """
    match run.learner.algorithm:  # importing torch takes seconds
        case "search":
            from training.search import SearchRounds

            return SearchRounds(run).train(resume=resume)
        case "gradient":
            require("jax", ["jax", "optax"])
            from training.gradient import GradientRounds

            return GradientRounds(run).train(resume=resume)
        case "imitation":
            from training.imitation import ImitationRounds

            return ImitationRounds(run).train(resume=resume)
        case "rule":
            from training.rule_search import RuleRounds

            return RuleRounds(run).train(resume=resume)
    from training import sb3

    return sb3.train(run, resume=resume)
