"""The flock in JAX against the core, its gradients against finite differences, and what it refuses."""

import re
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env import scenario as sc

jax = pytest.importorskip("jax", reason="the extra jax is not installed")
pytest.importorskip("optax", reason="the extra jax is not installed")
import jax.numpy as jnp  # noqa: E402

from flockesc_env import jax as twin  # noqa: E402

PURSUIT = sc.PurePursuit(max_speed=16.0, acceleration=1.0)
UNLIKE = fe.FlockScenario(
    num_agents=40,
    **{name: tuple(np.linspace(0.1, 0.9, 40)) for name in ("mass", "alignment_strength")},
    **{name: tuple(np.linspace(8.0, 12.0, 40)) for name in ("speed", "repulsion_strength")},
    predators=(PURSUIT, sc.PurePursuit((120, -10), (-5, 5), max_turn_rate=2.0), sc.ConstantVelocity()),
)
SMALL = fe.FlockScenario(num_agents=12, num_steps=30, initial_side=30.0, predators=(PURSUIT,))
WEIGHTS = np.random.default_rng(0).normal(size=13)
assert_near = partial(np.testing.assert_allclose, rtol=0)


@pytest.fixture(autouse=True)
def double() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


def test_whole_episodes_follow_the_core() -> None:
    scenario, play = fe.FlockScenario(), partial(twin.rollout, "paper-flock", policy=lambda _: 12.0)
    starts = jax.tree.map(lambda *each: jnp.stack(each), *[twin.start(scenario, seed) for seed in range(8)])
    states = jax.jit(partial(jax.lax.map, play))(starts)
    for seed, run in enumerate(fe.simulate(scenario, 12.0, seed=seed) for seed in range(8)):
        assert_near(states.positions[seed], run.positions[1:], atol=1e-10)
        assert_near(states.min_mean_distance[seed, -1], run.mean_distance.min(), atol=1e-10)
        assert_near(states.min_min_distance[seed, -1], run.min_distance.min(), atol=1e-10)


@pytest.mark.parametrize(("per_agent", "reach"), [(True, 30.0), (False, 30.0), (False, np.inf)])
def test_observations_and_predators_follow_the_core(per_agent: bool, reach: float) -> None:
    """Unlike agents under three predators, with random ranges that hold for 4 steps."""
    options: Any = {"predator_sensing_range": reach, "objective": "min_min_distance"}
    env: Any = fe.parallel_env(UNLIKE, **options) if per_agent else fe.FlockEscapeEnv(UNLIKE, **options)
    reset, play = (env.reset_array, env.step_array) if per_agent else (env.reset, env.step)
    observe = jax.jit(partial(twin.observe, UNLIKE, per_agent=per_agent, **options))
    step, state, observed = jax.jit(partial(twin.step, UNLIKE)), twin.start(UNLIKE, 7), reset(seed=7)[0]
    for actions in np.random.default_rng(0).uniform(-1, 1, (22, 40, 1) if per_agent else (22, 1)):
        assert_near(observe(state), observed, atol=1e-6)
        for _ in range(4):
            state = step(state, (actions[..., 0] + 1) * 20)
        observed = play(actions)[0]
    assert_near(state.predator_positions, env.flock.predator_positions, atol=1e-10)


def objective(weights: Any, softness: float) -> Any:
    def policy(observed: Any) -> Any:
        return 6.0 + 4.0 * jnp.tanh(observed @ weights)

    states = twin.rollout(SMALL, twin.start(SMALL, 3), policy, softness)
    return states.min_mean_distance[-1]


def test_gradients_equal_finite_differences_and_hard_boundaries_hide_the_ranges() -> None:
    play, step = jax.jit(jax.value_and_grad(objective), static_argnums=1), 1e-6
    ends = [[play(WEIGHTS + shift, 2.0)[0] for shift in sign * step * np.eye(13)] for sign in (1, -1)]
    expected, (_, gradient) = np.subtract(*ends) / (2 * step), play(WEIGHTS, 2.0)
    assert np.abs(gradient).max() > 0.01
    assert_near(gradient, expected, rtol=1e-5, atol=1e-7)
    assert not play(WEIGHTS, 0.0)[1].any()


def test_gradients_are_finite_at_distance_and_velocity_zero() -> None:
    scenario = SMALL.replace(num_agents=3, num_steps=2)

    def total(positions: Any, velocities: Any) -> Any:
        state = twin.init(scenario, positions, velocities)
        states = twin.rollout(scenario, state, lambda observed: observed[:, 1], 2.0, steps_per_action=1)
        after = jax.tree.map(lambda each: each[-1], states)
        return after.velocities.sum() + twin.observe(scenario, after, per_agent=False).sum()

    positions = jnp.array([[-30, -30], [5, 5], [5, 5]], np.float32)  # on the predator, and at one place
    gradients = jax.jit(jax.grad(total, argnums=(0, 1)))(positions, jnp.zeros_like(positions))
    assert all(jnp.isfinite(each).all() and each.dtype == np.float32 for each in gradients)


STRICT = {"jax_numpy_dtype_promotion": "strict", "jax_numpy_rank_promotion": "raise", "jax_debug_infs": True}


def test_strict_settings_of_jax_change_no_number() -> None:
    def total(weight: Any) -> Any:
        def policy(observed: Any) -> Any:
            return 6.0 + weight * observed[..., 1]

        start = twin.init(UNLIKE, positions, jnp.zeros_like(positions))
        states = twin.rollout(scenario, start, policy, 2.0)
        last = jax.tree.map(lambda each: each[-1], states)
        return last.min_mean_distance + twin.observe(scenario, last, per_agent=False).sum()

    scenario, positions = UNLIKE.replace(num_steps=5), jnp.ones((40, 2)).at[0].set(-30)  # all in two places
    expected = jax.jit(jax.value_and_grad(total))(jnp.ones(()))
    before = {name: getattr(jax.config, name) for name in STRICT}
    try:
        jax.tree.map(jax.config.update, list(STRICT), [*STRICT.values()])
        assert jax.jit(jax.value_and_grad(total))(jnp.ones(())) == expected
    finally:
        jax.tree.map(jax.config.update, list(before), [*before.values()])


@pytest.mark.parametrize(
    ("field", "call"),
    [
        ("dimension", lambda _: twin.start(fe.FlockScenario(dimension=3), 0)),
        (
            "randomization[0]",
            lambda _: twin.start(SMALL.replace(randomization=(sc.Choice("mass", (1, 2)),)), 0),
        ),
        ("predators[0].pure_pursuit.target", lambda _: twin.start("isolated-prey", 0)),
        ("positions", lambda state: twin.init(SMALL, state.positions[:3], state.velocities)),
        ("ranges", lambda state: jax.jit(partial(twin.step, SMALL))(state, np.zeros(3))),
        ("ranges", lambda state: twin.step(SMALL, state, -1.0)),
        ("profile_ranges", lambda state: twin.observe(SMALL, state, profile_ranges=[1.0])),
        ("policy", lambda state: twin.rollout(SMALL, state, lambda _: jnp.zeros(3))),
    ],
)
def test_other_scenarios_and_bad_arguments_are_refused_by_name(field: str, call: Any) -> None:
    with pytest.raises(fe.InputError, match=f"^{re.escape(field)}: "):
        call(twin.start(SMALL, 0))
