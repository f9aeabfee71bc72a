"""Golden episodes keep their bytes on all threads and instruction sets; unseeded episodes differ."""

import json
import math
import multiprocessing
from itertools import chain
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from golden_episodes import GOLDEN as FILE
from golden_episodes import SEED, cases, hashes, updated
from masked_cpu import each_level, run_masked
from option_table import EVERY_STEP, dimensions, small_flock
from same import plain, same

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.scenario import Inertial, Reynolds

GOLDEN, NETWORKS = (json.loads(file.read_text()) for file in (FILE, FILE.with_name("network_outcomes.json")))

PRINT_HASHES = """
import json
import golden_episodes, network_outcomes
from numpy._core._multiarray_umath import __cpu_features__ as features
hashes = golden_episodes.hashes(2), network_outcomes.hashes(2)
print(json.dumps([features["AVX2"], features["AVX512F"], *hashes]))
"""

PROCESSES, ENVIRONMENTS, RESETS = 2, 24, 100
UNSEEDED: list[tuple[Any, Any]] = [
    *((make, small_flock()) for make in (fe.FlockEscapeEnv, fe.parallel_env, BatchVectorEnv)),
    (fe.LineEscapeEnv, fe.LineScenario(num_agents=5)),
]
SEEDS = range(13)
THREADS = [None, 1, 2, 3, 7]


def test_episodes_equal_the_golden_ones() -> None:
    assert hashes(4) == GOLDEN


def test_flushing_subnormal_numbers_on_one_thread_changes_no_episode() -> None:
    torch = pytest.importorskip("torch")
    if not torch.set_flush_denormal(True):
        pytest.skip("this processor cannot flush subnormal numbers")
    try:
        assert hashes(1) == GOLDEN
    finally:
        torch.set_flush_denormal(False)


@each_level
def test_episodes_and_networks_are_the_same_on_lower_x86_levels(
    level: int, has_avx2: bool, tmp_path: Path
) -> None:
    assert run_masked(PRINT_HASHES, level, tmp_path) == [has_avx2, False, GOLDEN, NETWORKS]


def test_changed_bits_need_a_new_version_of_an_id(monkeypatch: pytest.MonkeyPatch) -> None:
    changed = {**GOLDEN, "pursuit": "other bits"}
    with pytest.raises(ValueError, match="pursuit"):
        updated(GOLDEN, changed)
    assert updated(GOLDEN, {**GOLDEN, "a new case": "bits"})["a new case"] == "bits"
    monkeypatch.setitem(gymnasium.registry, "flockesc/FlockEscape-v2", None)
    with pytest.raises(ValueError, match="pursuit"):
        updated(GOLDEN, changed)  # the new version has no golden episode
    changed["flockesc/FlockEscape-v2"] = "bits"
    assert updated(GOLDEN, changed) == changed


def test_another_seed_is_another_episode() -> None:
    """Already at its start."""
    for name, case in cases().items():
        first, other = (repr(plain(next(case(1, seed)))) for seed in (SEED, SEED + 1))
        assert first != other, name


def unseeded(_: int) -> list[str]:
    """Return the first observations of new environments of every interface after resets without a seed."""
    seen = []
    for index in range(ENVIRONMENTS):
        make, scenario = UNSEEDED[index % len(UNSEEDED)]
        env = make(scenario=scenario)
        seen += [repr(plain(env.reset())) for _ in range(RESETS)]
    return seen


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_resets_without_a_seed_never_repeat(method: str) -> None:
    """Within one environment, across environments and across new processes."""
    with multiprocessing.get_context(method).Pool(PROCESSES, maxtasksperchild=1) as pool:
        seen = list(chain.from_iterable(pool.map(unseeded, range(PROCESSES), chunksize=1)))
    assert len(seen) == PROCESSES * ENVIRONMENTS * RESETS
    assert len(set(seen)) == len(seen)


@dimensions
def test_flock_sweep(dimension: int) -> None:
    scenario, ranges = small_flock(dimension, num_agents=40), [0.0, 4.0, 9.0]
    first, *others = (fe.sweep(scenario, ranges, SEEDS, num_threads=n) for n in THREADS)
    for result in others:
        same(result, first)


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_rollout(dimension: int, per_agent: bool) -> None:
    scenario = small_flock(dimension, num_agents=40)
    policy = fe.StubbornLeaders() if per_agent else fe.FixedRange(9.0)
    options = {**EVERY_STEP, "per_agent": per_agent, "predator_sensing_range": math.inf}
    first, *others = (
        fe.rollout(scenario, policy, SEEDS, batch_size=size, num_threads=count, **options)
        for size, count in [(64, None), (1, 1), (1, 2), (5, 1), (5, 3), (13, 2)]
    )
    for result in others:
        same(result, first)


def simulated(scenario: fe.FlockScenario, num_threads: int | None) -> list[Any]:
    """Simulate equal agents, and different, noisy ones under two laws of motion."""
    names, rng = ("mass", "speed", "repulsion_strength", "alignment_strength"), np.random.default_rng(0)
    traits: dict[str, Any] = {name: rng.uniform(0.5, 2, 5000) * getattr(scenario, name) for name in names}
    noisy = scenario.replace(angular_noise=0.5, sensing_noise=0.5, sensing_delay=2, **traits)
    return [
        fe.simulate(each, rho, seed=2, num_threads=num_threads)
        for each in (scenario, noisy.replace(motion=Inertial()), noisy.replace(motion=Reynolds()))
        for rho in (6.0, np.linspace(0.0, 20.0, 5000))
    ]


@dimensions
def test_threads_of_one_large_flock(dimension: int) -> None:
    """The flock is large enough to be split over threads, with 0.03 agents per m^D."""
    side = (5000 / 0.03) ** (1 / dimension)
    scenario = fe.FlockScenario(num_agents=5000, num_steps=4, dimension=dimension, initial_side=side)
    same(simulated(scenario, 3), simulated(scenario, 1))
