"""The planner finds the best of all branches, of constant ranges too, and keeps its promises."""

from typing import Any

import numpy as np
import pytest
from option_table import doomed, hunted, small_flock

import flockesc_env as fe
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.policies import Planner, Pursue
from flockesc_env.scenario import Wandering

FLOCK = small_flock(num_agents=20, num_steps=30, predator_range=15.0)
RANGES, FUTURES = [0.0, 3.0, 6.0, 9.0, 14.0], [0.0, 6.0, 20.0]
NOISY = FLOCK.replace(angular_noise=1.0, predators=(Wandering(angular_diffusion=2.0),))
LEARNED = FLOCK.with_learned_predators()
CASES: list[tuple[fe.FlockScenario, dict[str, Any]]] = [
    (FLOCK, {}),
    (FLOCK, {"objective": "min_min_distance", "action_mode": "range"}),
    (NOISY, {"objective": "min_min_distance"}),
    (LEARNED, {"predator_policy": Pursue()}),
    (hunted(), {"objective": "fraction_surviving"}),
    (doomed(), {"objective": "min_mean_distance"}),
]
SEEDS = [3, 4, 5]


def value_of(env: fe.FlockEscapeEnv, actions: list[Any]) -> float:
    """Apply actions, the last one to the end of the episode, and return the objective."""
    has_ended = False
    while not has_ended:
        _, _, terminated, truncated, info = env.step(actions[0])
        actions = actions[1:] or actions
        has_ended = terminated or truncated
    return float(info[FLOCK_OBJECTIVES[env.options.objective].name])


def best_value(env: fe.FlockEscapeEnv, planner: Planner, holds: int) -> float:
    """Return the largest objective over all branches, which are played one by one."""
    actions = env.policy_spec.actions
    start, values = env.get_state(), []
    chosen = [(first, future) for first in planner.ranges for future in planner.futures]
    chosen += [(future, future) for future in planner.futures]
    for pair in chosen:
        first, future = actions.from_ranges(np.array(pair))
        env.set_state(start)
        values.append(value_of(env, [first] * holds + [future]))
    env.set_state(start)
    return max(values)


@pytest.mark.parametrize(("scenario", "arguments"), CASES)
def test_every_choice_is_the_best_of_all_branches_and_is_kept(
    scenario: fe.FlockScenario, arguments: dict[str, Any]
) -> None:
    env = fe.FlockEscapeEnv(scenario, steps_per_action=2, **arguments)
    planner = Planner(scenario, ranges=RANGES, futures=FUTURES, steps=6, steps_per_action=2, **arguments)
    for seed in SEEDS:
        played = planner.play(seed)
        env.reset(seed=seed)
        has_ended, plans = False, []
        while not has_ended:
            before = env.get_state()
            plan = planner.plan(env)
            assert env.get_state() == before
            assert plan.value == best_value(env, planner, 3)
            plans.append(plan)
            for _ in range(3):
                _, _, terminated, truncated, info = env.step(plan.action)
                has_ended = terminated or truncated
                if has_ended:
                    break
        reached = info[FLOCK_OBJECTIVES[env.options.objective].name]
        assert [plan.value for plan in plans] == sorted(plan.value for plan in plans)
        assert plans[-1].value == reached == played.objective
        assert [plan.interaction_range for plan in plans] == [plan.interaction_range for plan in played.plans]


def test_the_candidates_span_the_ranges_of_the_actions() -> None:
    planner = Planner(FLOCK, max_range=20.0)
    assert (len(planner.ranges), len(planner.futures)) == (15, 10)
    assert set(planner.futures) <= set(planner.ranges)
    assert (planner.ranges.min(), planner.ranges.max()) == (0.0, 20.0)
