"""Vectorized environments of stable-baselines3: a slot per flock, or a slot per agent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from flockesc_env._checks import as_seed
from flockesc_env.batch import EpisodeSeeds, FlockBatch, infos
from flockesc_env.options import EnvOptions
from flockesc_env.scenario import FlockScenario


class _BatchVecEnv(VecEnv):
    """A batch of flocks with ``rows`` slots each; all slots of a flock share its episode."""

    _per_agent: ClassVar[bool]

    def __init__(
        self,
        num_flocks: int,
        scenario: FlockScenario | None = None,
        *,
        num_threads: int | None = None,
        **options: Any,
    ) -> None:
        self._batch = batch = FlockBatch(
            scenario or FlockScenario(),
            EnvOptions(**options),
            num_flocks=num_flocks,
            per_agent=self._per_agent,
            num_threads=num_threads,
        )
        self.control = batch.control
        self.scenario = batch.scenario
        self.options = batch.options
        self.render_mode = None
        self._episode_seeds = [EpisodeSeeds() for _ in range(batch.num_flocks)]
        self._actions: NDArray[Any] | None = None
        slots = batch.num_flocks * batch.rows
        super().__init__(slots, batch.control.layout.space(), batch.control.actions.space())

    def reset(self) -> VecEnvObs:
        """Start an episode in every flock, with the seeds and options set since the last reset."""
        rows = self._batch.rows
        starts = [self._batch.start(options) for options in self._options[::rows]]
        for flock, (seeds, start) in enumerate(zip(self._episode_seeds, starts, strict=True)):
            self._batch.reset(flock, seeds.next(self._seeds[flock * rows]), start)
        self._reset_seeds()
        self._reset_options()
        flocks = range(self._batch.num_flocks)
        self.reset_infos = self._slot_infos(infos(self._batch), np.zeros(self.num_envs))
        return np.concatenate([self._batch.observe(flock) for flock in flocks])

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions of the next step, shape (num_envs, 1) or, where discrete, (num_envs,)."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step all flocks; a flock that reaches its horizon is reset at once.

        Raises:
            ActionError: for an action outside of the action space.
            EpisodeError: before ``reset``.
        """
        ranges = self.control.actions.to_ranges(self._actions, self.num_envs)
        observations, rewards = self._batch.step(ranges)
        slot_infos = self._slot_infos(infos(self._batch), ranges)
        rows = self._batch.rows
        ended = self._batch.ended()
        for flock in np.flatnonzero(ended).tolist():
            slots = range(flock * rows, (flock + 1) * rows)
            last = observations[slots.start : slots.stop].copy()
            for slot, observation in zip(slots, last, strict=True):
                slot_infos[slot]["TimeLimit.truncated"] = True
                slot_infos[slot]["terminal_observation"] = observation
            self._batch.reset(flock, self._episode_seeds[flock].next())
            observations[slots.start : slots.stop] = self._batch.observe(flock)
        return observations, rewards.astype(np.float32), np.repeat(ended, rows), slot_infos

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Give flock f the seed ``seed + f`` at the next reset; ``None``: seeds from the operating system."""
        rows = self._batch.rows
        first = EpisodeSeeds().next() if seed is None else as_seed(seed)
        as_seed(first + self._batch.num_flocks - 1, "seed of the last flock")
        self._seeds = [first + slot // rows for slot in range(self.num_envs)]
        return self._seeds

    def close(self) -> None:
        """Do nothing: the batch goes with its last reference."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute, which all slots share, once per slot asked for."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute; slots share it, so it is set for all or not at all.

        Raises:
            ValueError: if ``indices`` leaves slots out.
        """
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise ValueError(f"indices: expected all slots, which share {attr_name!r}, got {indices}")
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of this object once per slot asked for."""
        method = getattr(self, method_name)
        return [method(*method_args, **method_kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:  # noqa: ARG002
        """Return False for every slot: there is no Gymnasium environment inside that could be wrapped."""
        return [False for _ in self._get_indices(indices)]

    def _slot_infos(
        self, flocks: Iterable[dict[str, Any]], ranges: NDArray[np.float64]
    ) -> list[dict[str, Any]]:
        rows = self._batch.rows
        shared = [info for info in flocks for _ in range(rows)]
        return [
            {**info, "interaction_range": rho, "TimeLimit.truncated": False}
            for info, rho in zip(shared, ranges.tolist(), strict=True)
        ]


class FlockVecEnv(_BatchVecEnv):
    """A slot per flock: one action sets the range of a whole flock.

    Args:
        num_flocks: number of flocks, and of slots.
        scenario: the flock model's parameters; default: the paper's.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        **options: see ``EnvOptions``.

    Raises:
        ScenarioError: for an option out of bounds or a scenario without predator.
    """

    _per_agent = False


class AgentVecEnv(_BatchVecEnv):
    """A slot per agent: one policy, shared by all agents, sets the range of each.

    Slot ``f * num_agents + i`` is agent i of flock f. ``seed(s)`` gives flock f the seed ``s + f``.

    Args:
        num_flocks: number of flocks; there are ``num_flocks * scenario.num_agents`` slots.
        scenario: the flock model's parameters; default: the paper's.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        **options: see ``EnvOptions``.

    Raises:
        ScenarioError: for an option out of bounds or a scenario without predator.
    """

    _per_agent = True
