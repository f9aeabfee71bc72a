"""PPO on a range policy: one slot per flock, or one slot per agent with a shared policy."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback, CallbackList, CheckpointCallback
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from flockesc_env import FlockScenario
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from training.config import RunRecord, TrainArgs
from training.seeds import training_seed

MODEL_FILE = "model.zip"


class ObjectiveLog(BaseCallback):
    """Logs the objectives that the flocks of a rollout reached."""

    def _on_step(self) -> bool:
        ended = {id(info): info for info in self.locals["infos"] if info["TimeLimit.truncated"]}
        for info in ended.values():
            self.logger.record_mean("flock/min_mean_distance", info["min_mean_distance"])
            self.logger.record_mean("flock/min_min_distance", info["min_min_distance"])
        return True


def train(args: TrainArgs, scenario: FlockScenario | None = None) -> Path:
    """Train a policy and return the path of its model.

    Raises:
        FileExistsError: if the run's folder already holds a model.
        ValueError: for an argument out of bounds.
    """
    model_path = args.run / MODEL_FILE
    if model_path.exists():
        raise FileExistsError(f"run: expected a folder without a model, got {args.run}")
    scenario = scenario or FlockScenario()
    first_seed = training_seed(args.seed, args.num_flocks)
    torch.set_num_threads(args.torch_threads)
    env = _env(args, scenario)
    rollout_length = -(-scenario.num_steps // args.steps_per_action)
    args.run.mkdir(parents=True, exist_ok=True)
    RunRecord(args, scenario).write(args.run)
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=rollout_length,
        batch_size=args.batch_size,
        n_epochs=args.n_epochs,
        learning_rate=args.learning_rate,
        gamma=args.gamma,
        gae_lambda=args.gae_lambda,
        clip_range=args.clip_range,
        ent_coef=args.ent_coef,
        policy_kwargs={"net_arch": list(args.net_arch), "log_std_init": args.log_std_init},
        tensorboard_log=str(args.run / "tensorboard"),
        seed=args.seed,
        device="cpu",
    )
    # After PPO has seeded the environment with a seed of its own choice.
    env.seed(first_seed)
    callbacks: list[BaseCallback] = [ObjectiveLog()]
    if args.checkpoint_every:
        every = args.checkpoint_every * rollout_length
        callbacks.append(CheckpointCallback(every, str(args.run / "checkpoints"), name_prefix="model"))
    model.learn(
        args.num_episodes * rollout_length * env.num_envs,
        callback=CallbackList(callbacks),
        log_interval=1,
        tb_log_name="ppo",
        progress_bar=args.progress,
    )
    model.save(model_path)
    return model_path


def _env(args: TrainArgs, scenario: FlockScenario) -> VecEnv:
    make = AgentVecEnv if args.per_agent else FlockVecEnv
    env: VecEnv = make(args.num_flocks, scenario, **dataclasses.asdict(args.env_options()))
    # Observations are scaled already; returns are brought to unit scale for the value network.
    return VecNormalize(VecMonitor(env), norm_obs=False, gamma=args.gamma)
