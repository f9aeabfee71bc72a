"""Policies on flocks as jobs: a built-in name, or the bytes of a policy file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flockesc_env import FlockScenario, LineScenario, rollout
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import BasePolicy, load_policy
from flockesc_env.policies.registry import parse_policy

_AGENT_STEP = 200e-9
"""Estimated seconds of a step of one agent under a policy."""


def policy_of(policy: str | bytes) -> BasePolicy:
    """Return a built-in policy, or the one in the bytes of a policy file."""
    if isinstance(policy, str):
        return load_policy(policy)
    return parse_policy(policy, Path("policy.npz"))


def play(
    policy: str | bytes,
    scenario: FlockScenario | LineScenario,
    column: str,
    flocks: range,
    options: Mapping[str, Any] | None = None,
) -> Arrays:
    """Return an objective of every flock; ``options`` replace some of those that the policy was made for."""
    found = policy_of(policy).with_options(**(options or {}))
    return {"objective": getattr(rollout(scenario, found, flocks), column)}


def play_job(
    policy: str | bytes,
    scenario: FlockScenario | LineScenario,
    column: str,
    flocks: range,
    options: Mapping[str, Any] | None = None,
) -> Job:
    """Return the job of ``play``."""
    steps = scenario.num_steps if isinstance(scenario, FlockScenario) else 100
    slowness = (
        30 if isinstance(scenario, FlockScenario) and scenario.neighbor_rule.kind == "topological" else 1
    )
    seconds = len(flocks) * steps * scenario.num_agents * _AGENT_STEP * slowness
    return Job(f"{__name__}:play", (policy, scenario, column, flocks, dict(options or {})), seconds)
