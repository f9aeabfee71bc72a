"""``torch_network`` acts as the network of torch that it was made from."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import torch
from option_table import small_flock
from rounding import choose_alike, float32_error
from torch import nn

from flockesc_env import parallel_env
from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies import torch_network

SCENARIO = small_flock(num_agents=7, num_steps=12, predator_range=60.0)


def network(*widths: int) -> nn.Sequential:
    torch.manual_seed(0)
    layers = [part for pair in pairwise(widths) for part in (nn.Linear(*pair), nn.Tanh())]
    return nn.Sequential(*layers[:-1])


@pytest.mark.parametrize(("squash", "function"), [("clip", lambda x: np.clip(x, -1, 1)), ("tanh", np.tanh)])
def test_the_first_output_is_the_action(squash: Any, function: Any) -> None:
    spec = parallel_env(SCENARIO).policy_spec
    rows = np.random.default_rng(0).uniform(-1, 1, (50, len(spec.layout.names))).astype(np.float32)
    layers = network(rows.shape[1], 8, 4, 2)
    with torch.no_grad():
        layers[-1].weight *= 5  # clips some actions
    expected = function(layers(torch.from_numpy(rows)).detach().numpy()[:, :1])
    error = float32_error(layers, rows)[:, :1]
    policy = torch_network(layers, spec.layout.names, squash=squash)
    assert policy.architecture.hidden == (8, 4)
    assert (np.abs(policy.act(rows, spec) - expected) <= error).all()


def test_the_range_with_the_highest_output_is_set() -> None:
    ranges = (0.0, 5.0, 20.0)
    spec = parallel_env(SCENARIO, action_mode="discrete", range_grid=ranges).policy_spec
    rows = np.random.default_rng(0).uniform(-1, 1, (50, len(spec.layout.names))).astype(np.float32)
    layers = network(rows.shape[1], 8, 3)
    expected = layers(torch.from_numpy(rows)).argmax(1).tolist()
    assert set(expected) == {0, 1, 2}
    chosen = torch_network(layers, spec.layout.names, ranges=ranges).act(rows, spec)
    assert choose_alike(layers, rows, chosen, expected)


@pytest.mark.parametrize(
    "layers", [[], [nn.Linear(4, 2), nn.ReLU(), nn.Linear(2, 1)], [nn.Linear(4, 2), nn.Tanh()], [nn.Tanh()]]
)
def test_other_layers_are_refused(layers: list[nn.Module]) -> None:
    with pytest.raises(
        ArgumentError, match="layers: expected Linear and Tanh in turn, Linear first and last"
    ):
        torch_network(layers, ("time",))
