"""The core for web pages gives the same bits in Node as the native core."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden_episodes import CHASED, RANDOM, ranges
from network_outcomes import cases as networks
from network_outcomes import policy_of
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import EnvOptions, View

ENGINE = Path(__file__).parents[2] / "target" / "playground"
SCRIPT = Path(__file__).parents[1] / "support" / "engine.mjs"
SEED, ACTIONS = 7, 41

needs_engine = pytest.mark.skipif(
    not (ENGINE / "flockesc_wasm.js").is_file() or shutil.which("node") is None,
    reason="needs Node and the module of `make playground`",
)


def played_in_node(cases: list[dict[str, Any]]) -> list[Any]:
    command = ["node", "--experimental-default-type=module", str(SCRIPT), str(ENGINE)]
    ended = subprocess.run(  # noqa: S603
        command, input=json.dumps(cases), capture_output=True, text=True, check=True
    )
    found: list[Any] = json.loads(ended.stdout)
    return found


def flocks() -> dict[str, fe.FlockScenario]:
    """Return all presets of the flock, and flocks with every option."""
    found = {name: flock for name, (_, flock) in fe.PRESETS.items() if isinstance(flock, fe.FlockScenario)}
    for dimension in (2, 3):
        small = small_flock(dimension, num_steps=ACTIONS, **RANDOM)
        found |= {
            f"everything, {dimension}D": small,
            f"learned, {dimension}D": small.with_learned_predators(),
            f"capture, {dimension}D": small_flock(dimension, num_steps=ACTIONS, **CHASED),
        }
    return found


@needs_engine
def test_episodes_have_the_same_bits() -> None:
    cases, expected = [], {}
    for name, scenario in flocks().items():
        for view, extra in ((View.FLOCK, {}), (View.AGENT, {"reward": "individual_distance_change"})):
            options = EnvOptions(action_mode="range", max_range=100.0, **extra)
            batch = FlockBatch(scenario, options, view=view)
            controls = batch.predator_policy_spec.count * scenario.dimension
            expected[name, view] = hashed(batch, controls)
            documents = {"scenario": scenario.to_json(), "options": options.to_core(view)}
            cases.append(
                {**documents, "seed": SEED, "actions": ACTIONS, "rows": batch.rows, "controls": controls}
            )
    assert dict(zip(expected, played_in_node(cases), strict=True)) == expected


def hashed(batch: FlockBatch, controls: int) -> str:
    """Return the hash of every state and observation of an episode."""
    digest = hashlib.sha256()
    observations, _ = batch.reset([0], [SEED])
    rewards, has_ended = np.zeros(batch.rows), np.zeros(1, bool)
    for t in range(1, ACTIONS + 1):
        state = batch.state(0)
        predators = np.concatenate([state["predator_positions"], state["predator_velocities"]])
        for array in (state["positions"], state["velocities"], predators, observations, rewards):
            digest.update(np.ascontiguousarray(array).tobytes())
        if t == ACTIONS or has_ended[0]:
            break
        pushes = ranges(t, controls).astype(np.float64).reshape(-1, batch.scenario.dimension) / 64
        predator_actions = pushes if controls else None
        observations, rewards, has_ended, *_ = batch.step(
            ranges(t, batch.rows), predator_actions=predator_actions
        )
    return digest.hexdigest()


@needs_engine
def test_networks_set_the_same_ranges() -> None:
    cases, expected = [], {}
    for name, (scenario, architecture, options) in networks().items():
        if isinstance(scenario, fe.FlockScenario):
            policy, view = policy_of(architecture), View.AGENT if options.get("per_agent") else View.FLOCK
            played = fe.rollout(scenario, policy, [SEED], **options)
            expected[name] = [played.min_mean_distance[0], played.num_components[0]]
            chosen = EnvOptions(**{key: value for key, value in options.items() if key != "per_agent"})
            cases.append(
                {
                    "scenario": scenario.to_json(),
                    "options": chosen.to_core(view),
                    "architecture": architecture.to_core(),
                    "parameters": policy.parameters.tolist(),
                    "ranges": [chosen.min_range, chosen.max_range],
                    "seed": SEED,
                    "rows": scenario.num_agents if view.is_per_agent else 1,
                }
            )
    assert dict(zip(expected, played_in_node(cases), strict=True)) == expected


@needs_engine
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"scenario": '{"num_agents": 0}'}, "num_agents: expected"),
        ({"options": '{"reward": "no"}'}, "reward: "),
        ({"rows": 3}, "ranges: expected 1 entries, got 3"),
        ({"controls": 1}, "predator_actions: expected 0 entries, got 1 entries"),
    ],
)
def test_bad_input_is_an_error_that_names_it(changed: dict[str, Any], message: str) -> None:
    case = {"scenario": "{}", "options": "{}", "seed": 0, "actions": 2, "rows": 1, "controls": 0}
    with pytest.raises(subprocess.CalledProcessError) as error:
        played_in_node([{**case, **changed}])
    assert message in error.value.stderr
