"""``SB3Policy``: models trained with stable-baselines3 as policies."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from flockesc_env.common.checks import as_flag
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory
from flockesc_env.policies.network import NetworkPolicy, Squash
from flockesc_env.policies.torch import torch_network


class SB3Policy(RowMemory):
    """A range policy or predator policy from a model of stable-baselines3 or sb3-contrib.

    The state of a recurrent model is kept per row and reset at the start of every episode. Use the
    environment options with which the model was trained. Different spaces are rejected. While the model holds
    its environment, so are other values of ``min_range``, ``max_range``, ``range_grid`` and
    ``profile_ranges``. A saved model contains its spaces but no environment: after ``model.load(path)``,
    without ``env``, only the spaces are compared. Options such as ``steps_per_action`` are never compared.

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
        begins = self._begin(len(observations))
        state = None if begins.all() else self._memory[0]  # the model resets the state of rows that begin
        actions: NDArray[Any]
        actions, state = self.model.predict(
            observations, state=state, episode_start=begins, deterministic=self.deterministic
        )
        self._remember(len(observations), state)
        return actions

    def network(self) -> NetworkPolicy:
        """Return the mode of the action distribution as a ``NetworkPolicy``, which ``save_policy`` can store.

        Raises:
            ArgumentError: if the model is not an ``MlpPolicy`` of PPO, A2C, SAC or TQC with tanh between its
                layers, for normalized actions and plain observations, or it holds no environment.
        """
        spec = self._trained_spec()
        policy: Any = getattr(self.model, "policy", None)
        is_plain = not getattr(getattr(self.model, "env", None), "norm_obs", False)
        actor: Any = getattr(policy, "actor", None)
        layers: list[Any] = []
        if hasattr(actor, "mu"):
            layers = [*actor.latent_pi, actor.mu]
        elif hasattr(policy, "mlp_extractor") and not hasattr(policy, "lstm_actor"):
            layers = [*policy.mlp_extractor.policy_net, policy.action_net]
        if spec is None or spec.actions.mode != "normalized" or not is_plain or not layers:
            expected = "an MlpPolicy with its environment, normalized actions and plain observations"
            raise ArgumentError("model", expected, type(self.model).__name__)
        squash: Squash = "tanh" if hasattr(actor, "mu") else "clip"
        return torch_network(layers, spec.layout.names, squash=squash)

    def _check_spaces(self, spec: PolicySpec | PredatorPolicySpec) -> None:
        actions = spec.actions.space() if isinstance(spec, PolicySpec) else spec.space()
        for name, space in (("observation_space", spec.layout.space()), ("action_space", actions)):
            trained = getattr(self.model, name, None)
            if trained is not None and trained != space:
                raise ArgumentError(f"model.{name}", f"the environment's, {space}", trained)
        trained_spec = self._trained_spec()
        if isinstance(spec, PolicySpec) and trained_spec is not None:
            trained_ranges, ranges = _ranges(trained_spec), _ranges(spec)
            for name, trained in trained_ranges.items():
                if trained != ranges[name]:
                    raise ArgumentError(name, f"{trained}, with which the model was trained", ranges[name])

    def _trained_spec(self) -> PolicySpec | None:
        """Return the spec of the environment in the model; ``None`` if it was loaded without one."""
        env: Any = getattr(self.model, "env", None)
        if not hasattr(env, "has_attr") or not env.has_attr("policy_spec"):
            return None
        found = env.get_attr("policy_spec", [0])[0]
        return found if isinstance(found, PolicySpec) else None


def _ranges(spec: PolicySpec) -> dict[str, Any]:
    """Return the options that give actions and candidates their ranges and leave spaces equal."""
    actions = spec.actions
    return {
        "min_range": actions.min_range,
        "max_range": actions.max_range,
        "range_grid": None if actions.grid is None else actions.grid.tolist(),
        "profile_ranges": spec.profile_ranges,
    }
