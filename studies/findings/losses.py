"""Where learning loses: headline policies in other starts, presets and sizes than those of their training."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Final

import polars as pl
from scipy.optimize import brentq

from flockesc_env import FlockScenario, InputError
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.scenario import AlignedHeadings, ConstantVelocity, approach
from studies.findings.headlines import Headline
from studies.measurements import Runner, play_jobs, share_of, values_by
from studies.robustness.plan import NEIGHBORS, attacked_presets, grid_of

STARTS_FILE: Final = "starts.parquet"
TRANSFER_FILE: Final = "transfer.parquet"

FLOCKS: Final = 50
"""Held-out flocks of a scenario; a start has twice as many."""

POLARIZATIONS: Final = (0.47, 0.85, 0.96, 0.99)
"""Expected initial polarization of an infinite flock."""

ATTACKS: Final = {"across": (1.0, -1.0), "toward": (-1.0, -1.0)}
"""Mean initial heading, by how it lies to the predator's path, which is the diagonal (1, 1)."""

SIZES: Final = (100, 1_000, 10_000)
"""Numbers of agents of the paper's flock in which policies are tried."""

_SLOW_SHARE, _LARGE_SHARE = 0.2, 0.06
"""Share of the flocks for agents that count neighbors, and for more than 1,000 agents."""


def starts() -> dict[str, FlockScenario]:
    """Return other starts of the paper's flock: polarization, direction of attack, speed and density."""
    faster = ConstantVelocity(*approach(speed=20 * math.sqrt(2)))
    return {
        "random headings": FlockScenario(),
        **{
            f"polarization {polarization:g}, {attack}": FlockScenario(
                initial_headings=AlignedHeadings(direction, max_angle(polarization))
            )
            for polarization in POLARIZATIONS
            for attack, direction in ATTACKS.items()
        },
        "predator twice as fast": FlockScenario(predators=(faster,)),
        "half the side": FlockScenario(initial_side=50.0),
    }


def max_angle(polarization: float) -> float:
    """Return the angle in rad within which headings are drawn.

    The mean of unit vectors that are uniform within the angle a of a direction has the length sin(a) / a.
    """
    return float(brentq(lambda angle: math.sin(angle) / angle - polarization, 1e-6, math.pi))


def scenarios() -> dict[str, FlockScenario]:
    """Return all presets of flocks with predators, and other sizes of the paper's flock."""
    return attacked_presets() | {f"n = {size:,}": FlockScenario(num_agents=size) for size in SIZES}


def can_run(headline: Headline, scenario: FlockScenario) -> bool:
    """Return whether a policy can run in a scenario: it can show all that the policy observes."""
    entry = headline.entry
    try:
        options = scenario.env_options(entry.all_options(scenario))
        FlockBatch(scenario, options, per_agent=bool(entry.per_agent))
    except InputError:
        return False
    return True


def measure(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play the headline policies in all scenarios, and those with the objective J_mean in all starts.

    The tables have the columns task, scenario, interaction_range (the best fixed range there), seed,
    objective, and fixed, the objective under that range.
    """
    started = [
        one
        for one in headlines
        if one.task.scenario == FlockScenario() and one.task.spec.name == "min_mean_distance"
    ]
    write_table(play(started, starts(), 2 * FLOCKS, scale, runner), output / STARTS_FILE)
    write_table(play(headlines, scenarios(), FLOCKS, scale, runner), output / TRANSFER_FILE)


def play(
    headlines: Sequence[Headline],
    tried: Mapping[str, FlockScenario],
    num_flocks: int,
    scale: float,
    runner: Runner,
) -> pl.DataFrame:
    """Play policies where they can run beside the best fixed range, which twice as many flocks choose.

    Agents that count neighbors have the grid of the robustness study. Slow scenarios have fewer flocks.
    """
    jobs: dict[tuple[str, str], list[Job]] = {}
    plans: dict[str, tuple[tuple[float, ...], range]] = {}
    for name, scenario in tried.items():
        is_counted = grid_of(scenario) is NEIGHBORS
        share = _LARGE_SHARE if scenario.num_agents > SIZES[1] else _SLOW_SHARE if is_counted else 1.0
        count, actions = (
            round(num_flocks * share),
            NEIGHBORS.actions if is_counted else FlockScenario.search_ranges,
        )
        flocks = share_of(HELD_OUT, count, scale)
        plans[name] = actions, flocks
        jobs["tuning", name] = seed_jobs(OUTCOMES, scenario, actions, share_of(TUNING, 2 * count, scale))
        jobs["held out", name] = seed_jobs(OUTCOMES, scenario, actions, flocks)
        for one in headlines:
            if can_run(one, scenario):
                jobs[one.task.name, name] = play_jobs(one.content, scenario, one.task.spec.name, flocks)
    found, tables = runner.run(jobs, "Other scenarios"), []
    for one, name in product(headlines, tried):
        if (one.task.name, name) in found:
            (actions, flocks), column = plans[name], one.task.spec.name
            best = int(found["tuning", name][column].mean(axis=1).argmax())
            labels = {"task": one.task.name, "scenario": name, "interaction_range": actions[best]}
            values = {**found[one.task.name, name], "fixed": found["held out", name][column][best]}
            tables.append(pl.DataFrame({**labels, "seed": flocks, **values}))
    return pl.concat(tables)


def gains(file: Path) -> dict[tuple[str, str], tuple[Estimate, float]]:
    """Return the paired gain over the best fixed range, and that range, by task and scenario."""
    table = pl.read_parquet(file).with_columns(gain=pl.col("objective") - pl.col("fixed"))
    gain, best = (
        values_by(table, "task", "scenario", column=column) for column in ("gain", "interaction_range")
    )
    return {key: (mean(values), float(best[key][0])) for key, values in gain.items()}


def unit_of(scenario: str) -> str:
    """Return the unit of the fixed ranges in a scenario."""
    known = scenarios().get(scenario)
    return "m" if known is None else grid_of(known).unit
