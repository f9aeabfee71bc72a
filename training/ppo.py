"""PPO of stable-baselines3 (Schulman et al., 2017): one range per agent, or one range for all agents."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from training.config import PPOArgs
from training.rounds import Rounds


def ppo(args: PPOArgs) -> Path:
    """Train with PPO, or continue an unfinished run, and return the path of the policy file."""
    return PPORounds(args).train()


class PPORounds(Rounds[PPOArgs]):
    """A training run with PPO; a round is one rollout."""

    model: PPO

    def make(self, env: VecEnv) -> PPO:
        """Return a new PPO model."""
        args = self.args
        return PPO(
            "MlpPolicy",
            env,
            n_steps=self.steps,
            batch_size=min(args.batch_size, self.steps * env.num_envs),
            n_epochs=args.n_epochs,
            learning_rate=self._learning_rate,
            gamma=args.gamma,
            gae_lambda=args.gae_lambda,
            clip_range=args.clip_range,
            ent_coef=args.ent_coef,
            policy_kwargs={"net_arch": list(args.net_arch), "log_std_init": args.log_std_init},
            seed=args.seed,
            device="cpu",
        )

    def _learning_rate(self, _: float) -> float:
        args: PPOArgs = self.args
        return args.learning_rate * (1 - self.done / args.num_episodes if args.anneal else 1)
