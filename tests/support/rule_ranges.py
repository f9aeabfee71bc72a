"""Ranges that every built-in rule sets in a small flock."""

from option_table import small_flock

from flockesc_env import load_policy, simulate
from flockesc_env.policies import StubbornWitnesses
from flockesc_env.policies.registry import NAMES


def ranges() -> dict[str, list[list[float]]]:
    """Return the ranges in m of every rule in every model step, by name."""
    policies = {name: load_policy(name) for name in NAMES if name != "fixed:RHO"}
    crowded = StubbornWitnesses(first_range=15.0, interaction_range=0.0, crowding=10.0)
    policies["stubborn-witnesses with a logarithm"] = crowded
    scenario = small_flock(num_agents=60, num_steps=40, initial_side=80.0)
    runs = {name: simulate(scenario, policy=policy, seed=3) for name, policy in policies.items()}
    return {name: run.interaction_ranges.tolist() for name, run in runs.items()}
