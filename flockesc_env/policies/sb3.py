"""``SB3Policy``: models trained with stable-baselines3 as policies."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from flockesc_env.common.checks import as_flag
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory


class SB3Policy(RowMemory):
    """A range policy or predator policy from a model of stable-baselines3 or sb3-contrib.

    The state of a recurrent model is kept per row and reset at the start of every episode. Use the
    environment options with which the model was trained. Different spaces are rejected, and, while the model
    holds its environment, other bounds of the range. Other options cannot be checked.

    Args:
        model: a model, or any object with a method ``predict(observation, state, episode_start,
            deterministic)`` that returns actions and the next state. Its attributes ``observation_space`` and
            ``action_space``, if present, must equal those of the environment.
        deterministic: True: the mode of the action distribution. False: a sample.

    Raises:
        ArgumentError: if ``model`` has no method ``predict``.
    """

    def __init__(self, model: Any, *, deterministic: bool = True) -> None:
        if isinstance(model, type) or not callable(getattr(model, "predict", None)):
            raise ArgumentError("model", "a model (an object with a method predict)", shown(model))
        self.model = model
        self.deterministic = as_flag(deterministic, "deterministic")
        self._state: Any = None
        self._checked_spec: Any = None

    def act(self, observations: Observations, spec: PolicySpec | PredatorPolicySpec) -> NDArray[Any]:
        """Return the model's action for every row; see ``Policy.act``.

        Raises:
            ArgumentError: if the model's spaces differ from the environment's, or the number of rows changes
                during an episode.
        """
        if spec is not self._checked_spec:
            self._check_spaces(spec)
            self._checked_spec = spec
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
        env = getattr(self.model, "env", None)  # a VecEnv; None in a model that was loaded without one
        if isinstance(spec, PolicySpec) and hasattr(env, "has_attr") and env.has_attr("policy_spec"):
            trained_spec = env.get_attr("policy_spec", [0])[0]
            for name in ("min_range", "max_range"):
                trained = getattr(trained_spec.actions, name)
                if trained != getattr(spec.actions, name):
                    raise ArgumentError(
                        name, f"{trained}, with which the model was trained", getattr(spec.actions, name)
                    )
