"""Truncated quantile critics (Kuznetsov et al., 2020): off-policy, one range for all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from flockesc_env import NetworkPolicy
from training.config import TQCArgs
from training.rounds import Rounds, network


def tqc(args: TQCArgs) -> Path:
    """Train, or go on with an unfinished run, and return the policy's file."""
    return TQCRounds(args).train()


class TQCRounds(Rounds[TQCArgs]):
    """A run of TQC."""

    model: TQC

    def make(self, env: VecEnv) -> TQC:
        """Make the model."""
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

    def policy(self) -> NetworkPolicy:
        """Return the squashed mean of the action distribution."""
        actor = self.model.actor
        return network(self.args, [*actor.latent_pi, actor.mu], squash="tanh")

    def learned(self) -> dict[str, Any]:
        """Return what is kept, with the transitions and the weight of the entropy."""
        own = {"replay_buffer": self.model.replay_buffer, "log_ent_coef": self.model.log_ent_coef}
        return {**super().learned(), **own}

    def relearn(self, learned: dict[str, Any]) -> None:
        """Take over what ``learned`` returned."""
        super().relearn(learned)
        self.model.replay_buffer = learned["replay_buffer"]
        coefficient = self.model.log_ent_coef
        assert coefficient is not None, "ent_coef is learned"  # noqa: S101, for the types
        with torch.no_grad():
            coefficient.copy_(learned["log_ent_coef"])  # in place: its optimizer holds on to it
