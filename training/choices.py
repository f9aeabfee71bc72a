"""PPO over a few ranges: a categorical policy."""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

from training.scorer import Networks, tanh_layers


class ChoicePolicy(ActorCriticPolicy):
    """Policy of stable-baselines3 that sees some entries of the observation; its value network sees all.

    Args:
        *args: spaces and learning rate, from stable-baselines3.
        columns: columns of the entries that the policy sees.
        **kwargs: arguments of ``ActorCriticPolicy``. ``net_arch`` holds the widths of the hidden layers
            of both networks.
    """

    def __init__(self, *args: Any, columns: list[int], **kwargs: Any) -> None:
        self._columns = columns
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = _Choice(self._columns, self.features_dim, self.net_arch)  # type: ignore[assignment, arg-type]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        _prefer_short_ranges(self.action_net)


class _Choice(Networks):
    """Hidden layers of the policy and of the value network."""

    def __init__(self, columns: list[int], entries: int, hidden: list[int]) -> None:
        super().__init__(nn.Sequential(*tanh_layers([len(columns), *hidden])), hidden[-1], entries, hidden)
        self._columns = columns

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the last hidden layer of the policy, shape (rows, width)."""
        hidden: torch.Tensor = self.policy_net(features[:, self._columns])
        return hidden


def _prefer_short_ranges(outputs: Any) -> None:
    """Let every range be less probable at the start than the next shorter one, by a factor of e.

    With equal probabilities the flock agrees in its first steps, and no agent's action changes its reward.
    """
    with torch.no_grad():
        outputs.bias.copy_(-torch.arange(outputs.out_features))
