"""Policies on the flocks of a setting, as jobs."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from flockesc_env import LineScenario, NamedPolicy, load_policy, rollout
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import find_policy
from training.config import Setting

_AGENT_STEP = 80e-9
"""Estimated seconds of a step of one agent under a network."""


def play_job(policy: str | bytes, setting: Setting, flocks: range) -> Job:
    """Return the job that plays a policy, a built-in name or the bytes of its file, on some flocks."""
    model = setting.model
    steps = 100 if isinstance(model, LineScenario) else model.num_steps
    seconds = len(flocks) * steps * model.num_agents * _AGENT_STEP
    return Job("studies.learned.held_out:objectives", (policy, setting, flocks), seconds)


def objectives(policy: str | bytes, setting: Setting, flocks: range) -> Arrays:
    """Return the objective of every flock, with the options that the policy was made for."""
    entry = find_policy(policy) if isinstance(policy, str) else stored_policy(policy)
    return {"objective": setting.spec.values(rollout(setting.model, entry, flocks))}


def stored_policy(file: bytes) -> NamedPolicy:
    """Return the policy in the bytes of a policy file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "policy.npz"
        path.write_bytes(file)
        return load_policy(path)
