"""Training runs that take seconds: a small flock, few episodes, every learner."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from training.config import Args, ImitationArgs, PPOArgs, SearchArgs, TQCArgs

from flockesc_env import FlockScenario

SMALL = FlockScenario(num_agents=6, num_steps=24, initial_side=20.0)
LEARNERS = ("per-agent PPO", "shared PPO", "TQC", "search", "imitation")


def small_run(folder: Path, learner: str = "per-agent PPO", **changes: Any) -> Args:
    """Return the arguments of a small run, and write its scenario file beside its folder."""
    scenario = folder.parent / "small.toml"
    scenario.write_text(SMALL.to_toml())
    common: dict[str, Any] = {
        "run": folder,
        "scenario": str(scenario),
        "per_agent": learner == "per-agent PPO",
        "checkpoint_every": 2,
        "progress": False,
    }
    if learner == "search":
        return SearchArgs(**{**common, "population": 6, "flocks": 2, "generations": 4, **changes})
    if learner == "imitation":
        few = {"rounds": 4, "flocks": 20, "branches": 2, "epochs": 3, "hidden": (8,), "improve": True}
        profile = {"profile_ranges": (0.0, 5.0, 10.0), "extra_entries": ("escape_direction",)}
        seen = {"inputs": ("time",), "candidate_inputs": ("polarization", "heading_away", "range")}
        return ImitationArgs(**{**common, **few, **profile, **seen, "teacher": "turn-flock-away", **changes})
    common |= {"num_flocks": 2, "num_episodes": 4, "net_arch": (8, 8)}
    if learner == "TQC":
        few = {"learning_starts": 10, "batch_size": 16, "buffer_size": 60}
        return TQCArgs(**{**common, **few, **changes})
    batch_size = 24 if learner == "per-agent PPO" else 6
    reward = "individual_distance_change" if learner == "per-agent PPO" else "running_minimum"
    return PPOArgs(**{**common, "batch_size": batch_size, "reward": reward, **changes})
