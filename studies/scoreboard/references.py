"""References: what could be reached with knowledge that no policy has, flock by flock.

Every reference is a job that takes the names of a task and of one of its scenarios.
"""

import math
from typing import Any

import numpy as np
from cmaes import CMA

from flockesc_env import FlockEscapeEnv, FlockScenario, InputError, rollout, tasks
from flockesc_env.common.stats import FloatArray
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.jobs import Arrays
from flockesc_env.policies import BestCandidate
from flockesc_env.scenario import ConstantVelocity, RandomApproach
from training.cma import maximize

NUM_SEGMENTS, SEGMENT_STEPS = 12, 12
"""Ranges of a clairvoyant schedule, and model steps for which each is held. The last one lasts to the end."""

_CANDIDATES = (0, 3, 5, 7, 10, 13, 16, 20, 25, 30, 40, 50, 60, 70, 85, 100)
"""Candidate ranges of the informed greedy rule in m: 15, and 0."""

_CONSTANTS, _POPULATION, _GENERATIONS, _STEP_SIZE = 24, 12, 60, 0.5
"""Constant ranges that the search for a schedule tries first, and the parameters of CMA-ES."""


def clairvoyant(task: str, scenario: str, flocks: range) -> Arrays:
    """Return the objective under the best schedule of ranges that a search finds for each flock.

    CMA-ES starts at the flock's best constant range and plays schedules on the flock itself, in the true
    simulator. A schedule knows what no policy knows: how hundreds of episodes of this very flock ended. The
    best schedule is at least as good, because a search need not find it.
    """
    return {"objective": np.array([_search(task, scenario, flock) for flock in flocks])}


def _search(task: str, scenario: str, flock: int) -> float:
    """Return the objective of the best schedule found for a flock.

    The search varies numbers x in [0, 1]; the ranges are x^2 ``max_range``.
    """
    schedules = np.repeat(np.linspace(0, 1, _CONSTANTS)[:, np.newaxis], NUM_SEGMENTS, axis=1)
    values = _Replays(task, scenario, flock, _CONSTANTS).objectives(schedules)
    start, best = schedules[values.argmax()], values.max()
    bounds = np.array([[0.0, 1.0]] * NUM_SEGMENTS)
    optimizer = CMA(start, _STEP_SIZE, bounds=bounds, population_size=_POPULATION, seed=flock)
    replays = _Replays(task, scenario, flock, _POPULATION)
    for _ in range(_GENERATIONS):
        best = max(best, maximize(optimizer, replays.objectives).max())
    return float(best)


class _Replays:
    """Copies of one flock, which play schedules."""

    def __init__(self, task: str, scenario: str, flock: int, count: int) -> None:
        self._model, self._column = _flock(task, scenario), tasks[task].spec.name
        self._max_range = float(tasks[task].options["max_range"])
        held: Any = {"max_range": self._max_range, "steps_per_action": SEGMENT_STEPS, "action_mode": "range"}
        self._copies = BatchVectorEnv(count, self._model, autoreset_mode="Disabled", **held)
        self._copies.reset(seed=[flock] * count)
        self._start = self._copies.get_state(0)

    def objectives(self, schedules: FloatArray) -> FloatArray:
        """Return the objective of each schedule, shape (count, NUM_SEGMENTS)."""
        self._copies.set_state(self._start)
        ranges = self._max_range * schedules**2
        for segment in range(-(-self._model.num_steps // SEGMENT_STEPS)):
            *_, infos = self._copies.step(ranges[:, [min(segment, NUM_SEGMENTS - 1)]])
        values: FloatArray = infos[self._column]
        return values


def informed_greedy(task: str, scenario: str, flocks: range) -> Arrays:
    """Return the objective of agents that take the best of 15 ranges by one number, at every step.

    J_mean: the range whose heard velocity points nearest to the agent's escape direction. J_min: the one
    whose heard heading keeps the predator farthest away. The agents know what few policies know: what they
    would hear under each range, and where the predator is, at any distance. They do not look ahead.
    """
    is_mean = tasks[task].spec.name == "min_mean_distance"
    options: Any = {
        "profile_ranges": tuple(map(float, _CANDIDATES)),
        "extra_entries": ("escape_direction" if is_mean else "closest_approach",),
        "predator_sensing_range": math.inf,
        "max_range": float(max(_CANDIDATES)),
        "steps_per_action": 1,
    }
    policy = BestCandidate("escape_cosine" if is_mean else "closest_approach")
    model = _flock(task, scenario)
    episodes = rollout(model, policy, flocks, per_agent=True, num_threads=1, **options)
    return {"objective": tasks[task].spec.values(episodes)}


def free_headings(task: str, scenario: str, flocks: range) -> Arrays:
    """Return an upper bound of the objective on each flock, under any ranges, neighbors and forces.

    Agent i flies at most v0 t in a time t. With its start r_i(0) and the place r_p(t) of a predator that
    flies straight on, d_i(t) <= g_i(t) = ||r_i(0) - r_p(t)|| + v0 t. Hence

        J_mean <= min over t of mean over i of g_i(t),    J_min <= min over i and t of g_i(t)

    Both are rigorous, and no smaller bounds follow from the starts alone. In continuous time and with one
    predator, agents reach them if they choose their heading at the start and then fly straight: away from
    the predator's place at the time that minimizes the mean of g_i (J_mean), or their own g_i (J_min). Each
    g_i is convex, and where it is smallest the distance of such an agent does not change, so that this is
    its closest approach.

    The agents of the bound turn at once.
    """
    model = _flock(task, scenario)
    if not is_bounded(model):
        raise InputError("scenario", "predators that fly straight on and a constant speed", scenario)
    env, is_mean = FlockEscapeEnv(model), tasks[task].spec.name == "min_mean_distance"
    times, bounds = np.arange(model.num_steps + 1) * model.time_step, []
    for seed in flocks:
        env.reset(seed=seed)
        flock = env.flock
        flown = times[:, np.newaxis] * flock.predator_velocities[:, np.newaxis]
        paths = flock.predator_positions[:, np.newaxis] + flown
        offsets = flock.positions[:, np.newaxis, np.newaxis] - paths  # (agents, predators, times, D)
        nearest = np.linalg.norm(offsets, axis=-1).min(axis=1)
        farthest = nearest + np.linalg.norm(flock.velocities, axis=1)[:, np.newaxis] * times
        bounds.append((farthest.mean(axis=0) if is_mean else farthest).min())
    return {"objective": np.array(bounds)}


def is_bounded(model: FlockScenario) -> bool:
    """Return whether free headings are a bound: constant speed, straight predators, no captures.

    Only the start of predators may be random.
    """
    straight = all(isinstance(predator, ConstantVelocity) for predator in model.predators)
    fixed = model.constant_speed and model.capture_radius is None
    starts = all(isinstance(drawn, RandomApproach) for drawn in model.randomization)
    return straight and fixed and starts and bool(model.predators)


def _flock(task: str, scenario: str) -> FlockScenario:
    model = tasks[task].scenarios[scenario]
    if not isinstance(model, FlockScenario):
        raise InputError("scenario", "a flock", scenario)
    return model
