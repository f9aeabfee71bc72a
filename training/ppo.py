"""PPO of stable-baselines3 (Schulman et al., 2017): one range per agent, or one range for all agents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from flockesc_env import Architecture, NetworkPolicy
from flockesc_env.policies.sb3 import layer_parameters
from training.choices import ChoicePolicy, choosing_network
from training.config import PPOArgs
from training.evaluation import policy_spec
from training.rounds import Rounds
from training.scorer import ScorerPolicy


def ppo(args: PPOArgs) -> Path:
    """Train with PPO, or continue an unfinished run, and return the path of the policy file."""
    return PPORounds(args).train()


class Entries(BaseFeaturesExtractor):
    """Features extractor of stable-baselines3 that keeps some entries of the observation.

    Args:
        space: observation space.
        columns: columns of the entries.
    """

    def __init__(self, space: spaces.Box, columns: list[int]) -> None:
        super().__init__(space, len(columns))
        self._columns = columns

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the entries, shape (rows, columns)."""
        return observations[:, self._columns]


class PPORounds(Rounds[PPOArgs]):
    """A training run with PPO; a round is one rollout."""

    model: PPO

    def make(self, env: VecEnv) -> PPO:
        """Return a new PPO model."""
        args = self.args
        spec = policy_spec(args)
        policy_kwargs: dict[str, Any] = {"net_arch": list(args.net_arch)}
        columns = [spec.layout.index(name) for name in args.inputs or spec.layout.names]
        policy: str | type[ActorCriticPolicy] = "MlpPolicy"
        if args.candidate_inputs:
            policy = ScorerPolicy
            seen = {"inputs": args.inputs, "candidate_inputs": args.candidate_inputs}
            policy_kwargs |= {"spec": spec, **seen}
        elif args.ranges:
            policy = ChoicePolicy
            policy_kwargs["columns"] = columns
        else:
            policy_kwargs |= {
                "log_std_init": args.log_std_init,
                "features_extractor_class": Entries,
                "features_extractor_kwargs": {"columns": columns},
            }
        model = PPO(
            policy,
            env,
            n_steps=self.steps,
            batch_size=min(args.batch_size, self.steps * env.num_envs),
            n_epochs=args.n_epochs,
            learning_rate=self._learning_rate,
            gamma=args.gamma,
            gae_lambda=args.gae_lambda,
            clip_range=args.clip_range,
            ent_coef=args.ent_coef,
            policy_kwargs=policy_kwargs,
            seed=args.seed,
            device="cpu",
        )
        if not args.candidate_inputs and not args.ranges:
            last: Any = model.policy.action_net
            nn.init.constant_(last.bias, args.mean_init)
        return model

    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy: the mean, or the most probable, action."""
        actor: Any = self.model.policy
        if isinstance(actor, ScorerPolicy):
            return actor.network()
        spec = policy_spec(self.args)
        inputs = self.args.inputs or spec.layout.names
        linear = [*actor.mlp_extractor.policy_net, actor.action_net][::2]
        if self.args.ranges:
            actions = spec.actions.from_ranges(np.array(self.args.ranges))
            return choosing_network(inputs, linear, actions.ravel())
        hidden, parameters = layer_parameters(linear)
        return NetworkPolicy(Architecture(inputs, hidden), parameters)

    def _learning_rate(self, _: float) -> float:
        args: PPOArgs = self.args
        return args.learning_rate * (1 - self.done / args.num_episodes if args.anneal else 1)
