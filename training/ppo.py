"""PPO of stable-baselines3 (Schulman et al., 2017): one range per agent, or one range for all agents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from flockesc_env import NetworkPolicy
from training.config import PPOArgs
from training.evaluation import policy_spec
from training.rounds import Rounds
from training.scorer import ScorerPolicy


def ppo(args: PPOArgs) -> Path:
    """Train with PPO, or continue an unfinished run, and return the path of the policy file."""
    return PPORounds(args).train()


class PPORounds(Rounds[PPOArgs]):
    """A training run with PPO; a round is one rollout."""

    model: PPO

    def make(self, env: VecEnv) -> PPO:
        """Return a new PPO model."""
        args = self.args
        policy_kwargs: dict[str, Any] = {"net_arch": list(args.net_arch)}
        if args.candidate_inputs:
            seen = {"inputs": args.inputs, "candidate_inputs": args.candidate_inputs}
            policy_kwargs |= {"spec": policy_spec(args), **seen}
        else:
            policy_kwargs["log_std_init"] = args.log_std_init
        return PPO(
            ScorerPolicy if args.candidate_inputs else "MlpPolicy",
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

    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy: the mean, or the most probable, action."""
        actor = self.model.policy
        return actor.network() if isinstance(actor, ScorerPolicy) else super().policy()

    def _learning_rate(self, _: float) -> float:
        args: PPOArgs = self.args
        return args.learning_rate * (1 - self.done / args.num_episodes if args.anneal else 1)
