"""References of the scoreboard, and gains of half of the agents over the others, against loops and bounds."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import flockesc_env as fe
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.scenario import PurePursuit
from flockesc_env.scenario.predators import approach
from flockesc_env.taskset import Task, tasks
from studies.scoreboard import references
from studies.scoreboard.references import clairvoyant, free_headings, informed_greedy, is_bounded
from studies.scoreboard.rewards import gains, pairs_of

TASKS = {"min_mean_distance": "per-agent-visible", "min_min_distance": "per-agent-visible-minimum"}
SMALL = fe.FlockScenario(num_agents=12, num_steps=36, initial_side=30.0)
PAPER = "paper-flock"


@pytest.mark.parametrize("objective", TASKS)
@pytest.mark.parametrize("policy", ["fixed:0", "fixed:10", "stubborn-leaders", "stubborn-witnesses"])
def test_free_headings_bound_every_policy(objective: Any, policy: str) -> None:
    task, flocks = tasks[TASKS[objective]], TUNING[:10]
    reached = task.spec.values(fe.rollout(PAPER, policy, flocks))
    assert (reached <= free_headings(task.name, PAPER, flocks)["objective"]).all()


@pytest.mark.parametrize("objective", TASKS)
def test_straight_flights_reach_the_bound_of_free_headings(objective: Any) -> None:
    """Except for the length of a step, if agents fly away from the predator's place at the best time."""
    model, flocks = fe.FlockScenario(), TUNING[:10]
    (predator,) = model.predators
    place, velocity = np.array(predator.position), np.array(predator.velocity)
    faster = np.linalg.norm(velocity)
    for flock, bound in zip(flocks, free_headings(TASKS[objective], PAPER, flocks)["objective"], strict=True):
        start = fe.simulate(model, 0.0, seed=flock).positions[0]

        def farthest(times: Any, start: np.ndarray = start) -> np.ndarray:
            return np.linalg.norm(start - place - np.outer(times, velocity), axis=1) + 10 * times

        if objective == "min_mean_distance":
            best = minimize_scalar(lambda t: farthest(t).mean(), bounds=(0, 12), options={"xatol": 1e-9}).x
            exact = farthest(best).mean()
        else:  # the agent is then seen from the predator at the angle arccos(v0 / v_p)
            ahead = (start - place) @ velocity / faster
            aside = np.abs((start - place) @ [velocity[1], -velocity[0]]) / faster
            best = np.clip((ahead - aside * 10 / np.sqrt(faster**2 - 10**2)) / faster, 0, 12)
            exact = farthest(best).min()
        away = start - place - np.outer(best, velocity)
        headings = away / np.linalg.norm(away, axis=1, keepdims=True)
        times = np.arange(model.num_steps + 1) * model.time_step
        closing = np.multiply.outer(times, 10 * headings - velocity)
        distances = np.linalg.norm(start - place + closing, axis=2)
        reached = (distances.mean(axis=1) if objective == "min_mean_distance" else distances).min()
        assert exact - 1e-6 < reached < bound + 1e-6 < exact + 0.6


@pytest.mark.parametrize("objective", TASKS)
def test_the_informed_greedy_rule_stays_below_the_bound_and_above_eight_candidates(objective: Any) -> None:
    name, flocks = TASKS[objective], TUNING[:10]
    reached = informed_greedy(name, PAPER, flocks)["objective"]
    assert (reached <= free_headings(name, PAPER, flocks)["objective"]).all()
    rule = fe.load_policy("turn-away" if objective == "min_mean_distance" else "keep-distance")
    assert reached.mean() > tasks[name].spec.values(fe.rollout(PAPER, rule, flocks)).mean()


def test_free_headings_need_straight_predators_and_a_constant_speed() -> None:
    for change in ({"constant_speed": False}, {"capture_radius": 1.0}, {"predators": ()}):
        assert not is_bounded(SMALL.replace(**change))
    assert not is_bounded(SMALL.replace(predators=(PurePursuit(*approach("center")),)))
    assert is_bounded(SMALL)
    with pytest.raises(fe.InputError, match="straight"):
        free_headings("pursuit", "pursuit", HELD_OUT[:2])


@pytest.mark.parametrize("objective", TASKS)
def test_a_schedule_is_no_worse_than_a_constant_range_and_replays(
    objective: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = {"min_mean_distance": "one-range", "min_min_distance": "one-range-minimum"}[objective]
    task: Task = dataclasses.replace(tasks[name], scenarios={"small": SMALL})
    monkeypatch.setattr(references, "tasks", {name: task})
    played: list[tuple[np.ndarray, np.ndarray]] = []
    objectives = references._Replays.objectives

    def noting(self: Any, schedules: np.ndarray) -> np.ndarray:
        played.append((schedules, objectives(self, schedules)))
        return played[-1][1]

    monkeypatch.setattr(references._Replays, "objectives", noting)
    monkeypatch.setattr(references, "_GENERATIONS", 8)
    (best,) = clairvoyant(name, "small", HELD_OUT[:1])["objective"]
    (_, constants), *rest = played
    assert len(constants) == 24
    assert len(rest) == 8
    assert best == max(values.max() for _, values in played) > constants.max()
    schedules, values = max(rest, key=lambda generation: generation[1].max())
    ranges = task.options["max_range"] * schedules[values.argmax(), :3].astype(np.float32).astype(float) ** 2
    run = fe.simulate(SMALL, policy=fe.ScheduledRange(np.repeat(ranges, 12)), seed=HELD_OUT[0])
    distances = run.mean_distance if objective == "min_mean_distance" else run.min_distance
    assert distances.min() == pytest.approx(best, abs=1e-3)


def test_equal_ranges_gain_nothing_and_the_order_is_the_sign() -> None:
    same = gains("per-agent-local", 12.0, 12.0, range(2))
    np.testing.assert_allclose(same["team"], 0)
    np.testing.assert_allclose(same["own"], 0, atol=1e-9)  # each agent is once in each half
    there, back = (gains("per-agent-local", *pair, range(2)) for pair in ((12.0, 0.0), (0.0, 12.0)))
    np.testing.assert_array_equal(there["team"], -back["team"])
    np.testing.assert_allclose(there["own"], -back["own"], rtol=1e-9)


def test_gains_equal_episodes_of_the_environment() -> None:
    """In PettingZoo's environment, with the roles that the flock's seed draws."""
    task, seed, means = tasks["pursuit"], 3, []
    env = fe.parallel_env(task.scenario, **{**task.options, "reward": "individual", "action_mode": "range"})
    first = np.random.default_rng(seed).permutation(300) < 150
    for holds in (first, ~first):
        env.reset(seed=seed)
        returns = np.zeros(300)
        while env.agents:
            actions = {name: [8.0 if held else 20.0] for name, held in zip(env.agents, holds, strict=True)}
            _, rewards, *_ = env.step(actions)
            returns += np.array(list(rewards.values()))
        means.append(returns[holds].mean() - returns[~holds].mean())
    assert gains("pursuit", 8.0, 20.0, range(seed, seed + 1))["own"] == pytest.approx(np.mean(means))


def test_pairs_lie_within_the_ranges_of_an_action() -> None:
    assert pairs_of(tasks["per-agent-visible-minimum"]) == [(20.0, 0.0), (20.0, 10.0)]
    assert pairs_of(tasks["one-range"]) == pairs_of(tasks["held-out-sizes"]) == []
