"""PPO and TQC: the policy file holds the model's actor, the record is right, rounds play their own flocks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
import torch
from rounding import EPS, actor_layers, choose_alike, float32_error
from small_runs import small_run
from training.config import PPOArgs
from training.evaluation import objective, policy_spec
from training.outputs import CURVE_FLOCKS
from training.ppo import PPORounds
from training.record import CURVE_FILE, RUN_FILE
from training.tqc import TQCRounds

from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.policies.files import load_policy
from training.rounds import SB3Rounds

LINE: dict[str, Any] = {
    "scenario": "paper-line",
    "reward": "change",
    "max_range": 1.0,
    "steps_per_action": 1,
    "per_agent": False,
    "num_episodes": 2,
    "batch_size": 64,
}
CANDIDATES: dict[str, Any] = {
    "profile_ranges": (0.0, 5.0, 10.0),
    "extra_entries": ("escape_direction",),
    "inputs": ("speed",),
    "candidate_inputs": ("velocity_left", "escape_cosine", "range"),
}
LEARNERS: dict[str, tuple[str, dict[str, Any]]] = {
    "per-agent PPO": ("per-agent PPO", {}),
    "per-agent PPO with inputs": ("per-agent PPO", {"inputs": ("heard_velocity_left", "speed")}),
    "per-agent PPO over candidates": ("per-agent PPO", CANDIDATES),
    "shared PPO": ("shared PPO", {}),
    "TQC": ("TQC", {}),
    "line PPO": ("shared PPO", LINE),
    "line TQC": ("TQC", LINE),
}


def ppo_rounds(folder: Path, **changes: Any) -> PPORounds:
    args = small_run(folder / "run", **changes)
    assert isinstance(args, PPOArgs)
    return PPORounds(args)


@pytest.fixture(scope="module", params=LEARNERS.values(), ids=LEARNERS)
def trained(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> SB3Rounds[Any]:
    # A learning rate at which the small run moves far from its first weights.
    folder = tmp_path_factory.mktemp("runs") / "run"
    learner, changes = request.param
    args: Any = small_run(folder, learner, **{**changes, "learning_rate": 0.02})
    rounds = PPORounds(args) if isinstance(args, PPOArgs) else TQCRounds(args)
    rounds.train()
    return rounds


def test_the_file_holds_the_actor(trained: SB3Rounds[Any]) -> None:
    policy: Any = load_policy(trained.args.run / "policy.npz")
    assert trained.model.env is not None
    seen = trained.model.env.get_attr("policy_spec")[0]
    rng = np.random.default_rng(0)
    for scale in (1, 30):  # outputs inside and outside their bounds
        observations = scale * rng.normal(size=(500, len(seen.layout.names))).astype(np.float32)
        expected, _ = trained.model.predict(observations, deterministic=True)
        actions = policy.policy.with_options(seen.options, per_agent=seen.per_agent).act(observations, seen)
        if seen.actions.mode == "discrete":
            scorer: Any = trained.model.policy.mlp_extractor
            ranges = np.tile(scorer._ranges, (len(observations), 1))
            candidates = np.hstack([observations, ranges])[:, scorer._columns]
            assert choose_alike(scorer.policy_net, candidates, actions, expected)
        else:
            inputs = observations[:, [seen.layout.index(name) for name in policy.policy.architecture.inputs]]
            error = float32_error(actor_layers(trained.model), inputs)
            assert (np.abs(actions - expected) <= error).all()
        assert np.ptp(expected) > 0
    assert policy.scenario == trained.args.model
    assert policy.per_agent == trained.args.per_agent
    assert policy.options == json.loads(json.dumps(trained.args.env_options()))


def test_the_curve_ends_with_the_policy_in_the_file(trained: SB3Rounds[Any]) -> None:
    args = trained.args
    curve, speed = pl.read_parquet(args.run / CURVE_FILE), json.loads((args.run / RUN_FILE).read_text())
    assert curve.columns == ["episodes", "seconds", "objective"]
    assert len(curve) == args.num_episodes // args.checkpoint_every
    policy = load_policy(args.run / "policy.npz").policy
    assert curve["objective"][-1] == objective(args, policy, first_seeds(TUNING, CURVE_FLOCKS)).mean()
    assert curve["episodes"][-1] == speed["episodes"]
    assert curve["seconds"][-1] == pytest.approx(60 * speed["minutes"])


def test_a_policy_over_ranges_is_stored_as_a_network_that_sets_the_most_probable_one(tmp_path: Path) -> None:
    ranges = (0.0, 4.0, 5.0, 20.0)
    rounds = ppo_rounds(tmp_path, ranges=ranges, inputs=("heard_velocity_left", "speed"))
    spec = policy_spec(rounds.args)
    last = rounds.model.policy.action_net
    np.testing.assert_array_equal(last.bias.detach(), [0, -1, -2, -3])
    torch.manual_seed(0)
    torch.nn.init.normal_(last.weight, std=3)
    torch.nn.init.normal_(last.bias)
    observations = np.random.default_rng(0).normal(size=(500, len(spec.layout.names))).astype(np.float32)
    expected, _ = rounds.model.predict(observations, deterministic=True)
    chosen = spec.actions.to_ranges(rounds.policy().act(observations, spec), len(observations))
    inputs = observations[:, [spec.layout.index(name) for name in rounds.args.inputs]]
    indices = np.searchsorted(ranges, chosen - 1e-9)
    np.testing.assert_allclose(np.array(ranges)[indices], chosen, rtol=0, atol=1e-14)
    assert choose_alike(actor_layers(rounds.model), inputs, indices, expected)
    assert set(expected) == set(range(len(ranges)))
    rounds.train()
    assert load_policy(rounds.args.run / "policy.npz").policy.architecture.ranges == ranges


@pytest.mark.parametrize("ranges", [(), (0.0, 5.0, 20.0)])
def test_ranges_have_their_cost(ranges: tuple[float, ...], tmp_path: Path) -> None:
    free, costly = (ppo_rounds(tmp_path, ranges=ranges, range_cost=cost)._timed for cost in (0, 0.4))
    actions = np.array([0, 2, 1] * 4) if ranges else np.array([[-1.0], [1.0], [-0.5]] * 4)
    rewards = []
    for env in (free, costly):
        env.seed(3)
        env.reset()
        rewards.append(env.step(actions)[1])
    rounding = EPS * np.abs(rewards).max()  # of both rewards, and of their difference
    np.testing.assert_allclose(rewards[0] - rewards[1], [0, 0.4, 0.1] * 4, rtol=0, atol=rounding)
