"""Policies that are trained in a world in which the headline policy loses, by the same learner."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from training.config import Args
from training.presets import presets
from training.record import POLICY_FILE
from training.runs import RunFolders, run_job

from flockesc_env import FlockScenario
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, run
from flockesc_env.scenario.presets import PRESETS
from studies.findings.results import Study
from studies.robustness.plan import NEIGHBORS, grid_of

RETRAINED = "retrained"
"""Folder of the policies, with their episodes."""

TRAINING_SEED = 0
"""Seed of the only training run of a pair."""

Pair = tuple[str, str]
"""Setting and world."""

_TOO_SLOW: set[Pair] = {("shared", "reynolds")}
"""Pairs whose training takes more than an hour: imitation plays many copies of each flock."""


def chosen_pairs(
    losses: Sequence[Pair],
    studies: Mapping[str, Study],
    scenarios: Mapping[str, FlockScenario],
    minutes: float,
) -> list[Pair]:
    """Return the pairs that are trained: in the given order, until the estimated minutes are spent.

    An estimate is the median time of the setting's own runs. Worlds where agents count neighbors, those
    with more agents than the paper's flock and a few other pairs take too long; they are left out.
    """
    chosen, spent = [], 0.0
    for setting, world in losses:
        scenario, study = scenarios[world], studies[setting]
        if (setting, world) in _TOO_SLOW or grid_of(scenario) is NEIGHBORS:
            continue
        if scenario.num_agents > FlockScenario().num_agents:
            continue
        runs = study.runs.filter(learner=study.explained or study.best_learner)
        spent += float(runs["minutes"].median())  # type: ignore[arg-type]  # a column of floats
        if spent > minutes:
            break
        chosen.append((setting, world))
    return chosen


def train_there(
    pairs: Sequence[Pair],
    studies: Mapping[str, Study],
    scenarios: Mapping[str, FlockScenario],
    runs: Path,
    backend: Backend,
) -> dict[Pair, bytes]:
    """Train the learner of each headline policy in the world of its loss; return the policy files.

    Finished runs in the folder ``runs`` are used, and unfinished ones continued.
    """
    args = [_args(studies[setting], world, scenarios[world], runs) for setting, world in pairs]
    run([run_job(one) for one in args], RunFolders(runs), backend, title="Training runs in other worlds")
    return {pair: (one.run / POLICY_FILE).read_bytes() for pair, one in zip(pairs, args, strict=True)}


def file_name(setting: str, world: str) -> str:
    """Return the name of a policy file or folder without spaces or punctuation."""
    return f"{setting}-in-{re.sub(r'[^a-z0-9]+', '-', world)}"


def _args(study: Study, world: str, scenario: FlockScenario, runs: Path) -> Args:
    learner = presets()[study.setting].learners[study.explained or study.best_learner]
    name = file_name(study.setting, world)
    if world not in PRESETS:
        runs.mkdir(parents=True, exist_ok=True)
        write_text(runs / f"{name}.toml", scenario.to_toml())
    source = world if world in PRESETS else str((runs / f"{name}.toml").absolute())
    return dataclasses.replace(learner.args, scenario=source, run=runs / name, seed=TRAINING_SEED)
