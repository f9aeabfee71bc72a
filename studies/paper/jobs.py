"""The paper's own measurements: curves of flocks, consensus of lines, flocks at their smallest distance."""

from typing import Any, Final

import numpy as np

from flockesc_env import FlockScenario, LineScenario, simulate, simulate_line
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays
from flockesc_env.models import Trajectory
from studies.measurements import by_name, means

STOPS: Final = (1.0, 2.0)  # times in s at which a control stops listening


def curves(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return distances and components of flocks at every time 0..T, shape (ranges, seeds, T + 1)."""
    return by_name([by_name([_curves_of(scenario, rho, seed) for seed in seeds]) for rho in ranges])


def _curves_of(scenario: FlockScenario, rho: float, seed: int) -> dict[str, Any]:
    run = simulate(scenario, rho, seed=seed)
    return {name: getattr(run, name) for name in ("mean_distance", "min_distance", "num_components")}


def consensus(scenario: LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the quantities of the theorems for every line.

    - ``final``: x_ss in rising order, with a last axis over agents;
    - ``mean_offset``: |mean of x_ss - mean of x(0)|;
    - ``alpha_offset``: largest |alpha_i - limit| over clusters, with alpha_i of Definition 1;
    - ``falls``: whether m(t) ever falls;
    - ``returns``: whether an agent is within the predator's range after the first step;
    - ``converged``.
    """
    return by_name([by_name([_consensus_of(scenario, rho, seed) for seed in seeds]) for rho in ranges])


def _consensus_of(scenario: LineScenario, rho: float, seed: int) -> dict[str, Any]:
    run = simulate_line(scenario, rho, seed=seed)
    components, last = run.num_components, run.states[-1]
    at_split = run.states[np.argmax(components == components[-1])]  # at t_c of Eq. 4
    order = np.argsort(last, kind="stable")
    clusters = np.split(order, np.flatnonzero(np.diff(last[order]) > rho) + 1)
    target, reach = scenario.predator_position, scenario.predator_range
    return {
        "final": last[order],
        "mean_offset": abs(last.mean() - run.states[0].mean()),
        "alpha_offset": max(abs(at_split[who].mean() - last[who].mean()) for who in clusters),
        "falls": bool((np.diff(components) < 0).any()),
        "returns": target is not None and bool((np.abs(run.states[1:] - target) < reach).any()),
        "converged": run.converged,
    }


def anatomy(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return quantities of flocks at the time t of the smallest mean distance, shape (ranges, seeds).

    Displacements are r_i(t) - r_i(0). Lengths are in m, times in s. Flights are J_mean of agents that fly
    straight at a constant velocity and do not interact.

    - ``mean_distance``: J_mean; ``time``: t;
    - ``center``: distance between predator and center of the flock; ``dispersion``: rms distance of the
      agents from that center; the squares of both add up to the mean squared distance;
    - ``polarization``; ``patch``: n times its square, the size of patches that all have random headings;
    - ``components``;
    - ``straightness``: rms displacement divided by v0 t, 1 if all agents fly straight on;
    - ``outwardness``: correlation between displacements and initial offsets from the center;
    - ``straightened``: flights from r_i(0) that end at r_i(t) at time t;
    - ``exchanged``: the same with displacements exchanged at random among the agents, so that they are as
      straight and as aligned, but not directed outward;
    - ``aligned``: flights from r_i(0) with speed v0 along the headings of time t, exchanged at random: the
      model that knows the polarization only;
    - ``stopped_1`` and ``stopped_2``: agents listen until 1 or 2 s and fly straight on from there.
    """
    return by_name([by_name([_anatomy_of(scenario, rho, seed) for seed in seeds]) for rho in ranges])


def _anatomy_of(scenario: FlockScenario, rho: float, seed: int) -> dict[str, float]:
    run = simulate(scenario, rho, seed=seed)
    speed = float(np.linalg.norm(run.velocities[0, 0]))
    step = int(np.argmin(run.mean_distance))
    time, positions = run.times[step], run.positions[step]
    center = positions.mean(axis=0)
    offsets = run.positions[0] - run.positions[0].mean(axis=0)
    moved = positions - run.positions[0]
    velocities = moved / time
    others = np.random.default_rng(run.seed).permutation(len(moved))
    headings = run.velocities[step] / np.linalg.norm(run.velocities[step], axis=1, keepdims=True)
    polarization = float(run.polarization[step])
    found = {
        "mean_distance": float(run.mean_distance[step]),
        "time": float(time),
        "center": float(np.linalg.norm(center - run.predator_positions[step, 0])),
        "dispersion": _rms(positions - center),
        "polarization": polarization,
        "patch": len(moved) * polarization**2,
        "components": float(run.num_components[step]),
        "straightness": _rms(moved) / (speed * float(time)),
        "outwardness": float((offsets * moved).sum(axis=1).mean()) / (_rms(offsets) * _rms(moved)),
        "straightened": _flight(run, velocities),
        "exchanged": _flight(run, velocities[others]),
        "aligned": _flight(run, speed * headings[others]),
    }
    for stop in STOPS:
        last = round(stop / run.scenario.time_step)
        found[f"stopped_{stop:g}"] = _flight(run, run.velocities[last], last)
    return found


def _flight(run: Trajectory, velocities: FloatArray, start: int = 0) -> float:
    """Return J_mean in m of agents that leave the run at a step and keep these velocities, shape (n, D)."""
    elapsed = (run.times[start:] - run.times[start])[:, np.newaxis, np.newaxis]
    paths = run.positions[start] + elapsed * velocities - run.predator_positions[start:]
    flown = np.linalg.norm(paths, axis=2).mean(axis=1)
    return float(min(flown.min(), run.mean_distance[: start + 1].min()))


def _rms(vectors: FloatArray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))


def with_parts(found: Arrays) -> dict[str, FloatArray]:
    """Return the columns of ``anatomy`` with the parts of J_mean, in m, shape (ranges, flocks).

    Three parts add up to the ``gain``, J_mean minus that under the first range:

    - ``agreement``: headings agree, so the flock drifts one way (``aligned`` minus J_mean of the first
      range);
    - ``turning``: paths bend (``exchanged`` minus ``aligned``);
    - ``sorting``: agents fly outward (J_mean minus ``exchanged``).

    ``error`` is that of the model that knows the polarization only.
    """
    reached = found["mean_distance"]
    return found | {
        "agreement": found["aligned"] - reached[0],
        "turning": found["exchanged"] - found["aligned"],
        "sorting": reached - found["exchanged"],
        "gain": reached - reached[0],
        "error": found["aligned"] - reached,
    }


def anatomy_table(found: Arrays) -> dict[str, tuple[Estimate, ...]]:
    """Return the mean over flocks of every column of ``with_parts``, one per range."""
    return {name: means(rows) for name, rows in with_parts(found).items()}
