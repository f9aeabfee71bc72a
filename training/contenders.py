"""What can be compared: built-in policies by name, and runs by their folder."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from stable_baselines3 import PPO

from flockesc_env.contenders import Contender, built_in
from flockesc_env.errors import ArgumentError
from flockesc_env.policies import SB3Policy
from training.config import RunRecord
from training.train import MODEL_FILE


def contender(spec: str) -> Contender:
    """Make a contender of its name.

    Args:
        spec: a built-in policy (``flockesc_env.contenders.NAMES``), or the folder of a run.

    Raises:
        ArgumentError: if there is neither such a policy nor such a run.
    """
    run = Path(spec)
    if not (run / MODEL_FILE).is_file():
        try:
            return built_in(spec)
        except ArgumentError as error:
            expected = f"{error.expected} or the folder of a finished run"
            raise ArgumentError(error.field, expected, error.given) from None
    args = RunRecord.read(run).args
    return Contender(
        f"learned: {run.name}",
        SB3Policy(PPO.load(run / MODEL_FILE, device="cpu")),
        per_agent=args.per_agent,
        options=dataclasses.asdict(args.env_options()),
    )
