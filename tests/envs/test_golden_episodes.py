"""Golden episodes keep their bytes on all threads and instruction sets; unseeded episodes differ."""

import json
import multiprocessing
from itertools import chain
from pathlib import Path
from typing import Any

import gymnasium
import pytest
from golden_episodes import GOLDEN as FILE
from golden_episodes import SEED, cases, hashed, hashes, updated
from masked_cpu import each_level, run_masked
from option_table import small_flock
from same import plain

from flockesc_env import FlockEscapeEnv, LineEscapeEnv, LineScenario, parallel_env
from flockesc_env.envs.vector import BatchVectorEnv

GOLDEN, NETWORKS = (json.loads(file.read_text()) for file in (FILE, FILE.with_name("network_outcomes.json")))

PRINT_HASHES = """
import json
import golden_episodes, network_outcomes
from numpy._core._multiarray_umath import __cpu_features__ as features
hashes = golden_episodes.hashes(2), network_outcomes.hashes(2)
print(json.dumps([features["AVX2"], features["AVX512F"], *hashes]))
"""

PROCESSES, ENVIRONMENTS, RESETS = 4, 25, 100


@pytest.mark.parametrize("num_threads", [1, 4])
def test_episodes_equal_the_golden_ones(num_threads: int) -> None:
    assert hashes(num_threads) == GOLDEN


def test_flushing_subnormal_numbers_changes_no_episode() -> None:
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
    others = {name: hashed(case, 1, SEED + 1) for name, case in cases().items()}
    assert others.keys() == GOLDEN.keys()
    assert not set(others.values()) & set(GOLDEN.values())


UNSEEDED: list[tuple[Any, Any]] = [
    *((make, small_flock()) for make in (FlockEscapeEnv, parallel_env, BatchVectorEnv)),
    (LineEscapeEnv, LineScenario(num_agents=5)),
]


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
