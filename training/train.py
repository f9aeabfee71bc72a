"""One training run: a folder with its record, its policy and its learning curve."""

from __future__ import annotations

from pathlib import Path

from training.config import CONFIG_FILE, POLICY_FILE, Args, PPOArgs, RunRecord, SearchArgs
from training.ppo import ppo
from training.search import search
from training.tqc import tqc


def train(args: Args) -> Path:
    """Train a policy, or go on with an unfinished run, and return the policy's file.

    A run that was killed and is continued ends with the same parameters as one that was left alone.

    Raises:
        FileExistsError: if the run's folder holds a finished run, or an unfinished one of other arguments.
        ValueError: for an argument out of bounds.
    """
    if (args.run / POLICY_FILE).exists():
        raise FileExistsError(f"run: expected a folder without a finished run, got {args.run}")
    args.run.mkdir(parents=True, exist_ok=True)
    record = RunRecord(args)
    if (args.run / CONFIG_FILE).exists():
        begun = RunRecord.read(args.run)
        if begun != record:
            raise FileExistsError(f"run: expected the arguments and versions of {args.run}, got others")
    record.write(args.run)
    if isinstance(args, SearchArgs):
        return search(args)
    return ppo(args) if isinstance(args, PPOArgs) else tqc(args)
