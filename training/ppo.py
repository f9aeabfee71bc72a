"""PPO of stable-baselines3 (Schulman et al., 2017): one range per agent, or one range for all agents."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from flockesc_env import Architecture, ArgumentError, FlockScenario, LineScenario, NetworkPolicy
from flockesc_env.episodes.spaces import RangeActions
from flockesc_env.policies.torch import layer_parameters
from training.choices import ChoicePolicy
from training.config import PPOArgs
from training.evaluation import policy_spec
from training.rounds import SB3Rounds
from training.scorer import ScorerPolicy


class PPORounds(SB3Rounds[PPOArgs]):
    """A training run with PPO; a round is one rollout.

    Raises:
        ArgumentError: if the policy sees the time and ``PPOArgs.episode_steps`` would change it, or if it
            scores candidates and there are none.
    """

    model: PPO

    def __init__(self, args: PPOArgs) -> None:
        self._spec = policy_spec(args)
        self._inputs = args.inputs or self._spec.layout.names  # of a policy that scores no candidates
        super().__init__(args)

    def scenario(self) -> FlockScenario | LineScenario:
        """Return the scenario with the episodes of training."""
        args, scenario = self.args, self.args.model
        if not args.episode_steps or isinstance(scenario, LineScenario):
            return scenario
        if "time" in args.inputs or not (args.inputs or args.candidate_inputs):
            given = args.inputs or "all entries"
            raise ArgumentError("inputs", "entries without time, because episode_steps is given", given)
        return scenario.replace(num_steps=args.episode_steps)

    def make_env(self, scenario: FlockScenario | LineScenario, options: dict[str, Any]) -> VecEnv:
        """Return the environment of training, with discrete actions for a choice of ranges."""
        args = self.args
        if args.candidate_inputs and not args.profile_ranges:
            raise ArgumentError("profile_ranges", "candidate ranges for a network that scores them", "none")
        if grid := args.ranges or (args.candidate_inputs and args.profile_ranges):
            options |= {"action_mode": "discrete", "range_grid": grid}
        env = super().make_env(scenario, options)
        return _RangeCost(env, args.range_cost) if args.range_cost else env

    def make(self, env: VecEnv) -> PPO:
        """Return a new PPO model."""
        args = self.args
        columns = [self._spec.layout.index(name) for name in self._inputs]
        policy: str | type[ActorCriticPolicy] = "MlpPolicy"
        own: dict[str, Any]
        if args.candidate_inputs:
            policy = ScorerPolicy
            own = {"spec": self._spec, "inputs": args.inputs, "candidate_inputs": args.candidate_inputs}
        elif args.ranges:
            policy, own = ChoicePolicy, {"columns": columns}
        else:
            own = {"log_std_init": args.log_std_init, "features_extractor_class": _Entries}
            own["features_extractor_kwargs"] = {"columns": columns}
        return PPO(
            policy,
            env,
            n_steps=self.steps,
            batch_size=min(args.batch_size, self.steps * env.num_envs),
            n_epochs=args.n_epochs,
            learning_rate=self._learning_rate,
            gamma=args.gamma,
            gae_lambda=args.gae_lambda,
            policy_kwargs={"net_arch": list(args.net_arch), **own},
            seed=args.seed,
            device="cpu",
        )

    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy: the mean, or the most probable, action."""
        actor: Any = self.model.policy
        if isinstance(actor, ScorerPolicy):
            return actor.network()
        linear = [*actor.mlp_extractor.policy_net, actor.action_net][::2]
        hidden, parameters = layer_parameters(linear)
        return NetworkPolicy(Architecture(self._inputs, hidden, ranges=self.args.ranges), parameters)

    def _learning_rate(self, _: float) -> float:
        args: PPOArgs = self.args
        return args.learning_rate * (1 - self.completed / args.num_episodes if args.anneal else 1)


class _Entries(BaseFeaturesExtractor):
    """Features extractor of stable-baselines3 that keeps some entries of the observation."""

    def __init__(self, space: spaces.Box, columns: list[int]) -> None:
        super().__init__(space, len(columns))
        self._columns = columns

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return observations[:, self._columns]


class _RangeCost(VecEnvWrapper):
    """Wrapper that deducts the cost of a range from the reward of an action; see ``PPOArgs.range_cost``."""

    def __init__(self, venv: VecEnv, cost: float) -> None:
        super().__init__(venv)
        self._actions: RangeActions = venv.get_attr("policy_spec")[0].actions
        self._cost = cost / self._actions.max_range
        self._ranges = np.zeros(venv.num_envs)

    def reset(self) -> VecEnvObs:
        return self.venv.reset()

    def step_async(self, actions: NDArray[Any]) -> None:
        self._ranges = self._actions.to_ranges(actions, self.num_envs)
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        observations, rewards, dones, infos = self.venv.step_wait()
        return observations, (rewards - self._cost * self._ranges).astype(np.float32), dones, infos
