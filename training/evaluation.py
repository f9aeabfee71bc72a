"""Objectives of policies, one value per flock."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from flockesc_env import (
    Architecture,
    Episodes,
    FlockEscapeEnv,
    FlockScenario,
    LineEscapeEnv,
    LineScenario,
    NamedPolicy,
    Policy,
    PolicySpec,
    parallel_env,
    rollout,
)
from flockesc_env.common.progress import progress_bar
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.options import env_options, line_options
from flockesc_env.policies.playing import rollout_networks
from training.config import Setting


def objective(
    setting: Setting,
    policy: Policy,
    seeds: Iterable[int],
    *,
    batch_size: int = 64,
    num_threads: int | None = 1,
) -> FloatArray:
    """Run a policy in a setting and return the objective, shape (seeds,).

    Args:
        setting: the scenario, the options and the objective.
        policy: sets the ranges.
        seeds: seeds of the flocks.
        batch_size: number of flocks stepped together.
        num_threads: number of threads; ``None``: one per core.
    """
    options: Any = setting.env_options()
    if not setting.is_line:
        options["per_agent"] = setting.per_agent
    model: Any = setting.model
    episodes = rollout(model, policy, seeds, batch_size=batch_size, num_threads=num_threads, **options)
    return setting.spec.values(episodes)


def play_networks(
    setting: Setting, architecture: Architecture, vectors: FloatArray, seeds: Sequence[int]
) -> tuple[FloatArray, int]:
    """Run networks on the same flocks of a setting, on one thread.

    Args:
        setting: the scenario, the options and the objective.
        architecture: inputs and layers of the networks.
        vectors: parameters of the networks, shape (networks, size).
        seeds: seeds of the flocks.

    Returns:
        The objective, shape (networks, seeds), and the number of actions, per agent or per flock.
    """
    model = setting.model
    options: Any = setting.env_options()
    per_agent = setting.per_agent and not setting.is_line
    columns = rollout_networks(
        architecture,
        np.repeat(vectors.astype(np.float32), len(seeds), axis=0),
        list(seeds) * len(vectors),
        model,
        line_options(options) if isinstance(model, LineScenario) else env_options(model, options),
        per_agent=per_agent,
        num_threads=1,
    )
    rows = model.num_agents if per_agent else 1
    values = columns[setting.spec.column]
    return values.reshape(len(vectors), -1), rows * int(columns["num_actions"].sum())


def policy_spec(setting: Setting) -> PolicySpec:
    """Return the policy spec of the environment of a setting."""
    model, options = setting.model, setting.env_options()
    if isinstance(model, LineScenario):
        return LineEscapeEnv(model, **options).policy_spec
    return (parallel_env if setting.per_agent else FlockEscapeEnv)(model, **options).policy_spec


def run_policy(
    entry: NamedPolicy, flocks: range, *, scenario: FlockScenario, num_threads: int | None = None
) -> Episodes:
    """Run a policy with its own options, and show a progress bar."""
    with progress_bar(f"Policy {entry.name}", len(flocks)) as report:
        return rollout(scenario, entry, flocks, num_threads=num_threads, progress=report)


def play(
    entry: NamedPolicy, setting: Setting, flocks: range, *, num_threads: int | None = None
) -> FloatArray:
    """Run a policy with its own options in a setting, and return the objective, shape (seeds,)."""
    model = setting.model
    if isinstance(model, LineScenario):
        return setting.spec.values(rollout(model, entry, flocks))
    return setting.spec.values(run_policy(entry, flocks, scenario=model, num_threads=num_threads))
