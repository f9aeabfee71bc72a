"""Every consumer takes every part and view of the core's tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from argument_table import FLOCK as PLAIN
from argument_table import PARTS, SLOTS
from cli_runs import Ran
from option_table import hunted
from same import same

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import EnvOptions, View
from flockesc_env.policies import Architecture
from flockesc_env.render import draw

SEED = 3
FLOCK = hunted()


@pytest.mark.parametrize(("slot", "part"), PARTS)
def test_a_part_is_simulated_played_stored_and_drawn(
    slot: str, part: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    scenario = PLAIN.replace(**{slot: SLOTS[slot][0](part)})
    run = fe.simulate(scenario, 2.0, seed=SEED)
    episodes = fe.rollout(scenario, fe.FixedRange(2.0), [SEED], max_range=4.0)
    assert episodes.min_mean_distance.tolist() == [run.mean_distance.min()]
    swept = fe.sweep(scenario, [2.0], [SEED])
    assert swept.values().tolist() == [[run.mean_distance.min()]]

    fe.save_run(run, tmp_path / "run.npz")
    same(fe.replay_run(fe.load_run(tmp_path / "run.npz").trajectory), run)
    draw(run, run.scenario.num_steps)
    file = tmp_path / "scenario.toml"
    file.write_text(scenario.to_toml())
    ran = Ran(capsys, "simulate", "--scenario", file, "fixed:2.0", "--seed", SEED, "--json")
    assert ran.json()["min_mean_distance"] == run.mean_distance.min()


@pytest.mark.parametrize("view", View)
def test_a_view_is_played_in_both_languages_stored_and_trained(view: View, tmp_path: Path) -> None:
    options = EnvOptions(max_range=20.0)
    batch = FlockBatch(FLOCK, options, num_flocks=2, view=view)
    observations, _ = batch.reset(range(2), [SEED, SEED + 1])
    spec = batch.policy_spec
    assert observations.shape == (2 * spec.rows, len(spec.layout.names))
    assert (spec.layout.low <= observations).all()
    assert (observations <= spec.layout.high).all()
    architecture = Architecture(spec.layout.names, hidden=())
    parameters = np.random.default_rng(0).normal(size=architecture.size)
    network = fe.NetworkPolicy(architecture, parameters)

    class InPython(fe.NetworkPolicy):
        """Has the same actions, but is played by the loop in Python."""

    arguments: Any = {"seeds": [SEED, SEED + 1], "per_agent": view.is_per_agent, "max_range": 20.0}
    played = fe.rollout(FLOCK, network, **arguments)
    same(fe.rollout(FLOCK, InPython(architecture, parameters), **arguments), played)
    mine = network.with_options(per_agent=view.is_per_agent, scenario=FLOCK, max_range=20.0)
    fe.save_policy(mine, tmp_path / "policy.npz")
    same(fe.rollout(str(tmp_path / "policy.npz"), [SEED, SEED + 1]), played)
