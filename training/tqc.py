"""TQC (truncated quantile critics, Kuznetsov et al., 2020) of sb3-contrib: one range for all agents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from training.config import TQCArgs
from training.rounds import Rounds


def tqc(args: TQCArgs) -> Path:
    """Train with TQC, or continue an unfinished run, and return the path of the policy file."""
    return TQCRounds(args).train()


class TQCRounds(Rounds[TQCArgs]):
    """A training run with TQC."""

    model: TQC

    def make(self, env: VecEnv) -> TQC:
        """Return a new TQC model."""
        args = self.args
        return TQC(
            "MlpPolicy",
            env,
            learning_rate=args.learning_rate,
            buffer_size=args.buffer_size,
            learning_starts=args.learning_starts,
            batch_size=args.batch_size,
            gamma=args.gamma,
            gradient_steps=args.gradient_steps,
            policy_kwargs={"net_arch": list(args.net_arch), "activation_fn": nn.Tanh},
            seed=args.seed,
            device="cpu",
        )

    def learned(self) -> dict[str, Any]:
        """Return the state of the learner, with the replay buffer and the entropy coefficient."""
        extra = {"replay_buffer": self.model.replay_buffer, "log_ent_coef": self.model.log_ent_coef}
        return {**super().learned(), **extra}

    def relearn(self, learned: dict[str, Any]) -> None:
        """Restore the state that ``learned`` returned."""
        super().relearn(learned)
        self.model.replay_buffer = learned["replay_buffer"]
        coefficient = self.model.log_ent_coef
        assert coefficient is not None, "ent_coef is learned"  # noqa: S101, for the type checker
        with torch.no_grad():
            coefficient.copy_(learned["log_ent_coef"])  # the optimizer refers to this tensor
