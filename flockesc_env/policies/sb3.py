"""Policies trained with stable-baselines3."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from flockesc_env.common.checks import as_flag
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory


class SB3Policy(RowMemory):
    """A model trained with stable-baselines3 or sb3-contrib, or anything with their ``predict``.

    The state of a recurrent model is kept from action to action, row by row, and starts afresh with every
    episode. The environment must have the options that the model was trained with; spaces that differ are
    refused, other options cannot be compared.

    Args:
        model: has ``predict(observation, state, episode_start, deterministic)``, which returns actions and
            the next state. Its ``observation_space`` and ``action_space``, if it has them, are compared with
            the environment's.
        deterministic: whether to take the mode of the action distribution instead of a sample.
    """

    def __init__(self, model: Any, *, deterministic: bool = True) -> None:
        if isinstance(model, type) or not callable(getattr(model, "predict", None)):
            raise ArgumentError("model", "a model, which has a method predict", shown(model))
        self.model = model
        self.deterministic = as_flag(deterministic, "deterministic")
        self._state: Any = None
        self._fitting: Any = None

    def act(self, observations: Observations, spec: PolicySpec | PredatorPolicySpec) -> NDArray[Any]:
        """Ask the model for an action per row.

        Raises:
            ArgumentError: if the model's spaces are not the environment's, or rows appear or vanish within an
                episode.
        """
        if spec is not self._fitting:
            self._check_spaces(spec)
            self._fitting = spec
        begins = self._take_begins(len(observations))
        if begins.all():
            self._state = None
        actions: NDArray[Any]
        actions, self._state = self.model.predict(
            observations, state=self._state, episode_start=begins, deterministic=self.deterministic
        )
        return actions

    def _check_spaces(self, spec: PolicySpec | PredatorPolicySpec) -> None:
        actions = spec.actions.space() if isinstance(spec, PolicySpec) else spec.space()
        for name, space in (("observation_space", spec.layout.space()), ("action_space", actions)):
            trained = getattr(self.model, name, None)
            if trained is not None and trained != space:
                raise ArgumentError(f"model.{name}", f"the environment's, {space}", trained)
