"""One training run: a folder with its record, its policy, its learning curve and its speed."""

from __future__ import annotations

from pathlib import Path

from training.config import Args, PPOArgs, SearchArgs


def train(args: Args) -> Path:
    """Train a policy, or go on with an unfinished run, and return the policy's file.

    A run that was killed and is continued ends with the same parameters as one that was left alone.

    Raises:
        FileExistsError: if the run's folder holds a finished run, or an unfinished one of other arguments.
        ValueError: for an argument out of bounds.
    """
    # Only what the learner needs: torch takes seconds to import.
    if isinstance(args, SearchArgs):
        from training.search import search

        return search(args)
    if isinstance(args, PPOArgs):
        from training.ppo import ppo

        return ppo(args)
    from training.tqc import tqc

    return tqc(args)
