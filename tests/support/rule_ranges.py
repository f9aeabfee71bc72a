"""Ranges that every built-in rule sets in a small flock."""

from __future__ import annotations

from option_table import EVERY_STEP, small_flock

from flockesc_env.policies import StubbornWitnesses
from flockesc_env.policies.registry import NAMES, NamedPolicy, built_in


def ranges() -> dict[str, list[list[float]]]:
    """Return the ranges in m of every rule in every model step, by name."""
    policies = {name: built_in(name) for name in NAMES if name != "fixed:RHO"}
    crowded = StubbornWitnesses(first_range=15.0, interaction_range=0.0, crowding=10.0)
    policies["stubborn-witnesses with a logarithm"] = NamedPolicy("", crowded, True, EVERY_STEP)
    scenario = small_flock(num_agents=60, num_steps=40, initial_side=80.0)
    return {name: policy.record(3, scenario).interaction_ranges.tolist() for name, policy in policies.items()}
