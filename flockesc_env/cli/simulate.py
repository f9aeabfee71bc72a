"""The command ``flockesc simulate``: run a model once."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated, Any

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, ScenarioFlags, model_of, optional
from flockesc_env.cli.output import check_output, note, show, show_json
from flockesc_env.cli.policies import EXPECTED, policy_of
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, OBJECTIVES
from flockesc_env.episodes.seeds import fresh_seed
from flockesc_env.models import records
from flockesc_env.models.simulate import LineTrajectory, Trajectory, simulate
from flockesc_env.scenario.flock import FlockScenario
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
    *,
    interaction_range: Annotated[
        float | None,
        *optional(
            "fixed interaction range rho, in m for a flock; give this or a policy",
            f"for a flock {BEST_RANGE:g}, the best fixed range of the paper's flock",
        ),
    ] = None,
    policy: Annotated[str | None, *optional(f"policy that sets the ranges: {EXPECTED}", "none")] = None,
    seed: Annotated[
        int | None,
        *optional("seed of the initial state, from 0 to 2^64 - 1", "a random seed, which is printed"),
    ] = None,
    output: Annotated[
        Path | None, *optional("file (.npz) for the whole run; flockesc replay checks it", "none")
    ] = None,
    json: Json = False,
) -> Exit:
    """Run the model once, with a fixed interaction range or a policy.

    Prints the distances to the predator and the state at the end.

    The default scenario is the paper's flock of 300 agents.

    Example: flockesc simulate --interaction-range 10 --seed 7 --output run.npz
    """
    check_output(output, [".npz"])
    chosen = scenario.build()
    if interaction_range is not None and policy is not None:
        raise InputError("interaction_range", "either interaction_range or policy", "both")
    if interaction_range is None and policy is None:
        if isinstance(chosen, LineScenario):
            raise InputError("interaction_range", "a range for a line", "none")
        interaction_range = BEST_RANGE
    trajectory = _run(chosen, interaction_range, policy, seed)
    name = policy or f"range {interaction_range:g}"
    outcome = _outcome(trajectory)
    document = {
        "command": "simulate",
        "model": model_of(chosen),
        "scenario": json_.loads(chosen.to_json()),
        "interaction_range": interaction_range,
        "policy": policy,
        "seed": trajectory.seed,
        **outcome,
        "output": None if output is None else str(output),
        "versions": records.versions(),
    }
    try:
        if output is not None:
            records.save_run(trajectory, output, name=name)
            note(f"saved: {output}; to check it, run flockesc replay {output}")
    finally:  # results are shown even if the file cannot be written
        if json:
            show_json(document)
        else:
            show(f"{chosen.num_agents} agents, {name}, seed {trajectory.seed}")
            for entry, value in outcome.items():
                shown = f"{value:.3f}" if isinstance(value, float) else str(value)
                show(f"  {entry:<18} {shown:>8}  {_MEANINGS[entry]}")
    return Exit.DONE


def _run(
    scenario: FlockScenario | LineScenario, rho: float | None, policy: str | None, seed: int | None
) -> Trajectory | LineTrajectory:
    if policy is not None:
        if isinstance(scenario, LineScenario):
            raise InputError("policy", "None for a line", repr(policy))
        return policy_of(policy, "policy").record(fresh_seed() if seed is None else seed, scenario)
    assert rho is not None  # noqa: S101, for the type checker
    return simulate(scenario, rho, seed=seed)


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
