"""How a rule, a search and gradients set ranges in one task: who listens, how far, how often it changes."""

from copy import copy
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from flockesc_env import NetworkPolicy
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays
from flockesc_env.policies import rollout
from flockesc_env.policies.setup import setup
from flockesc_env.render.frames import SILENT
from studies.findings.controls import watch
from studies.measurements import Runner, policy_of, share_of, split
from studies.scoreboard.board import BOARD
from studies.study import document

STYLES_FILE: Final = "styles.json"
TASK: Final = "per-agent-visible"
FLOCKS: Final = 200
LEARNERS: Final = ("rule", "search", "gradient")
CONTROL: Final = "gradient, memory erased"
_FAR, _WITHIN = 0.95, 0.5  # share of the longest range; cosine of 60 degrees


def style(policy: bytes, forgets: bool, flocks: range) -> Arrays:
    """Return who listens under a policy that acts on its own task, one number per flock.

    Returns:
        ``objective``: J_mean in m. ``nobody`` and ``farthest``: shares of the actions with a range below
        ``SILENT``, and of at least 0.95 of the longest. ``toward`` and ``away``: share that listens of the
        agents that head within 60 degrees of the predator's direction, or of the opposite one.
        ``changes``: changes between listening and not per agent and second.
    """
    entry: Any = policy_of(policy)
    if forgets:
        entry = without_memory(entry)
    watched, known = watch(entry, flocks), entry.policy_spec
    shape = (len(watched.ranges), len(flocks), -1)
    ranges = np.array(watched.ranges).reshape(shape)
    cosine = watched.entry("predator_direction_ahead").reshape(shape)
    listens, scenario = ranges >= SILENT, known.scenario
    seconds = (len(ranges) - 1) * known.options.steps_per_action * scenario.time_step
    groups = {"toward": cosine >= _WITHIN, "away": cosine <= -_WITHIN}
    return {
        "objective": rollout.play(setup(entry), flocks)["min_mean_distance"],
        "nobody": (~listens).mean(axis=(0, 2)),
        "farthest": (ranges >= _FAR * known.options.max_range).mean(axis=(0, 2)),
        **{
            name: (listens & group).sum(axis=(0, 2)) / group.sum(axis=(0, 2))
            for name, group in groups.items()
        },
        "changes": (listens[1:] != listens[:-1]).sum(axis=0).mean(axis=1) / seconds,
    }


def without_memory(policy: NetworkPolicy) -> NetworkPolicy:
    """Return a copy of a network whose first layer does not read its memory; nothing else changes."""
    network, changed = policy.architecture, copy(policy)
    inputs, columns = len(network.inputs), network.shapes[0][1]
    changed.parameters = policy.parameters.copy()
    changed.parameters[inputs * columns : (inputs + network.memory) * columns] = 0
    return changed


def measure(scale: float, runner: Runner, output: Path) -> None:
    """Watch the first training seed of every learner of ``LEARNERS``, and the control."""
    flocks, files = share_of(HELD_OUT, FLOCKS, scale), {name: (name, False) for name in LEARNERS}
    files[CONTROL] = (LEARNERS[-1], True)
    jobs = {}
    for name, (learner, forgets) in files.items():
        content = (BOARD / learner / "policies" / f"{TASK}-0.npz").read_bytes()
        jobs[name] = split(style, content, forgets, flocks=flocks, size=50, seconds=0.1)
    found = runner.run(jobs, "Styles")
    lost = found[LEARNERS[-1]]["objective"] - found[CONTROL]["objective"]
    rows = {name: {key: mean(each) for key, each in columns.items()} for name, columns in found.items()}
    write_text(output / STYLES_FILE, document({"rows": rows, "memory": mean(lost)}))


class Styles(msgspec.Struct, frozen=True):
    """What ``style`` returns, by policy, and the paired worth of the memory of the gradient's policy in m."""

    rows: dict[str, dict[str, Estimate]]
    memory: Estimate


def styles(output: Path) -> Styles:
    """Read the measurement."""
    return msgspec.json.decode((output / STYLES_FILE).read_bytes(), type=Styles)
