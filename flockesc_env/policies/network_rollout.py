"""Rollouts of networks in the core.

Results do not depend on the machine or on the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from flockesc_env import _core
from flockesc_env.common.checks import as_threads
from flockesc_env.episodes.batch import Columns, FlockBatch
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.episodes.spaces import RangeActions
from flockesc_env.policies.network import Architecture, Parameters
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Report = Callable[[int, int], None]


def play_flocks_of_networks(
    architecture: Architecture,
    parameters: Parameters,
    seeds: Sequence[int],
    scenario: FlockScenario,
    options: EnvOptions,
    *,
    per_agent: bool,
    num_threads: int | None,
    progress: Report | None = None,
) -> Columns:
    """Play the flock of every seed to the end of its episode. ``Learned`` predators fly straight on.

    Args:
        architecture: inputs and layers of the networks.
        parameters: weights and biases, shape (1, architecture.size) for one network on all flocks, or
            (seeds, architecture.size) for one network per flock.
        seeds: seeds of the flocks.
        scenario: the flock model's parameters.
        options: options of the environment.
        per_agent: True: networks set one range per agent. False: one per flock.
        num_threads: number of threads; ``None``: one per core.
        progress: called with (finished flocks, all flocks). ``None``: no calls.

    Returns:
        The outcomes in ``Episodes`` and the number of actions, ``num_actions``, each of shape (seeds,).

    Raises:
        ArgumentError: if the action mode is not ``"normalized"``, an input is not in the observation, or
            ``parameters`` has the wrong shape or an entry that is not finite.
    """
    batch = FlockBatch(scenario, options, per_agent=per_agent, num_threads=num_threads)
    return batch.rollout(architecture.to_core(), parameters, seeds, progress)


def play_lines_of_networks(
    architecture: Architecture,
    parameters: Parameters,
    seeds: Sequence[int],
    scenario: LineScenario,
    options: LineOptions,
    *,
    num_threads: int | None,
    progress: Report | None = None,
) -> Columns:
    """Play the line of every seed to the end of its episode; see ``play_flocks_of_networks``.

    Returns:
        The outcomes in ``LineEpisodes`` and the number of actions, ``num_actions``, each of shape (seeds,).
    """
    report = None if progress is None else lambda done: progress(done, len(seeds))
    return _core.rollout_line(
        scenario.to_json(),
        options.to_core(),
        RangeActions(options).core,
        architecture.to_core(),
        parameters,
        np.array(seeds, np.uint64),
        as_threads(num_threads),
        report,
    )
