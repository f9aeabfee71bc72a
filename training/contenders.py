"""What can be compared: built-in policies by name, and runs by their folder."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stable_baselines3 import PPO

from flockesc_env import EnvOptions
from flockesc_env.policies import FixedRange, Policy, RandomRange, SB3Policy, StubbornLeaders
from training.config import RunRecord
from training.train import MODEL_FILE


@dataclass(frozen=True)
class Contender:
    """A policy with the view and the options that it was made for.

    Attributes:
        name: how tables and figures call it.
        policy: the policy.
        per_agent: whether it sets one range per agent.
        options: environment options (``EnvOptions``).
    """

    name: str
    policy: Policy
    per_agent: bool = False
    options: dict[str, Any] = field(default_factory=dict)


def contender(spec: str) -> Contender:
    """Make a contender of its name.

    Args:
        spec: ``fixed:RHO``, ``random``, ``stubborn-leaders`` (predator visible at any distance),
            ``stubborn-leaders-local`` (only within its range), or the folder of a run.

    Raises:
        ValueError: if there is neither such a policy nor such a run.
    """
    if spec.startswith("fixed:"):
        rho = float(spec.removeprefix("fixed:"))
        return Contender(spec, FixedRange(rho), options={"max_range": max(rho, EnvOptions.max_range)})
    if spec == "random":
        return Contender(spec, RandomRange(0), per_agent=True)
    if spec == "stubborn-leaders":
        return Contender(spec, StubbornLeaders(), per_agent=True, options={"predator_sensing_range": None})
    if spec == "stubborn-leaders-local":
        return Contender(spec, StubbornLeaders(), per_agent=True)
    run = Path(spec)
    if not (run / MODEL_FILE).is_file():
        known = "fixed:RHO, random, stubborn-leaders, stubborn-leaders-local or the folder of a finished run"
        raise ValueError(f"policies: expected {known}, got {spec!r}")
    args = RunRecord.read(run).args
    return Contender(
        f"learned: {run.name}",
        SB3Policy(PPO.load(run / MODEL_FILE, device="cpu")),
        per_agent=args.per_agent,
        options=dataclasses.asdict(args.env_options()),
    )
