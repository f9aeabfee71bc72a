"""Networks as policies against loops over rows, agents and layers, and under reflection of the world."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockEscapeEnv,
    FlockScenario,
    FlockVectorEnv,
    parallel_env,
    simulate,
)
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import bind
from flockesc_env.policies.network import Architecture, NetworkPolicy, mirrored

INPUTS = ("predator_distance", "heard_velocity_left", "time", "predator_direction_left")
SCENARIO = small_flock(num_agents=6, num_steps=12, predator_range=60.0)

architectures = st.builds(
    Architecture,
    inputs=st.permutations(INPUTS).map(lambda names: tuple(names[:3])),
    hidden=st.lists(st.integers(1, 5), max_size=3).map(tuple),
    memory=st.integers(0, 3),
    mirror=st.booleans(),
    squash=st.sampled_from(["clip", "tanh"]),
)


def policy_spec(scenario: FlockScenario = SCENARIO, **options: Any) -> PolicySpec:
    return parallel_env(scenario, **options).policy_spec


def parameters(architecture: Architecture, seed: int = 0, networks: tuple[int, ...] = ()) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 1.5, (*networks, architecture.size))


def some_rows(count: int, time: float, rng: np.random.Generator) -> np.ndarray:
    """Return observations; a third of the rows senses no predator."""
    layout = policy_spec().layout
    rows = rng.uniform(layout.low, layout.high, (count, len(layout.names))).astype(np.float32)
    rows[:, layout.index("time")] = time
    for name in layout.names:
        if name.startswith("predator"):
            rows[::3, layout.index(name)] = 0
    return rows


def reference(
    architecture: Architecture, numbers: np.ndarray, row: np.ndarray, memory: list[float]
) -> tuple[float, list[float]]:
    """Run one network on one row with scalar loops; return action and memory."""
    layout = policy_spec().layout
    seen = {name: float(row[layout.index(name)]) for name in layout.names}
    side = seen["predator_direction_left"] or seen["heard_velocity_left"]
    if architecture.mirror and side < 0:
        seen = {name: -value if name.endswith("_left") else value for name, value in seen.items()}
    values, rest = [seen[name] for name in architecture.inputs] + memory, list(numbers)
    widths = [*architecture.hidden, 1 + architecture.memory]
    for layer, width in enumerate(widths):
        weights = [[rest.pop(0) for _ in range(width)] for _ in values]
        biases = [rest.pop(0) for _ in range(width)]
        sums = [
            bias + sum(value * line[column] for value, line in zip(values, weights, strict=True))
            for column, bias in enumerate(biases)
        ]
        values = sums if layer == len(widths) - 1 else [float(np.tanh(one)) for one in sums]
    assert not rest
    action = np.tanh(values[0]) if architecture.squash == "tanh" else min(max(values[0], -1), 1)
    return float(action), [float(np.tanh(value)) for value in values[1:]]


@settings(max_examples=40)
@given(architectures, st.integers(0, 2**32 - 1))
def test_it_equals_the_loop_over_rows_and_layers(architecture: Architecture, seed: int) -> None:
    rng = np.random.default_rng(seed)
    numbers = parameters(architecture, seed)
    policy = NetworkPolicy(architecture, numbers)
    memory = [[0.0] * architecture.memory for _ in range(7)]
    for time in (0.0, 0.25, 0.5):
        rows = some_rows(7, time, rng)
        expected = []
        for k, row in enumerate(rows):
            action, memory[k] = reference(architecture, numbers, row, memory[k])
            expected.append([action])
        given_rows = rows.copy()
        actions = policy.act(rows, policy_spec())
        np.testing.assert_allclose(actions, expected, rtol=0, atol=1e-5)
        assert actions.shape == (7, 1)
        assert np.abs(actions).max() <= 1
        np.testing.assert_array_equal(rows, given_rows)


# Its action is its memory, and its memory is the time: each action is the tanh of the previous time.
REMEMBERING = NetworkPolicy(Architecture(("time",), (), memory=1), [0, 1, 1, 0, 0, 0])


def remembered(policy: NetworkPolicy, times: list[float]) -> np.ndarray:
    rows = some_rows(len(times), 0.0, np.random.default_rng(0))
    rows[:, policy_spec().layout.index("time")] = times
    return policy.act(rows, policy_spec())[:, 0]


def begun(rows: int = 2) -> NetworkPolicy:
    policy = NetworkPolicy(REMEMBERING.architecture, REMEMBERING.parameters)
    policy.reset(np.ones(rows, bool))
    return policy


def test_memory_starts_at_zero_and_is_kept() -> None:
    policy = begun()
    np.testing.assert_array_equal(remembered(policy, [0.0, 0.0]), [0, 0])
    np.testing.assert_array_equal(remembered(policy, [0.25, 0.5]), [0, 0])
    policy.reset(np.array([False, True]))
    np.testing.assert_allclose(remembered(policy, [0.5, 0.0]), [np.tanh(0.25), 0], atol=1e-7)
    np.testing.assert_allclose(remembered(policy, [0.75, 0.1]), [np.tanh(0.5), 0], atol=1e-7)
    policy.reset(np.ones(3, bool))
    np.testing.assert_array_equal(remembered(policy, [0.0, 0.0, 0.0]), [0, 0, 0])  # other rows
    with pytest.raises(ArgumentError, match="rows: expected 3 rows as before, got 2"):
        policy.reset(np.array([False, True]))


@pytest.mark.parametrize("times", [[0.5], [0.5, 0.5, 0.5], [0.0, 0.5, 0.0]])
def test_memory_refuses_added_or_removed_rows(times: list[float]) -> None:
    policy = begun()
    remembered(policy, [0.0, 0.0])
    remembered(policy, [0.25, 0.5])
    with pytest.raises(ArgumentError, match=f"observations: expected 2 rows as before, got {len(times)}"):
        remembered(policy, times)
    np.testing.assert_allclose(remembered(policy, [0.5, 0.75]), np.tanh([0.25, 0.5]), atol=1e-7)


def test_each_flock_has_its_own_memory_if_episodes_start_at_different_times() -> None:
    """One slot of a vector environment is reset during the episodes of the others."""
    architecture = Architecture(("time", "mean_distance"), memory=2)
    numbers, options = parameters(architecture), {"max_range": 30.0}
    env = FlockVectorEnv(2, SCENARIO, **options)
    act = bind(NetworkPolicy(architecture, numbers), env)
    observations, _ = env.reset(seed=[1, 2])
    actions = []
    for step in range(8):
        if step == 4:
            mask = np.array([False, True])
            observations, _ = env.reset(seed=[None, 3], options={"reset_mask": mask})
        actions.append(act(observations))
        observations, *_ = env.step(actions[-1])

    single = FlockEscapeEnv(SCENARIO, **options)
    for slot, seed, steps in ((0, 1, range(8)), (1, 2, range(4)), (1, 3, range(4, 8))):
        act = bind(NetworkPolicy(architecture, numbers), single)
        observation, _ = single.reset(seed=seed)
        for step in steps:
            action = act(observation)
            np.testing.assert_allclose(actions[step][slot], action, rtol=0, atol=1e-5)
            observation, *_ = single.step(action)


def reflected(seed: int, axis: int, scenario: FlockScenario) -> tuple[FlockScenario, dict[str, np.ndarray]]:
    """Return scenario and start of a flock reflected in an axis."""
    turn = np.diag([-1.0 if i == axis else 1.0 for i in range(2)])
    run = simulate(scenario, 0.0, seed=seed)
    (predator,) = scenario.predators
    other = ConstantVelocity(turn @ np.array(predator.position), turn @ np.array(predator.velocity))
    start = {"initial_positions": run.positions[0] @ turn, "initial_velocities": run.velocities[0] @ turn}
    return scenario.replace(predators=(other,)), start


def rows_of(observations: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack(list(observations.values()))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("sensing", [None, 25.0])
def test_a_flock_and_its_reflection_have_equal_mirrored_views(axis: int, sensing: float | None) -> None:
    options = {"predator_sensing_range": sensing, "max_range": 30.0}
    scenario = SCENARIO.replace(num_agents=20)
    other, start = reflected(3, axis, scenario)
    envs = parallel_env(scenario, **options), parallel_env(other, **options)
    rows = [rows_of(envs[0].reset(seed=3)[0]), rows_of(envs[1].reset(seed=3, options=start)[0])]
    layout, turned = envs[0].policy_spec.layout, 0
    left = [name.endswith("_left") for name in layout.names]
    for _ in range(6):
        np.testing.assert_allclose(rows[1], np.where(left, -rows[0], rows[0]), atol=1e-5)
        one, two = (mirrored(row, layout) for row in rows)
        np.testing.assert_allclose(one, two, atol=1e-5)
        predator, heard = (
            one[:, layout.index(f"{name}_left")] for name in ("predator_direction", "heard_velocity")
        )
        assert np.where(predator != 0, predator, heard).min() >= 0
        changed = (one != rows[0]).any(axis=1)
        turned += changed.sum()
        assert not changed.all()
        np.testing.assert_array_equal(one[:, ~np.array(left)], rows[0][:, ~np.array(left)])
        actions = {name: np.array([-0.3], np.float32) for name in envs[0].agents}
        rows = [rows_of(env.step(actions)[0]) for env in envs]
    assert turned > 0


def played(policy: NetworkPolicy, scenario: FlockScenario, **start: np.ndarray) -> float:
    env = parallel_env(scenario, predator_sensing_range=None, max_range=30.0)
    act = bind(policy, env)
    observations, _ = env.reset(seed=3, options=start)
    while env.agents:
        observations, _, _, _, infos = env.step(act(observations))
    return float(next(iter(infos.values()))["min_mean_distance"])


@pytest.mark.parametrize("memory", [0, 2])
def test_a_mirrored_network_sets_equal_ranges_in_a_flock_and_its_reflection(memory: int) -> None:
    scenario = SCENARIO.replace(num_agents=20, num_steps=40)
    other, start = reflected(3, 1, scenario)
    outcomes = {}
    for mirror in (True, False):
        architecture = Architecture(INPUTS, memory=memory, mirror=mirror)
        policy = NetworkPolicy(architecture, parameters(architecture, seed=1))
        outcomes[mirror] = played(policy, scenario), played(policy, other, **start)
    assert outcomes[True][0] == pytest.approx(outcomes[True][1], abs=1e-4)
    assert abs(outcomes[False][0] - outcomes[False][1]) > 0.01


def test_observations_with_the_predator_on_the_left_are_not_mirrored() -> None:
    layout = policy_spec().layout
    rows = some_rows(60, 0.5, np.random.default_rng(1))
    predator, heard = layout.index("predator_direction_left"), layout.index("heard_velocity_left")
    rows[:20, predator], rows[20:40, predator], rows[40:, predator] = 0.5, -0.5, 0.0
    rows[40:50, heard], rows[50:, heard] = 0.5, -0.5
    same = (mirrored(rows, layout) == rows).all(axis=1)
    np.testing.assert_array_equal(same, [True] * 20 + [False] * 20 + [True] * 10 + [False] * 10)
    np.testing.assert_array_equal(mirrored(mirrored(rows, layout), layout), mirrored(rows, layout))


@pytest.mark.parametrize(("bias", "clip"), [(0.5, 0.5), (3, 1), (-2, -1)])
def test_actions_are_clipped_or_squashed(bias: float, clip: float) -> None:
    rows = some_rows(2, 0.0, np.random.default_rng(0))
    for squash, expected in (("clip", clip), ("tanh", np.tanh(bias))):
        policy = NetworkPolicy(Architecture(("time",), (), squash=squash), [0, bias])  # type: ignore[arg-type]
        np.testing.assert_allclose(policy.act(rows, policy_spec()), [[expected]] * 2, atol=1e-6)


@pytest.mark.parametrize("shape", [(6,), (8,), (0,), (1, 7), (7, 1), ()])
def test_parameters_of_a_wrong_size_are_refused(shape: tuple[int, ...]) -> None:
    architecture = Architecture(("time",), (2,))
    assert architecture.size == 1 * 2 + 2 + 2 * 1 + 1
    with pytest.raises(ArgumentError, match=r"parameters: expected shape \(7,\)"):
        NetworkPolicy(architecture, np.zeros(shape))


def test_parameters_that_are_not_finite_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"parameters\[1\]: expected a finite number"):
        NetworkPolicy(Architecture(("time",), ()), [0.0, np.nan])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"inputs": ()}, "inputs: expected at least one name, got none"),
        ({"hidden": (4, 0)}, r"hidden\[1\]: expected an integer from 1"),
        ({"hidden": (2.5,)}, r"hidden\[0\]: expected an integer"),
        ({"memory": -1}, r"memory: expected an integer from 0 to 2\^63 - 1, got -1"),
        ({"memory": 0.5}, "memory: expected an integer"),
        ({"squash": "cut"}, "squash: expected one of clip, tanh, got 'cut'"),
    ],
)
def test_architectures_out_of_bounds_are_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Architecture(**{"inputs": ("time",), **fields})


@pytest.mark.parametrize("mode", ["range", "discrete"])
def test_other_actions_than_normalized_ones_are_refused(mode: str) -> None:
    with pytest.raises(ArgumentError, match=f"action_mode: expected 'normalized', got '{mode}'"):
        REMEMBERING.act(some_rows(2, 0.0, np.random.default_rng(0)), policy_spec(action_mode=mode))


@pytest.mark.parametrize("mirror", [False, True])
def test_unknown_observation_entries_are_refused(mirror: bool) -> None:
    """The flock view has no entry for a predator on the left."""
    shared = FlockEscapeEnv(SCENARIO).policy_spec
    architecture = Architecture(("time",) if mirror else ("predator_direction_left",), (), mirror=mirror)
    with pytest.raises(ArgumentError, match="observation: expected an entry 'predator_direction_left', got"):
        NetworkPolicy(architecture, [0, 0]).act(np.zeros((2, len(shared.layout.names)), np.float32), shared)
