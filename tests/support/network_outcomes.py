"""Outcomes of networks in the core as hashes of their raw bytes, and the ranges of all rules.

``python tests/support/network_outcomes.py > tests/golden/network_outcomes.json`` rewrites them after a change
of results that is intended.
"""

import hashlib
import json
import math
import sys
from dataclasses import fields
from typing import Any

import numpy as np
from golden_episodes import CHASED, RANDOM
from objective_values import LATER
from option_table import EVERY_STEP, small_flock

from flockesc_env import FlockScenario, LineScenario, NetworkPolicy, load_policy, rollout, simulate
from flockesc_env.policies import NAMES, Architecture, StubbornWitnesses

SEEDS = range(6)
SHARED = ("last_range", "polarization", "mean_distance", "heading_away", "spread")
OWN = ("predator_distance", "heard_velocity_left", "last_range", "predator_direction_left", "neighbor_count")
ARCHITECTURES = {
    "agents": Architecture(OWN, (8,)),
    "agents, mirror and memory": Architecture(OWN, (5, 3), memory=2, mirror=True, squash="tanh"),
    "agents, wide": Architecture(OWN, (64, 64), mirror=True),
    "agents, linear": Architecture(OWN, ()),
    "agents, ReLU": Architecture(OWN, (8,), activation="relu"),
    "flock": Architecture(SHARED, (6,)),
    "flock, memory": Architecture(("time",), (4,), memory=1, squash="tanh"),
}

Case = tuple[FlockScenario | LineScenario, Architecture, dict[str, Any]]


def policy_of(architecture: Architecture) -> NetworkPolicy:
    """Return a network that listens far and near; its parameters are exact on every machine."""
    return NetworkPolicy(architecture, ((37 * np.arange(architecture.size) + 11) % 61 - 30) / 32)


def cases() -> dict[str, Case]:
    """Return scenario, architecture and options of every case by name."""
    paper = FlockScenario(num_agents=70, num_steps=120)
    seen = {"max_range": 20.0, "predator_sensing_range": math.inf}
    found: dict[str, Case] = {
        name: (paper, architecture, {**seen, "per_agent": name.startswith("agents"), "steps_per_action": 4})
        for name, architecture in ARCHITECTURES.items()
    }
    for dimension in (2, 3):
        small = small_flock(dimension, num_steps=40, **RANDOM)
        own = {**EVERY_STEP, "per_agent": True, "reward": "individual_distance_change", "steps_per_action": 3}
        found[f"capture, {dimension}D"] = (small, ARCHITECTURES["agents, mirror and memory"], own)
        chased = small_flock(dimension, num_steps=40, **CHASED)
        far = {**EVERY_STEP, "min_range": 2.0}
        found[f"shared range, {dimension}D"] = (chased, ARCHITECTURES["flock"], far)
        learned = chased.with_learned_predators()
        found[f"learned predators, {dimension}D"] = (learned, ARCHITECTURES["flock, memory"], EVERY_STEP)
    line = Architecture(("time", "escape_distance", "offset_0", "offset_9"), (8,), memory=1)
    found["line"] = (LineScenario(num_agents=10), line, {"steps_per_action": 2})
    return found


def outcome_hash(case: Case, num_threads: int) -> str:
    scenario, architecture, options = case
    played = rollout(scenario, policy_of(architecture), SEEDS, num_threads=num_threads, **options)
    digest = hashlib.sha256()
    for field in fields(played):
        if field.name not in LATER:
            digest.update(field.name.encode() + getattr(played, field.name).tobytes())
    return digest.hexdigest()


def hashes(num_threads: int) -> dict[str, str]:
    return {name: outcome_hash(case, num_threads) for name, case in cases().items()}


def ranges() -> dict[str, list[list[float]]]:
    """Return the ranges in m of every built-in rule in every step of a small flock, by name."""
    policies = {name: load_policy(name) for name in NAMES if name != "fixed:RHO"}
    crowded = StubbornWitnesses(first_range=15.0, interaction_range=0.0, crowding=10.0)
    policies["stubborn-witnesses with a logarithm"] = crowded
    scenario = small_flock(num_agents=60, num_steps=40, initial_side=80.0)
    runs = {name: simulate(scenario, policy=policy, seed=3) for name, policy in policies.items()}
    return {name: run.interaction_ranges.tolist() for name, run in runs.items()}


if __name__ == "__main__":
    json.dump(hashes(1), sys.stdout, indent=4)
    print()
