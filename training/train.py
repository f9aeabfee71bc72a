"""Training runs: dispatch to the learner of the arguments."""

from __future__ import annotations

from pathlib import Path

from training.config import Args, ImitationArgs, PPOArgs, SearchArgs


def train(args: Args) -> Path:
    """Train a policy, or continue an unfinished run, and return the path of the policy file.

    A run that was interrupted and continued ends with the same parameters as an uninterrupted one.

    Raises:
        FileExistsError: if the folder holds a finished run, or a run with other arguments.
        ValueError: if an argument is out of bounds.
    """
    # Each learner is imported only when it is needed: importing torch takes seconds.
    if isinstance(args, SearchArgs):
        from training.search import search

        return search(args)
    if isinstance(args, ImitationArgs):
        from training.imitation import imitate

        return imitate(args)
    if isinstance(args, PPOArgs):
        from training.ppo import ppo

        return ppo(args)
    from training.tqc import tqc

    return tqc(args)
