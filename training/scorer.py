"""PPO over candidate ranges: a categorical policy whose logits are the scores of one small network."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

from flockesc_env import Architecture, NetworkPolicy
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.torch import layer_parameters

_FIRST_GAIN = 0.01
"""Gain of the weights of the last layer at the start."""

_FIRST_SLOPE = 8.0
"""Decrease of the first scores with the range, in units of the largest one.

With equal probabilities the mean range is long. Then the flock agrees in its first steps, and no agent's
action changes its reward.
"""


class ScorerPolicy(ActorCriticPolicy):
    """Policy of stable-baselines3 with one logit per candidate range, from a network that all share.

    Args:
        *args: spaces and learning rate, from stable-baselines3.
        spec: policy spec of the environment.
        inputs: names of the observation entries that the network sees.
        candidate_inputs: names of the entries of a candidate that it sees; see ``Architecture``.
        **kwargs: arguments of ``ActorCriticPolicy``. ``net_arch`` holds the widths of the hidden layers
            of both the scoring and the value network.

    Raises:
        ArgumentError: if the observation lacks an input.
    """

    def __init__(
        self,
        *args: Any,
        spec: PolicySpec,
        inputs: tuple[str, ...],
        candidate_inputs: tuple[str, ...],
        **kwargs: Any,
    ) -> None:
        self._inputs, self._candidate_inputs = inputs, candidate_inputs
        self._columns = candidate_columns(inputs, candidate_inputs, spec)
        self._ranges = (spec.candidate_ranges / spec.candidate_ranges[-1]).tolist()
        super().__init__(*args, **kwargs)

    def network(self) -> NetworkPolicy:
        """Return the policy that sets the candidate with the highest score."""
        hidden, parameters = layer_parameters(list(self.mlp_extractor.policy_net)[::2])
        architecture = Architecture(self._inputs, hidden, candidate_inputs=self._candidate_inputs)
        return NetworkPolicy(architecture, parameters)

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = Scores(self._columns, self._ranges, self.features_dim, self.net_arch)  # type: ignore[assignment, arg-type]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()  # the scores are the logits
        self._prefer_short_ranges()
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]

    def _prefer_short_ranges(self) -> None:
        """Make scores fall with the range and depend on little else."""
        network: Any = self.mlp_extractor.policy_net
        layers: list[nn.Linear] = list(network)[::2]
        nn.init.orthogonal_(layers[-1].weight, gain=_FIRST_GAIN)
        if "range" not in self._candidate_inputs:
            return
        column = len(self._inputs) + self._candidate_inputs.index("range")
        with torch.no_grad():
            for layer in layers[:-1]:
                layer.weight[0] = 0
                layer.weight[0, column] = 1
                column = 0
            layers[-1].weight[0, column] = -_FIRST_SLOPE


class Networks(nn.Module, ABC):
    """A policy network and a value network, in the form of ``MlpExtractor`` of stable-baselines3.

    Args:
        policy_net: the policy network.
        latent: number of its outputs.
        entries: number of entries of the observation; the value network sees all.
        hidden: widths of the hidden layers of the value network.
    """

    def __init__(self, policy_net: nn.Sequential, latent: int, entries: int, hidden: list[int]) -> None:
        super().__init__()
        self.latent_dim_pi, self.latent_dim_vf = latent, hidden[-1]
        self.policy_net = policy_net
        self.value_net = nn.Sequential(*tanh_layers([entries, *hidden]))

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the outputs of the policy network and the last hidden layer of the value network."""
        return self.forward_actor(features), self.forward_critic(features)

    @abstractmethod
    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the outputs of the policy network, shape (rows, outputs)."""

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the last hidden layer of the value network, shape (rows, width)."""
        hidden: torch.Tensor = self.value_net(features)
        return hidden


class Scores(Networks):
    """The scoring network and the value network.

    Args:
        columns: columns of the inputs of every candidate, shape (candidates, inputs).
        ranges: candidate ranges divided by the largest one; columns after the observation.
        entries: number of entries of the observation.
        hidden: widths of the hidden layers.
    """

    def __init__(
        self, columns: list[list[int]], ranges: list[float], entries: int, hidden: list[int]
    ) -> None:
        layers = tanh_layers([len(columns[0]), *hidden])
        super().__init__(nn.Sequential(*layers, nn.Linear(hidden[-1], 1)), len(ranges), entries, hidden)
        self._columns, self._ranges = torch.tensor(columns), torch.tensor(ranges)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the score of every candidate, shape (rows, candidates)."""
        ranges = self._ranges.expand(len(features), -1)
        inputs = torch.cat([features, ranges], dim=1)[:, self._columns]
        scores: torch.Tensor = self.policy_net(inputs)
        return scores.squeeze(-1)


def candidate_columns(
    inputs: Sequence[str], candidate_inputs: Sequence[str], spec: PolicySpec
) -> list[list[int]]:
    """Return the columns of the inputs of every candidate, in an observation with the ranges after it."""

    def column(name: str, k: int) -> int:
        return len(spec.layout.names) + k if name == "range" else spec.layout.index(f"profile_{k}_{name}")

    own = [spec.layout.index(name) for name in inputs]
    candidates = range(len(spec.profile_ranges))
    return [own + [column(name, k) for name in candidate_inputs] for k in candidates]


def tanh_layers(widths: Sequence[int]) -> Iterator[nn.Module]:
    """Yield a linear layer and tanh between each two widths."""
    for rows, columns in pairwise(widths):
        yield from (nn.Linear(rows, columns), nn.Tanh())
