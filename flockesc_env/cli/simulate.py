"""The command ``flockesc simulate``: run a model once."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, ScenarioFlags, model_of, optional
from flockesc_env.cli.output import check_output, note, show, show_json
from flockesc_env.cli.policies import EXPECTED, policy_of
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, OBJECTIVES
from flockesc_env.models import records
from flockesc_env.models.simulate import LineTrajectory, Trajectory
from flockesc_env.policies.rollout import simulate
from flockesc_env.scenario.line import LineScenario

BEST_RANGE = 12.0
"""The best fixed range for J_mean in the paper's flock, in m (docs/scoreboard.md)."""

_MEANINGS = {
    **{spec.name: f"{spec.with_unit(spec.symbol)}: {spec.definition}" for spec in OBJECTIVES},
    "num_components": "number of connected components of the neighbor graph at the end",
    "polarization": "norm of the mean heading at the end, from 0 to 1",
    "converged": "whether the line reached its steady state",
    "steps": "number of steps",
}


def run(
    scenario: ScenarioFlags,
    policy: Annotated[
        Positional[str | None],
        arg(
            help=f"policy that sets the ranges: {EXPECTED}; of a line, fixed:RHO",
            metavar="[POLICY]",
            help_behavior_hint=f"(default: fixed:{BEST_RANGE:g}, the best fixed range of the paper's flock)",
        ),
    ] = None,
    *,
    seed: Annotated[
        int | None,
        *optional("seed of the initial state, from 0 to 2^64 - 1", "a random seed, which is printed"),
    ] = None,
    output: Annotated[
        Path | None, *optional("file (.npz) for the whole run; flockesc replay checks it", "none")
    ] = None,
    json: Json = False,
) -> Exit:
    """Run the model once.

    Prints the distances to the predator and the state at the end.

    The default scenario is the paper's flock of 300 agents.

    Example: flockesc simulate fixed:10 --seed 7 --output run.npz
    """
    check_output(output, [".npz"])
    chosen = scenario.build()
    if policy is None:
        if isinstance(chosen, LineScenario):
            raise InputError("policy", "fixed:RHO for a line", "none")
        policy = f"fixed:{BEST_RANGE:g}"
    trajectory = simulate(chosen, policy=policy_of(policy), seed=seed)
    outcome = _outcome(trajectory)
    document = {
        "command": "simulate",
        "model": model_of(chosen),
        "scenario": json_.loads(chosen.to_json()),
        "policy": policy,
        "seed": trajectory.seed,
        **outcome,
        "output": None if output is None else str(output),
        "versions": records.versions(),
    }
    try:
        if output is not None:
            records.save_run(trajectory, output, name=policy)
            note(f"saved: {output}; to check it, run flockesc replay {output}")
    finally:  # results are shown even if the file cannot be written
        if json:
            show_json(document)
        else:
            show(f"{chosen.num_agents} agents, {policy}, seed {trajectory.seed}")
            for entry, value in outcome.items():
                shown = f"{value:.3f}" if isinstance(value, float) else str(value)
                show(f"  {entry:<18} {shown:>8}  {_MEANINGS[entry]}")
    return Exit.DONE


def _outcome(run: Trajectory | LineTrajectory) -> dict[str, Any]:
    if isinstance(run, LineTrajectory):
        return {
            "escape_distance": float(run.escape_distance[-1]),
            "num_components": int(run.num_components[-1]),
            "converged": run.converged,
            "steps": run.steps,
        }
    return {
        **{spec.name: float(getattr(run, spec.series).min()) for spec in FLOCK_OBJECTIVES.values()},
        "num_components": int(run.num_components[-1]),
        "polarization": float(run.polarization[-1]),
    }
