"""Where learning loses: headline policies in other starts, presets and sizes than those of their training."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import polars as pl
from scipy.optimize import brentq

from flockesc_env import FlockScenario, InputError
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.policies.rollout import flock_batch
from flockesc_env.policies.setup import setup
from flockesc_env.scenario import AlignedHeadings, ConstantVelocity, approach
from studies.findings.headlines import Headline
from studies.measurements import Runner, play_jobs, share_of, values_by, write_rows
from studies.robustness import NEIGHBORS, attacked_presets, grid_of

STARTS_FILE: Final = "starts.parquet"
TRANSFER_FILE: Final = "transfer.parquet"

FLOCKS: Final = 50  # held-out flocks of a scenario; a start has twice as many
POLARIZATIONS: Final = (0.47, 0.85, 0.96, 0.99)  # expected initial polarization of an infinite flock

ATTACKS: Final = {"across": (1.0, -1.0), "toward": (-1.0, -1.0)}
"""Mean initial heading, by how it lies to the predator's path, which is the diagonal (1, 1)."""

SIZES: Final = (100, 1_000, 10_000)  # numbers of agents of the paper's flock in which policies are tried

_SLOW_SHARE, _LARGE_SHARE = 0.2, 0.06  # of the flocks if agents count neighbors, and for over 1,000 agents


def starts() -> dict[str, FlockScenario]:
    """Return other starts of the paper's flock: polarization, direction of attack, speed and density."""
    found = {"random headings": FlockScenario()}
    for polarization, (attack, direction) in product(POLARIZATIONS, ATTACKS.items()):
        # The mean of unit vectors that are uniform within the angle a of a direction has length sin(a) / a.
        largest = brentq(lambda a, mean: math.sin(a) / a - mean, 1e-6, math.pi, args=(polarization,))
        headings = AlignedHeadings(direction, float(largest))
        found[f"polarization {polarization:g}, {attack}"] = FlockScenario(initial_headings=headings)
    faster = ConstantVelocity(*approach(speed=20 * math.sqrt(2)))
    found["predator twice as fast"] = FlockScenario(predators=(faster,))
    found["half the side"] = FlockScenario(initial_side=50.0)
    return found


def scenarios() -> dict[str, FlockScenario]:
    """Return all presets of flocks with predators, and other sizes of the paper's flock."""
    return attacked_presets() | {f"n = {size:,}": FlockScenario(num_agents=size) for size in SIZES}


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
    write_rows(output / STARTS_FILE, play(started, starts(), 2 * FLOCKS, scale, runner))
    write_rows(output / TRANSFER_FILE, play(headlines, scenarios(), FLOCKS, scale, runner))


def play(
    headlines: Sequence[Headline],
    tried: Mapping[str, FlockScenario],
    num_flocks: int,
    scale: float,
    runner: Runner,
) -> list[dict[str, Any]]:
    """Play policies where they can run beside the best fixed range, which twice as many flocks choose.

    Agents that count neighbors have the grid of the robustness study. Slow scenarios have fewer flocks.
    """
    jobs: dict[tuple[str, str], list[Job]] = {}
    grids, held_out = {}, {}
    for name, scenario in tried.items():
        counts_neighbors = grid_of(scenario) is NEIGHBORS
        grids[name] = NEIGHBORS.actions if counts_neighbors else FlockScenario.search_ranges
        slow = _SLOW_SHARE if counts_neighbors else 1.0
        count = round(num_flocks * (_LARGE_SHARE if scenario.num_agents > SIZES[1] else slow))
        held_out[name] = share_of(HELD_OUT, count, scale)
        tuning = share_of(TUNING, 2 * count, scale)
        for purpose, flocks in {"tuning": tuning, "held out": held_out[name]}.items():
            jobs[purpose, name] = seed_jobs(OUTCOMES, scenario, grids[name], flocks)
        for one in headlines:
            with suppress(InputError):  # the scenario cannot show all that the policy observes
                flock_batch(setup(one.entry, scenario), num_flocks=1)
                key = one.task.name, name
                jobs[key] = play_jobs(one.content, scenario, one.task.spec.name, held_out[name])
    found, rows = runner.run(jobs, "Other scenarios"), []
    for one, name in product(headlines, tried):
        if (one.task.name, name) in found:
            objective = one.task.spec.name
            best = int(found["tuning", name][objective].mean(axis=1).argmax())
            labels = {"task": one.task.name, "scenario": name, "interaction_range": grids[name][best]}
            values = {**found[one.task.name, name], "fixed": found["held out", name][objective][best]}
            rows.append({**labels, "seed": held_out[name], **values})
    return rows


class Gain(NamedTuple):
    """A paired gain over the best fixed range of a scenario, and that range."""

    over_fixed: Estimate
    best_fixed_range: float


def gains(file: Path) -> dict[tuple[str, str], Gain]:
    """Return the gain of a headline policy by task and scenario."""
    table = pl.read_parquet(file).with_columns(gain=pl.col("objective") - pl.col("fixed"))
    gain = values_by(table, "task", "scenario", column="gain")
    best = values_by(table, "task", "scenario", column="interaction_range")
    return {key: Gain(mean(gain[key]), float(best[key][0])) for key in gain}


def unit_of(scenario: str) -> str:
    """Return the unit of the fixed ranges in a scenario."""
    known = scenarios().get(scenario)
    return "m" if known is None else grid_of(known).unit
