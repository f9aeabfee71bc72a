"""References: what could be reached with knowledge that no policy has, flock by flock.

- ``planner``: a ``Planner`` reads the whole state and simulates the future of every choice.
- ``clairvoyant``: a schedule of ranges that was optimized on the flock itself, in the true simulator.
- ``informed_greedy``: a rule for agents that know at every step what each of 15 ranges would bring.
- ``free_headings``: an upper bound for agents that can head anywhere at any time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
from cmaes import CMA

from flockesc_env import (
    ArgumentError,
    ConstantVelocity,
    FlockEscapeEnv,
    FlockScenario,
    FlockVectorEnv,
    rollout,
)
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import BestCandidate, Planner
from studies.findings.information import CANDIDATES
from studies.findings.names import CLAIRVOYANT, FREE_HEADINGS, INFORMED_GREEDY, PLANNER
from studies.findings.results import REFERENCES_FILE
from studies.measurements import Runner, chunks
from studies.tables import rows
from training.cma import maximize
from training.config import Setting

SIMULATED_FLOCKS = 200
"""Held-out flocks of the references that simulate each flock many times."""

PLANNED_STEPS = 12
"""Model steps between two choices of the planner."""

NUM_SEGMENTS, SEGMENT_STEPS = 12, 12
"""Ranges of a clairvoyant schedule, and model steps for which each is held. The last one lasts to the end."""

_CONSTANTS, _POPULATION, _GENERATIONS, _STEP_SIZE = 24, 12, 60, 0.5
"""Constant ranges that the search for a schedule tries first, and the parameters of CMA-ES."""

_AGENT_STEP = 30e-9
_PLANNED, _OPTIMIZED, _INFORMED = 500, _CONSTANTS + _POPULATION * _GENERATIONS, 20
"""Estimated seconds of a step of one agent, and steps of a reference per step of an episode."""


def write_references(setting: Setting, flocks: range, runner: Runner, folder: Path) -> Path | None:
    """Compute the references of a setting and write their file; return its path, or ``None`` without any."""
    found = runner.groups(reference_jobs(setting, flocks), "References")
    if not found:
        return None
    values = {name: result["objective"] for name, result in found.items()}
    folder.mkdir(parents=True, exist_ok=True)
    tables = [rows(flocks[: len(row)], row, reference=name) for name, row in values.items()]
    write_table(pl.concat(tables), folder / REFERENCES_FILE)
    return folder / REFERENCES_FILE


def reference_jobs(setting: Setting, flocks: range) -> dict[str, list[Job]]:
    """Return the jobs of the references that make sense in a setting, by the reference's name.

    The planner and the clairvoyant schedule set one range for the flock; they use the first
    ``SIMULATED_FLOCKS`` flocks. The informed greedy rule and free headings are for settings with one range
    per agent; free headings need predators that fly straight on. A line and ``Learned`` predators, whose
    policy is not in the setting, have none.
    References do not depend on observations, so those of one range with a profile are those without it.
    """
    model = setting.model
    if not isinstance(model, FlockScenario) or model.num_learned:
        return {}
    if not setting.per_agent and setting.profile_ranges:
        return {}
    if not setting.per_agent:
        few = chunks(flocks[:SIMULATED_FLOCKS], 5)
        return {
            PLANNER: [_job("planner", setting, chunk, _PLANNED) for chunk in few],
            CLAIRVOYANT: [_job("clairvoyant", setting, chunk, _OPTIMIZED) for chunk in few],
        }
    # The same for all settings with the same flocks, so that each is computed once.
    task = Setting(scenario=setting.scenario, objective=setting.objective)
    jobs = {INFORMED_GREEDY: [_job("informed_greedy", task, part, _INFORMED) for part in chunks(flocks, 100)]}
    return jobs | ({FREE_HEADINGS: [_job("free_headings", setting, flocks, 1)]} if is_bounded(model) else {})


def _job(function: str, setting: Setting, flocks: range, episodes: int) -> Job:
    model = _flock(setting)
    seconds = len(flocks) * episodes * model.num_steps * model.num_agents * _AGENT_STEP
    return Job(f"{__name__}:{function}", (setting, flocks), seconds)


def planner(setting: Setting, flocks: range) -> Arrays:
    """Return the objective that ``Planner`` reaches on each flock, with the actions of the setting.

    The planner knows what no policy knows: positions and velocities of all agents and predators, and what
    each of its choices leads to until the end of the episode.
    """
    chooser = Planner(_flock(setting), steps=PLANNED_STEPS, **setting.env_options())
    return {"objective": np.array([chooser.play(flock).objective for flock in flocks])}


def clairvoyant(setting: Setting, flocks: range) -> Arrays:
    """Return the objective under the best schedule of ranges that a search finds for each flock.

    CMA-ES starts at the flock's best constant range and plays schedules on the flock itself, in the true
    simulator. A schedule knows what no policy knows: how hundreds of episodes of this very flock ended. The
    best schedule is at least as good, because a search need not find it.
    """
    return {"objective": np.array([_search(setting, flock) for flock in flocks])}


def _search(setting: Setting, flock: int) -> float:
    """Return the objective of the best schedule found for a flock.

    The search varies numbers x in [0, 1]; the ranges are x^2 ``max_range``.
    """
    constants = np.linspace(0, 1, _CONSTANTS)
    schedules = np.repeat(constants[:, np.newaxis], NUM_SEGMENTS, axis=1)
    values = _Replays(setting, flock, _CONSTANTS).objectives(schedules)
    start, best = schedules[values.argmax()], values.max()
    bounds = np.array([[0.0, 1.0]] * NUM_SEGMENTS)
    optimizer = CMA(start, _STEP_SIZE, bounds=bounds, population_size=_POPULATION, seed=flock)
    replays = _Replays(setting, flock, _POPULATION)
    for _ in range(_GENERATIONS):
        best = max(best, maximize(optimizer, replays.objectives).max())
    return float(best)


class _Replays:
    """Copies of one flock, which play schedules."""

    def __init__(self, setting: Setting, flock: int, count: int) -> None:
        self._setting = setting
        self._copies = FlockVectorEnv(
            count,
            _flock(setting),
            autoreset_mode="Disabled",
            action_mode="range",
            max_range=setting.max_range,
            steps_per_action=SEGMENT_STEPS,
        )
        self._copies.reset(seed=[flock] * count)
        self._start = self._copies.get_state(0)

    def objectives(self, schedules: FloatArray) -> FloatArray:
        """Return the objective of each schedule, shape (count, NUM_SEGMENTS)."""
        self._copies.set_state(self._start)
        ranges = self._setting.max_range * schedules**2
        for segment in range(-(-_flock(self._setting).num_steps // SEGMENT_STEPS)):
            *_, infos = self._copies.step(ranges[:, [min(segment, NUM_SEGMENTS - 1)]])
        values: FloatArray = infos[self._setting.spec.column]
        return values


def informed_greedy(setting: Setting, flocks: range) -> Arrays:
    """Return the objective of agents that take the best of 15 ranges by one number, at every step.

    J_mean: the range whose heard velocity points nearest to the agent's escape direction. J_min: the one
    whose heard heading keeps the predator farthest away. The agents know what few policies know: what they
    would hear under each range, and where the predator is, at any distance. They do not look ahead.
    """
    is_mean = setting.objective == "mean"
    episodes = rollout(
        _flock(setting),
        BestCandidate("escape_cosine" if is_mean else "closest_approach"),
        flocks,
        per_agent=True,
        num_threads=1,
        profile_ranges=(0.0, *CANDIDATES[15]),
        extra_entries=("escape_direction" if is_mean else "closest_approach",),
        predator_sensing_range=None,
        max_range=max(CANDIDATES[15]),
    )
    return {"objective": setting.spec.values(episodes)}


def free_headings(setting: Setting, flocks: range) -> Arrays:
    """Return an upper bound of the objective on each flock, under any ranges, neighbors and forces.

    Agent i flies at most v0 t in a time t. With its start r_i(0) and the place r_p(t) of a predator that
    flies straight on, d_i(t) <= g_i(t) = ||r_i(0) - r_p(t)|| + v0 t. Hence

        J_mean <= min over t of mean over i of g_i(t),    J_min <= min over i and t of g_i(t)

    Both are rigorous, and no smaller bounds follow from the starts alone. In continuous time and with one
    predator, agents reach them if they choose their heading at the start and then fly straight: away from
    the predator's place at the time that minimizes the mean of g_i (J_mean), or their own g_i (J_min). Each
    g_i is convex, and where it is smallest the distance of such an agent does not change, so that this is
    its closest approach.

    The agents of the bound know what no agent knows: where the predator will be. They also turn at once.
    """
    model = _flock(setting)
    if not is_bounded(model):
        raise ArgumentError(
            "setting", "predators that fly straight on and a constant speed", setting.scenario
        )
    env = FlockEscapeEnv(model)
    return {"objective": np.array([_bound(env, setting.objective, flock) for flock in flocks])}


def _bound(env: FlockEscapeEnv, objective: str, flock: int) -> float:
    env.reset(seed=flock)
    times = np.arange(env.scenario.num_steps + 1) * env.scenario.time_step
    state = env.flock
    flown = times[:, np.newaxis] * state.predator_velocities[:, np.newaxis]
    paths = state.predator_positions[:, np.newaxis] + flown
    offsets = state.positions[:, np.newaxis, np.newaxis] - paths  # (agents, predators, times, D)
    nearest = np.linalg.norm(offsets, axis=-1).min(axis=1)
    speeds = np.linalg.norm(state.velocities, axis=1)
    farthest = nearest + speeds[:, np.newaxis] * times
    return float((farthest.mean(axis=0) if objective == "mean" else farthest).min())


def is_bounded(model: FlockScenario) -> bool:
    """Return whether free headings are a bound: constant speed, straight predators, no captures."""
    straight = all(isinstance(predator, ConstantVelocity) for predator in model.predators)
    fixed = model.constant_speed and model.capture_radius is None and not model.randomization
    return straight and fixed and bool(model.predators)


def _flock(setting: Setting) -> FlockScenario:
    model = setting.model
    if not isinstance(model, FlockScenario):
        raise ArgumentError("setting", "a flock", setting.scenario)
    return model
