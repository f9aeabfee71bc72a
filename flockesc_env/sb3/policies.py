"""Policy classes for PPO and A2C of stable-baselines3: a start at one range, a scorer of candidates."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

from flockesc_env.common.checks import as_floats
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.network import Architecture, NetworkPolicy, layer_parameters
from flockesc_env.scenario.options import VIEWS

_FIRST_SLOPE = 8.0
"""Decrease of the first scores with the range, in units of the largest one.

With equal probabilities the mean range is long, and a policy that starts with a long range learns little
(results/scoreboard/README.md, "What PPO needs").
"""


class RangePolicy(ActorCriticPolicy):
    """``MlpPolicy`` that starts at one range, so that the untrained policy is a fixed range.

    ``MlpPolicy`` starts in the middle of the ranges, with a standard deviation of half of them: many first
    actions are clipped at the ends.

    Args:
        *args: spaces and learning rate, from stable-baselines3.
        spec: policy spec of the environment; see ``Task.policy_spec``.
        first_range: the first range, in m for a flock; not an end of the actions with ``squash_output``. With
            discrete actions, the candidate next to it is the most likely; the probabilities of the others
            fall by a factor of e with every place.
        first_std: standard deviation of the first actions, where 1 is half of the action space. ``None``: 0.6
            or, as required with ``log_std_init`` or ``use_sde``, that of ``ActorCriticPolicy``.
        **kwargs: arguments of ``ActorCriticPolicy``.
    """

    def __init__(
        self, *args: Any, spec: PolicySpec, first_range: float, first_std: float | None = None, **kwargs: Any
    ) -> None:
        first = float(as_floats(first_range, "first_range", ()))
        self._first, space = float(spec.actions.from_ranges(np.array([first])).item()), spec.actions.space()
        half = float(space.high[0] - space.low[0]) / 2 if isinstance(space, spaces.Box) else 1.0
        if kwargs.get("squash_output") and isinstance(space, spaces.Box):
            scaled = (self._first - float(space.low[0])) / half - 1
            if abs(scaled) >= 1:
                expected = "a range between the ends, which squash_output=True (tanh) never reaches"
                raise InputError("first_range", expected, first)
            self._first = math.atanh(scaled)
        if kwargs.get("use_sde") or "log_std_init" in kwargs:
            if first_std is not None:
                expected = "None with log_std_init or use_sde, whose deviation depends on the observation"
                raise InputError("first_std", f"{expected} (log_std_init=-2 sets it)", first_std)
        else:
            deviation = float(as_floats(0.6 if first_std is None else first_std, "first_std", ()))
            if deviation <= 0:
                raise InputError("first_std", "a positive number", deviation)
            kwargs["log_std_init"] = math.log(deviation * half)
        super().__init__(*args, **kwargs)
        _check_spaces(self, spec)

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        outputs: Any = self.action_net
        first = torch.tensor([self._first])
        if isinstance(self.action_space, spaces.Discrete):
            first = -torch.abs(torch.arange(outputs.out_features) - self._first)
        with torch.no_grad():
            outputs.weight.zero_()
            outputs.bias.copy_(first)


class ScorerPolicy(ActorCriticPolicy):
    """Policy with one logit per candidate range of a profile, from a small network that all candidates share.

    Its environment has discrete actions, whose ranges are the candidates. A categorical network with one
    output per candidate did not learn; this one did.

    Args:
        *args: spaces and learning rate, from stable-baselines3.
        spec: policy spec of the environment.
        inputs: names of the observation entries that the network sees.
        candidate_inputs: names of the entries of a candidate that it sees; see ``Architecture``.
        **kwargs: arguments of ``ActorCriticPolicy``. ``net_arch`` holds the widths of the hidden layers
            of both the scoring and the value network.
    """

    def __init__(
        self,
        *args: Any,
        spec: PolicySpec,
        inputs: tuple[str, ...] = (),
        candidate_inputs: tuple[str, ...],
        **kwargs: Any,
    ) -> None:
        self._spec, self._inputs, self._candidate_inputs = spec, tuple(inputs), tuple(candidate_inputs)
        super().__init__(*args, **kwargs)
        _check_spaces(self, spec)

    def network(self) -> NetworkPolicy:
        """Return the policy that sets the candidate with the highest score."""
        hidden, parameters = layer_parameters(list(self.mlp_extractor.policy_net)[::2])
        architecture = Architecture(self._inputs, hidden, candidate_inputs=self._candidate_inputs)
        return NetworkPolicy(architecture, parameters)

    def _build_mlp_extractor(self) -> None:
        scores = _Scores(self._spec, self._inputs, self._candidate_inputs, self.net_arch)  # type: ignore[arg-type]
        self.mlp_extractor = scores  # type: ignore[assignment]

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()  # the scores are the logits
        self._prefer_short_ranges()
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]

    def _prefer_short_ranges(self) -> None:
        """Make scores fall with the range and depend on little else."""
        network: Any = self.mlp_extractor.policy_net
        layers: list[nn.Linear] = list(network)[::2]
        nn.init.orthogonal_(layers[-1].weight, gain=0.01)
        if "range" not in self._candidate_inputs:
            return
        column = len(self._inputs) + self._candidate_inputs.index("range")
        with torch.no_grad():
            for layer in layers[:-1]:
                layer.weight[0] = 0
                layer.weight[0, column] = 1
                column = 0
            layers[-1].weight[0, column] = -_FIRST_SLOPE


class _Scores(nn.Module):
    """The scoring network and the value network, in the form of ``MlpExtractor`` of stable-baselines3."""

    def __init__(
        self, spec: PolicySpec, inputs: tuple[str, ...], candidate_inputs: tuple[str, ...], hidden: list[int]
    ) -> None:
        super().__init__()
        entries, count = len(spec.layout.names), len(spec.candidate_ranges)

        def column(name: str, k: int) -> int:  # the ranges stand after the observation
            return entries + k if name == "range" else spec.layout.index(f"profile_{k}_{name}")

        own = [spec.layout.index(name) for name in inputs]
        rows = [own + [column(name, k) for name in candidate_inputs] for k in range(count)]
        self._columns = torch.tensor(rows)
        self._ranges = torch.tensor((spec.candidate_ranges / spec.candidate_ranges[-1]).tolist())
        layers = _tanh_layers([self._columns.shape[1], *hidden])
        self.policy_net = nn.Sequential(*layers, nn.Linear(hidden[-1], 1))
        self.value_net = nn.Sequential(*_tanh_layers([entries, *hidden]))
        self.latent_dim_pi, self.latent_dim_vf = count, hidden[-1]

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the score of every candidate and the last hidden layer of the value network."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the score of every candidate, shape (rows, candidates)."""
        inputs = torch.cat([features, self._ranges.expand(len(features), -1)], dim=1)[:, self._columns]
        scores: torch.Tensor = self.policy_net(inputs)
        return scores.squeeze(-1)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the last hidden layer of the value network, shape (rows, width)."""
        hidden: torch.Tensor = self.value_net(features)
        return hidden


def _check_spaces(policy: ActorCriticPolicy, spec: PolicySpec) -> None:
    expected = spec.layout.space(), spec.actions.space()
    if (policy.observation_space, policy.action_space) != expected:
        given = f"{policy.observation_space.shape} and {policy.action_space}"
        row = VIEWS[spec.per_agent]
        raise InputError("spec", f"that of the environment, whose spaces are {given}", f"one per {row}")


def _tanh_layers(widths: list[int]) -> list[nn.Module]:
    """Return a linear layer and tanh between each two widths."""
    return [layer for sizes in pairwise(widths) for layer in (nn.Linear(*sizes), nn.Tanh())]
