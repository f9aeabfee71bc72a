"""Refused actions, options and assignments: an error names them, and the episode goes on without them.

Bad values of every argument are in ``test_arguments``, in the default action mode.
"""

import copy
import dataclasses
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any, get_type_hints

import argument_table as table
import gymnasium
import numpy as np
import pytest
from envs import FLOCK, FLOCKS, REMEMBERING, Weave, draw, has_ended, play, start
from gymnasium.error import ResetNeeded
from gymnasium.wrappers import RescaleAction
from option_table import DIMENSIONS, small_flock
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecMonitor

import flockesc_env as fe
from flockesc_env import flockesc_v1, jobs, policies, scenario
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.models import neighbor_pairs
from flockesc_env.models.simulate import run_flock
from flockesc_env.policies import FlyStraight, Pursue
from flockesc_env.sb3 import vec_env
from flockesc_env.scenario import Learned, PurePursuit, Topological, approach
from flockesc_env.scenario.options import EnvOptionsDict, LineOptionsDict


def refused_field(environment: Any, actions: Any) -> str:
    with pytest.raises(fe.InputError) as caught:
        environment.step(actions)
    return caught.value.field


def test_who_acts() -> None:
    scenario = FLOCK.with_learned_predators()
    environment, twin = fe.parallel_env(scenario), fe.parallel_env(scenario)
    for each in (environment, twin):
        each.reset(seed=0)
    actions = draw(environment, np.random.default_rng(0))
    for name in ("agent_2", "predator_0"):
        missing = {agent: action for agent, action in actions.items() if agent != name}
        assert refused_field(environment, missing) == f"action of {name!r}"
    for name in ("agent_9", "predator_1"):
        assert refused_field(environment, {**actions, name: actions["agent_0"]}) == f"action of {name!r}"
    np.testing.assert_equal(environment.step(actions), twin.step(actions))
    alone = fe.parallel_env(FLOCK)
    alone.reset(seed=0)
    with pytest.raises(fe.InputError, match="predator_actions"):
        alone.step_array(np.zeros((5, 1), np.float32), np.zeros((1, 2)))


def test_bounds_are_actions_also_after_rounding_in_float32() -> None:
    """SAC, TD3 and DDPG, a scaled tanh and ``RescaleAction`` map the ends of their actions to the bounds."""
    rng, ends = np.random.default_rng(0), np.array([-1, 1], np.float32)
    for low, high in [(0.1, 0.7), (0.9, 3.7), *np.sort(10 ** rng.uniform(-2, 3, (200, 2))).tolist()]:
        env = fe.FlockEscapeEnv(FLOCK, min_range=low, max_range=high, action_mode="range")
        space: Any = env.action_space
        rescaled = [
            np.concatenate([space.low, space.high]).astype(np.float64),
            BasePolicy.unscale_action(SimpleNamespace(action_space=space), ends),  # type: ignore[arg-type]
            ends * ((space.high - space.low) / 2) + (space.high + space.low) / 2,
        ]
        for least, most in ((0, 1), (-1, 1), (0.1, 0.7)):
            wrapper = RescaleAction(env, np.float32(least), np.float32(most))
            rescaled.append(np.concatenate([wrapper.action(end) for end in np.float32([[least], [most]])]))
        for actions in rescaled:
            found = env.policy_spec.actions.to_ranges(actions[:, np.newaxis], 2)
            assert ((low <= found) & (found <= high)).all()
            np.testing.assert_allclose(found, [low, high], rtol=0, atol=1e-6 * high)
        for beyond in (low - 1e-6 * high, high + 1e-6 * high):
            assert refused_field(env, np.array([beyond])) == "action"


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_rounding_of_predator_actions_in_float32_is_clipped(dimension: int) -> None:
    hunters = (Learned((-10.0, -5.0), (6.0, 8.0)), Learned((40.0, 20.0), (-3.0, 1.0), max_speed=7.0))
    scenario = small_flock(dimension, num_agents=12, predators=hunters)
    ends = np.resize([1.0, 0.0, -1.0, 1.0, 0.0], (scenario.num_steps, 2, dimension))
    exact, beyond = (run_flock(scenario, 9.0, seed=1, predator_actions=ends * by) for by in (1, 1 + 3e-7))
    np.testing.assert_array_equal(exact.predator_positions, beyond.predator_positions)
    spec = FlockBatch(scenario, fe.EnvOptions()).predator_policy_spec
    np.testing.assert_array_equal(spec.plain(ends[0] * (1 + 3e-7), 2), ends[0])
    for refused in (np.nan, 1 + 1e-6):
        with pytest.raises(fe.InputError, match=r"predator_actions\[1\]"):
            spec.plain([[0.0] * dimension, [refused] * dimension], 2)


def test_nan_is_not_told_to_clip() -> None:
    env = fe.FlockEscapeEnv(FLOCK)
    for bad, hint in ((np.nan, "a policy that returns NaN has diverged"), (np.inf, "ClipAction clips it")):
        with pytest.raises(fe.InputError, match=hint):
            env.step(np.array([bad]))


@pytest.mark.parametrize("interface", REMEMBERING)
def test_a_refused_step_leaves_the_memory_of_policies(interface: str) -> None:
    """A policy with a memory is asked after the checks of the action and of the episode."""
    weave = Weave()
    environment, twin = (REMEMBERING[interface](predator_policy=policy) for policy in (weave, Weave()))
    for each in (environment, twin):
        start(each, 3)
        play(each, np.random.default_rng(0), 3)
    calls = weave.calls
    good = draw(environment, np.random.default_rng(1))
    bad = copy.deepcopy(good)
    if isinstance(bad, dict):
        bad["agent_4"] = np.full(1, np.nan)
    else:
        bad[-1] = np.nan
    with pytest.raises(fe.InputError):
        environment.step(bad)
    assert weave.calls == calls
    np.testing.assert_equal(*(play(each, np.random.default_rng(2), 12) for each in (environment, twin)))
    if not hasattr(environment, "num_envs"):
        while not has_ended(environment, environment.step(draw(environment, np.random.default_rng(3)))):
            pass
        calls = weave.calls
        with pytest.raises(ResetNeeded):
            environment.step(good)
        assert weave.calls == calls


LINES: dict[str, Callable[..., Any]] = {
    "line": fe.LineEscapeEnv,
    "rollout of a line": partial(fe.rollout, policy=fe.FixedRange(0.1), seeds=[0]),
}
RUNS: dict[str, Callable[..., Any]] = {
    "rollout": partial(fe.rollout, policy=fe.FixedRange(1.0), seeds=[0]),
    "simulate": partial(fe.simulate, policy=fe.FixedRange(1.0), seed=0),
}
FLOCK_RUNS = FLOCKS | RUNS
SHARED = {name: FLOCK_RUNS[name] for name in ("gymnasium", "vector", "flock slots", "rollout")}
CHASED = {name: make for name, make in FLOCK_RUNS.items() if name != "predator"}
LINE, HUNTED = fe.LineScenario(), small_flock(predators=(PurePursuit(),))
REFUSED: list[tuple[dict[str, Any], Any, dict[str, Any], str, str]] = [
    (FLOCK_RUNS, FLOCK, {"rewards": "terminal"}, "rewards", "did you mean reward"),
    (FLOCK_RUNS, FLOCK, {"xyz": 3}, "xyz", "expected one of .*action_mode, "),
    (FLOCK_RUNS, FLOCK, {"num_agents": 3}, "num_agents", r"pass scenario=FlockScenario\(num_agents=\.\.\.\)"),
    (LINES, LINE, {"rewards": "terminal"}, "rewards", "did you mean reward"),
    (LINES, LINE, {"num_agents": 3}, "num_agents", r"pass scenario=LineScenario\(num_agents=\.\.\.\)"),
    (LINES, fe.LineScenario(predator_position=None), {}, "predator_position", "expected"),
    (FLOCKS | {"rollout": RUNS["rollout"]}, small_flock(predators=()), {}, "predators", "expected"),
    (FLOCKS, small_flock(neighbor_rule=Topological()), {}, "max_range", "number of neighbors"),
    (CHASED, HUNTED, {"predator_policy": Pursue()}, "predator_policy", "makes one, got PurePursuit"),
    (SHARED, FLOCK, {"reward": "individual_distance"}, "reward", "expected"),
]


@pytest.mark.parametrize(("calls", "scenario", "options", "field", "words"), REFUSED)
def test_options_that_do_not_fit_are_named(
    calls: dict[str, Any], scenario: Any, options: dict[str, Any], field: str, words: str
) -> None:
    for call in calls.values():
        with pytest.raises(fe.InputError, match=words) as caught:
            call(scenario, **options)
        assert caught.value.field == field


@pytest.mark.parametrize(
    ("keywords", "options"), [(EnvOptionsDict, fe.EnvOptions), (LineOptionsDict, fe.LineOptions)]
)
def test_keywords_are_the_fields_of_the_dataclass(keywords: type, options: type) -> None:
    assert get_type_hints(keywords) == get_type_hints(options)
    assert set(keywords.__annotations__) == {field.name for field in dataclasses.fields(options)}
    assert not keywords.__required_keys__


def test_settings_are_not_assigned_through_wrappers() -> None:
    alone = gymnasium.make("flockesc/FlockEscape-v1", scenario=small_flock())
    several = gymnasium.make_vec("flockesc/LineEscape-v1", num_envs=2)
    slots = vec_env(small_flock(), per_agent=True)
    for name in ("scenario", *LineOptionsDict.__annotations__):
        calls = (alone.set_wrapper_attr, several.set_attr, slots.set_attr, VecMonitor(slots).set_attr)
        for call in (*calls, partial(setattr, flockesc_v1.env(small_flock()).unwrapped)):
            with pytest.raises(fe.InputError, match=f"{name}: .*environment with the new {name}"):
                call(name, "another")
    alone.set_wrapper_attr("note", 7)
    assert alone.get_wrapper_attr("note") == 7


DRAWN = table.FLOCK.replace(
    randomization=(
        scenario.Uniform("predators[0].constant_velocity.position[1]", 0.0, 1.0),
        scenario.Choice("predator_range", (20.0, 30.0)),
    )
)
HUNTED = table.FLOCK.with_learned_predators()
LEAGUE = table.FLOCK.replace(predators=(PurePursuit(), PurePursuit((40.0, 20.0), (-3.0, 1.0))))
CONTRADICTIONS: list[tuple[Callable[[], Any], str]] = [
    (lambda: approach((1.0, 2.0, 3.0), dimension=2), "aim"),
    (lambda: approach(direction=(0.0, 0.0)), "direction"),
    (lambda: fe.FlockEscapeEnv(action_mode="range", max_range=1e39), "max_range"),
    (lambda: fe.PredatorEnv(LEAGUE), "predators"),
    (lambda: fe.PredatorEnv(predator_policy=FlyStraight()), "predator_policy"),
    (lambda: fe.PredatorEnv(flock_policy=FlyStraight()), "flock_policy"),
    (lambda: fe.rollout(table.FLOCK, FlyStraight(), [0]), "policy"),
    (
        lambda: fe.rollout(HUNTED, fe.FixedRange(5.0), [0], predator_policy=fe.FixedRange(5.0)),
        "predator_policy",
    ),
    (lambda: fe.FlockEscapeEnv(HUNTED, predator_policy=fe.StubbornLeaders()), "predator_policy"),
    (lambda: fe.FlockEscapeEnv(profile_ranges=[0.0, 5.0]), "profile_ranges"),
    (lambda: fe.rollout(table.FLOCK, fe.StubbornLeaders(), [0], per_agent=False), "per_agent"),
    (lambda: fe.rollout(table.FLOCK, policies.BestCandidate("escape_cosine"), [0]), "profile_ranges"),
    (lambda: fe.rollout(table.FLOCK, fe.FixedRange(5.5), [0], max_range=5.0), "interaction_range"),
    (lambda: fe.rollout(table.FLOCK, fe.ScheduledRange(np.ones((10, 4))), [0], per_agent=True), "schedule"),
    *(
        (partial(fe.simulate, table.FLOCK, seed=0, **given), field)
        for given, field in (
            ({"interaction_range": [1, 1, 1, 1, -1]}, "interaction_range[4]"),
            ({"interaction_range": np.ones((10, 5))}, "interaction_range"),
            ({"policy": fe.ScheduledRange(np.ones((5, 10)))}, "schedule"),
            ({"interaction_range": 1.0, "initial_positions": table.POINTS.T}, "initial_positions"),
            ({"interaction_range": 1.0, "initial_positions": table.POINTS * 1e30}, "initial_positions[0, 0]"),
        )
    ),
    *(
        (partial(fe.scan, DRAWN, values, 5.0, [1], **options), field)
        for values, options, field in (
            ({"predators[0].position[1]": [1.0]}, {}, "predators[0].position[1]"),
            ({"predator_range": [1.0]}, {}, "predator_range"),
            *(
                ({name: [1.0]}, {}, "values")
                for name in ("angular_nois", "motion.nothing", "speed.x", "seed")
            ),
            ({"num_agents": [2.5]}, {}, "num_agents"),
            ({"angular_noise": [1.0, 7.0]}, {}, "angular_noise"),
            ({"angular_noise": [1.0, 2.0], "mass": [1.0]}, {}, "mass"),
            ({"interaction_range": [1.0]}, {}, "values"),
            *(
                (
                    {},
                    {"measures": (lambda r, _, found=found: r if found == "r" else found,)},
                    "measures[<lambda>]",
                )
                for found in (None, "r", "0", 1j, np.nan, [1.0])
            ),
        )
    ),
    (lambda: fe.rollout(table.LINE, fe.FixedRange(0.1), [0], per_agent=True), "per_agent"),
    (lambda: neighbor_pairs(fe.FlockScenario(blind_angle=1.0), np.zeros((4, 2)), 1.0), "velocities"),
    (lambda: FlockBatch(table.FLOCK, fe.EnvOptions()).core.observe([0], "no such view"), "view"),
    (lambda: jobs.find_backend("ray2"), "backend"),
    (lambda: jobs.Job("m:f", ({1, 2},), engine="").key, "arguments"),
    (lambda: fe.parallel_env(reward="teem"), "did you mean team"),
    (lambda: fe.parallel_env(objective="mean_distance"), "did you mean min_mean_distance"),
    (lambda: fe.parallel_env(predator_sensing_range=None), "math.inf: agents see the predator at any"),
    (lambda: fe.rollout("paper-flock", seeds=2), "rollout('paper-flock', 'stubborn-leaders', seeds=2)"),
    (lambda: fe.rollout(table.FLOCK, 12.0, [0]), "such as FixedRange(12.0) or 'fixed:12.0', got"),
    (lambda: fe.simulate(table.FLOCK, "fixed:12"), "policy=.. takes a policy"),
]
"""Calls and the field that the error names, or words of the error."""


@pytest.mark.parametrize(("call", "told"), CONTRADICTIONS)
def test_contradictions(call: Callable[[], Any], told: str) -> None:
    """Arguments that are good by themselves, and errors that say what to type."""
    with pytest.raises(fe.FlockescError) as caught:
        call()
    assert told in str(caught.value) if " " in told else told == caught.value.field
