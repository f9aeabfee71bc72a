"""``SB3Policy``: models trained with stable-baselines3 as policies."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import ObservationLayout, PolicySpec
from flockesc_env.policies.base import BasePolicy, Observations, RowMemory, check_origins, normalizer_of
from flockesc_env.policies.network import NetworkPolicy, torch_network
from flockesc_env.scenario.options import UNOBSERVED, VIEWS

STORED_SPEC: Final = "flockesc_spec"
"""Attribute of a model for the spec of its training, which ``FlockEvalCallback`` sets; ``save`` keeps it."""


class SB3Policy(BasePolicy, RowMemory):
    """A range policy or predator policy from a model of stable-baselines3 or sb3-contrib.

    Actions are the modes of the model's distributions. The state of a recurrent model is kept per row and
    reset at the start of every episode. The model plays with the scenario and the options of its environment;
    ``reward`` and ``count_components`` may differ. A saved model contains its spaces but no environment.
    After ``model.load(path)``, without ``env``, the policy classes ``RangePolicy`` and ``ScorerPolicy``, and
    models that ``FlockEvalCallback`` judged, still know them; with another model give options to
    ``with_options`` or to the call that plays.

    Observations are normalized with the statistics of ``vec_normalize``. A saved model does not contain these
    statistics. It contains the last observations of its training: if they are out of bounds, they were
    normalized, and the model is rejected without ``vec_normalize``. Loading with an ``env`` deletes them.
    Then a model of PPO, A2C or TRPO whose training had a ``VecNormalize`` that ``env`` lacks is rejected;
    models of off-policy algorithms keep no trace.

    Args:
        model: a model, or any object with a method ``predict(observation, state, episode_start,
            deterministic)`` that returns actions and the next state. Its attributes ``observation_space`` and
            ``action_space``, if present, must equal those of the environment.
        vec_normalize: the ``VecNormalize`` of the training, for example ``VecNormalize.load(path, venv)``.
            ``None``: the outermost one of the model's environment that normalizes observations, if any.
            False: observations were not normalized, as with ``VecNormalize(norm_obs=False)``.
    """

    def __init__(self, model: Any, *, vec_normalize: Any = None) -> None:
        if isinstance(model, type) or not callable(getattr(model, "predict", None)):
            raise InputError("model", "a model (an object with a method predict)", shown(model))
        is_given = vec_normalize is not None and vec_normalize is not False
        if is_given and not hasattr(vec_normalize, "norm_obs"):
            raise InputError("vec_normalize", "a VecNormalize, None or False", shown(vec_normalize))
        self.model, self.name = model, type(model).__name__
        self.vec_normalize = vec_normalize
        self.observation_space = getattr(model, "observation_space", None)
        self._checked_spec: Any = None
        env = self._environment()
        spec, space = _spec_of(env) or _stored_spec(model), getattr(model, "action_space", None)
        is_predator = getattr(space, "shape", None) in ((2,), (3,))
        self.side = "predator" if is_predator else None if spec is None else "flock"
        if spec is not None:
            self.options, self.per_agent, self.scenario = asdict(spec.options), spec.per_agent, spec.scenario
            self.opponent = spec.opponent

    def check_known(self) -> None:
        """Raise ``InputError`` if the options of the training are unknown, or two origins disagree."""
        name, env = type(self.model).__name__, self._environment()
        if self.scenario is None and self.options is None and self.observation_space is not None:
            expected = (
                f"the environment of the training, as after {name}.load(path, env=env), or its scenario and"
                " options, as in SB3Policy(model).with_options(scenario=.., **options)"
            )
            raise InputError("model.env", expected, "none" if env is None else shown(env))
        stored, found = _stored_spec(self.model), _spec_of(env)
        if stored is not None and found is not None:
            known = {"the spec stored in the model": vars(stored.options)}
            known["the environment of the model"] = vars(found.options)
            check_origins(known, f"; type {name}.load(path) to play with the stored ones")

    def act(self, observations: Observations, spec: PolicySpec | PredatorPolicySpec) -> NDArray[Any]:
        """Return the model's action for every row, after ``check_spec``; see ``Policy.act``."""
        if spec is not self._checked_spec:
            self.check_spec(spec)
            self._checked_spec = spec
        begins = self._begin(len(observations))
        state = None if begins.all() else self._memory[0]  # the model resets the state of rows that begin
        normalizer = self._normalizer()
        actions: NDArray[Any]
        actions, state = self.model.predict(
            observations if normalizer is None else normalizer.normalize_obs(observations),
            state=state,
            episode_start=begins,
            deterministic=True,
        )
        self._remember(len(observations), state)
        return actions

    def network(self) -> NetworkPolicy:
        """Return the mode of the action distribution as a ``NetworkPolicy``, which ``save_policy`` can store.

        Of discrete actions it is the range with the largest logit or Q value. The network knows the scenario,
        the view and the options of the model's environment.

        The statistics of normalized observations become part of the first layer. A network cannot clip its
        inputs, as ``VecNormalize`` does at ``clip_obs`` standard deviations. Train with
        ``VecNormalize(env, clip_obs=numpy.inf)``, or set this attribute and compare before and after.

        Raises:
            InputError: if the model is not a ``ScorerPolicy``, or an ``MlpPolicy`` of PPO, A2C, TRPO, SAC,
                TQC, TD3, DDPG or DQN with tanh or ReLU between its layers; if its actions are ranges in m;
                if the options of its training are unknown; if a wrapper changes the spaces; if the
                statistics of normalized observations are missing, or observations can reach ``clip_obs``.
        """
        scorer = getattr(getattr(self.model, "policy", None), "network", None)
        layers = [] if scorer is not None else _layers(self.model)
        self.check_known()
        is_predator, spec = self.side == "predator", self.policy_spec
        if not is_predator and spec.actions.mode == "range":
            expected = "'normalized' or 'discrete'"
            raise InputError("model.env.options.action_mode", expected, repr(spec.actions.mode))
        self.check_spec(spec)
        if scorer is not None:  # of ``ScorerPolicy``
            network: NetworkPolicy = scorer()
        else:
            grid = None if is_predator else spec.actions.grid
            head: Any = {"ranges": () if grid is None else tuple(grid.tolist()), "is_predator": is_predator}
            head["squash"] = "tanh" if self.model.policy.squash_output else "clip"
            network = torch_network(layers, spec.layout.names, **head)
            if (normalizer := self._normalizer()) is not None:
                network = _normalized(network, spec.layout, normalizer)
        options = (self.options or {}) if is_predator else vars(spec.options)
        made_for = {name: value for name, value in options.items() if name not in UNOBSERVED}
        known: Any = {"per_agent": spec.per_agent, "scenario": spec.scenario, "opponent": self.opponent}
        return network.with_options(**known, **made_for)

    def _environment(self) -> Any:
        """Return the environment that the model or else the wrapper holds, or ``None``."""
        env = getattr(self.model, "env", None)
        return self.vec_normalize or None if env is None else env

    def _normalizer(self) -> Any:
        """Return the ``VecNormalize`` that normalizes observations, or ``None``."""
        given = self.vec_normalize
        return normalizer_of(getattr(self.model, "env", None) if given is None else given)

    def _check_normalizer(self, layout: ObservationLayout) -> None:
        normalizer, last = self._normalizer(), getattr(self.model, "_last_obs", None)
        if normalizer is not None and normalizer.obs_rms.mean.shape != layout.low.shape:
            expected = f"statistics of {len(layout.low)} entries"
            raise InputError("vec_normalize", expected, normalizer.obs_rms.mean.shape)
        if normalizer is not None or self.vec_normalize is not None:
            return
        if last is not None:
            is_plain = bool(((last >= layout.low) & (last <= layout.high)).all())
        else:
            # Loading with an environment deletes the last observations, but not the original ones, which
            # a VecNormalize leaves in a model. Off-policy algorithms always have some.
            is_wrapped = getattr(self.model, "get_vec_normalize_env", lambda: None)() is not None
            has_original = getattr(self.model, "_last_original_obs", None) is not None
            is_plain = is_wrapped or not has_original or hasattr(self.model, "replay_buffer_class")
        if not is_plain:
            expected = "VecNormalize.load(path, venv) of the training, or False if it normalized only rewards"
            raise InputError("vec_normalize", expected, "none")

    def check_spec(self, spec: PolicySpec | PredatorPolicySpec) -> None:
        """Raise ``InputError`` unless an environment has the model's spaces, and its statistics are known."""
        row = "predator"
        if isinstance(spec, PolicySpec):
            self.check(spec.options, per_agent=spec.per_agent)
            row = VIEWS[spec.per_agent]
        observed = spec.layout.space()
        if self.observation_space is not None and self.observation_space != observed:
            raise space_error(self.observation_space, {row: observed})
        trained = getattr(self.model, "action_space", None)
        if trained is not None and trained != spec.space():
            raise InputError("model.action_space", f"the environment's, {spec.space()}", trained)
        self._check_normalizer(spec.layout)


def _stored_spec(model: Any) -> Any:
    """Return the spec that a callback, ``RangePolicy`` or ``ScorerPolicy`` stores in a model, or ``None``."""
    found = getattr(model, STORED_SPEC, None) or (getattr(model, "policy_kwargs", None) or {}).get("spec")
    return found if isinstance(found, PolicySpec | PredatorPolicySpec) else None


def _spec_of(env: Any) -> Any:
    """Return the spec of an environment of stable-baselines3; ``None`` if it has none of this package."""
    try:
        found = env.get_attr("policy_spec", [0])[0]
    except (AttributeError, TypeError):  # SuperSuit's environments have no such method
        return None
    return found if isinstance(found, PolicySpec | PredatorPolicySpec) else None


def space_error(trained: Any, spaces: Mapping[Any, gymnasium.Space[Any]]) -> InputError:
    """Return the error about a model whose observations are not those of a flock, an agent or a predator."""
    shapes = " or ".join(f"{space.shape} for one row per {name}" for name, space in spaces.items())
    is_known = trained.shape in {space.shape for space in spaces.values()}
    return InputError(
        "model.observation_space",
        f"shape {shapes}, with the options of the training and without a wrapper that changes observations"
        " (VecFrameStack, TimeAwareObservation); env=.. plays through wrappers",
        f"{trained.shape or trained}{' with other bounds' if is_known else ''}",
    )


def _layers(model: Any) -> list[Any]:
    """Return the layers of torch from the observation to the mean of the action."""
    policy: Any = getattr(model, "policy", None)
    actor: Any = getattr(policy, "actor", None)
    extractor: Any = getattr(policy, "mlp_extractor", None)
    if hasattr(policy, "lstm_actor"):
        raise InputError("model", "a model without a memory", type(model).__name__)
    if hasattr(actor, "mu"):  # TD3 and DDPG have all layers and a tanh in ``mu``
        parts = [actor.features_extractor, getattr(actor, "latent_pi", []), actor.mu]
    elif hasattr(policy, "q_net"):
        parts = [policy.q_net.features_extractor, policy.q_net.q_net]
    elif hasattr(extractor, "policy_net") and hasattr(policy, "action_net"):
        parts = [policy.pi_features_extractor, extractor.policy_net, policy.action_net]
    else:
        expected = "an MlpPolicy of PPO, A2C, TRPO, SAC, TQC, TD3, DDPG or DQN"
        raise InputError("model", expected, type(model).__name__)
    layers = [layer for part in parts for layer in (part if hasattr(part, "__iter__") else [part])]
    if type(layers[0]).__name__ == "FlattenExtractor":
        del layers[0]
    if type(layers[-1]).__name__ == "Tanh":
        del layers[-1]
    return layers


def _normalized(network: NetworkPolicy, layout: ObservationLayout, normalizer: Any) -> NetworkPolicy:
    """Return a network for plain observations from one for normalized ones that are never clipped."""
    mean, scale = normalizer.obs_rms.mean, np.sqrt(normalizer.obs_rms.var + normalizer.epsilon)
    farthest = np.maximum(layout.high - mean, mean - layout.low) / scale
    if farthest.max() > normalizer.clip_obs:
        expected = f"numpy.inf, as a network cannot clip its input {layout.names[farthest.argmax()]!r}"
        raise InputError("vec_normalize.clip_obs", expected, normalizer.clip_obs)
    inputs, outputs = network.architecture.shapes[0]
    weights, biases, rest = np.split(network.parameters, [inputs * outputs, (inputs + 1) * outputs])
    weights = (weights.reshape(inputs, outputs) / scale[:, np.newaxis]).astype(np.float32)
    parameters = np.concatenate([weights.ravel(), biases - (mean[:, np.newaxis] * weights).sum(axis=0), rest])
    return type(network)(network.architecture, parameters)
