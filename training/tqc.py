"""TQC (truncated quantile critics, Kuznetsov et al., 2020) of sb3-contrib: one range for all agents."""

from __future__ import annotations

from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from training.config import TQCArgs
from training.rounds import SB3Rounds


class TQCRounds(SB3Rounds[TQCArgs]):
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
            gradient_steps=4,
            policy_kwargs={"net_arch": list(args.net_arch), "activation_fn": nn.Tanh},
            seed=args.seed,
            device="cpu",
        )

    def state(self) -> dict[str, Any]:
        """Return also the replay buffer and the entropy coefficient."""
        extra = {"replay_buffer": self.model.replay_buffer, "log_ent_coef": self.model.log_ent_coef}
        return {**super().state(), **extra}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore also the replay buffer and the entropy coefficient."""
        super().restore(state)
        self.model.replay_buffer = state["replay_buffer"]
        coefficient = self.model.log_ent_coef
        assert coefficient is not None, "ent_coef is learned"  # noqa: S101, for the type checker
        with torch.no_grad():
            coefficient.copy_(state["log_ent_coef"])  # the optimizer refers to this tensor
