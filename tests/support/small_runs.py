"""Training runs that take seconds: small flocks, few episodes, every kind of learner."""

import dataclasses
from pathlib import Path
from typing import Any

from flockesc_env import FlockScenario
from flockesc_env.taskset import Task, tasks
from flockesc_env.taskset.learners import Learner
from training.run import Run

SMALL = FlockScenario(num_agents=6, num_steps=24, initial_side=20.0)


def small_task(name: str = "per-agent-visible", scenario: FlockScenario = SMALL, **options: Any) -> Task:
    """Return a task with a small flock, scored in it."""
    task = tasks[name]
    scales = {"small": next(iter(task.scales.values()))}
    chosen = {**task.options, **options}
    return dataclasses.replace(
        task, scenario=scenario, options=chosen, scales=scales, scenarios={"small": scenario}
    )


_PPO = {"n_steps": 6, "batch_size": 24, "n_epochs": 3}
_REPLAY = {
    "learning_starts": 10,
    "batch_size": 8,
    "buffer_size": 1_000,
    "policy_kwargs": {"activation_fn": "torch.nn:Tanh"},
}
_SEARCH = {"population": 6, "flocks": 2, "generations": 4, "checkpoint_every": 2}
_RULE = {"rounds": 4, "population": 6, "episodes": 84, "judged": 40, "checkpoint_every": 2}
_GRADIENT = {"hidden": (3,), "memory": 1, "flocks": 2, "updates": 4, "checkpoint_every": 2}
_IMITATION = {
    "teacher": "fixed:5",
    "ranges": [0.0, 5.0, 10.0],
    "improve": True,
    "inputs": ["time", "polarization"],
    "rounds": 4,
    "flocks": 20,
    "branches": 2,
    "epochs": 3,
    "hidden": [8],
    "checkpoint_every": 2,
}
LEARNERS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "PPO": ("per-agent-visible", {}, _PPO),
    "A2C": ("one-range", {}, {"n_steps": 6}),
    "SAC": ("one-range", {}, _REPLAY),
    "TQC": ("one-range", {}, _REPLAY),
    "DQN": ("one-range", {"action_mode": "discrete"}, _REPLAY),
    "RecurrentPPO": ("per-agent-local", {}, _PPO),
    "search": ("per-agent-visible", {}, _SEARCH),
    "gradient": ("per-agent-visible", {}, _GRADIENT),
    "imitation": ("one-range", {}, _IMITATION),
    "rule": ("per-agent-visible", {}, _RULE),
}
"""Task, options and hyperparameters by algorithm."""


def small_run(
    folder: Path,
    algorithm: str = "PPO",
    *,
    seed: int = 0,
    task: str = "",
    scenario: FlockScenario = SMALL,
    options: Any = None,
    **changes: Any,
) -> Run:
    """Return a small run; ``changes`` are hyperparameters or fields of the learner."""
    name, own, hyperparameters = LEARNERS[algorithm]
    fields = {key: changes.pop(key) for key in [*changes] if key in Learner.__struct_fields__}
    fields.setdefault("algorithm", algorithm)
    policy = "MlpLstmPolicy" if algorithm == "RecurrentPPO" else "MlpPolicy"
    learner = Learner(
        **{
            "algorithm": algorithm,
            "policy": policy,
            "num_flocks": 2,
            "num_evaluations": 2,
            "samples": 6 * 2 * 6 * 4 if name.startswith("per") else 6 * 2 * 4,
            "options": {**own, **(options or {})},
            "hyperparameters": {**hyperparameters, **changes},
            **fields,
        }
    )
    chosen = small_task(task or name, scenario)
    return Run(task=chosen, name=algorithm.lower(), learner=learner, seed=seed, folder=folder, progress=False)
