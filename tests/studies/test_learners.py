"""PPO and TQC: the policy file holds the model's actor, the record is right, rounds play their own flocks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
import torch
from small_runs import SMALL, small_run

from flockesc_env.policies.files import load_policy
from flockesc_env.sb3 import AgentVecEnv
from training.config import Args, PPOArgs
from training.evaluation import objective, policy_spec
from training.outputs import CURVE_FLOCKS
from training.ppo import PPORounds
from training.record import CURVE_FILE, RUN_FILE
from training.rounds import LINE_ACTIONS, SB3Rounds
from training.seeds import TUNING, first_seeds, training_seeds
from training.tqc import TQCRounds
from training.train import train

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
    policy = load_policy(trained.args.run / "policy.npz")
    assert trained.model.env is not None
    seen = trained.model.env.get_attr("policy_spec")[0]
    rng = np.random.default_rng(0)
    for scale in (1, 30):  # outputs inside and outside their bounds
        observations = scale * rng.normal(size=(500, len(seen.layout.names))).astype(np.float32)
        expected, _ = trained.model.predict(observations, deterministic=True)
        # torch and NumPy add 64 products in different orders, and each sum is rounded to float32.
        rounding = 64 * np.finfo(np.float32).eps
        actions = policy.policy.act(observations, seen)
        if seen.actions.mode == "discrete":  # candidates whose scores differ by rounding are equally right
            scores = (
                trained.model.policy.mlp_extractor.forward_actor(torch.tensor(observations)).detach().numpy()
            )
            actions, expected = scores[np.arange(len(scores)), [actions, expected]]
        np.testing.assert_allclose(actions, expected, rtol=0, atol=rounding)
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


def test_the_record_counts_actions_and_episodes(trained: SB3Rounds[Any]) -> None:
    args, speed = trained.args, json.loads((trained.args.run / RUN_FILE).read_text())
    rounds = args.num_flocks * args.num_episodes
    if args.is_line:
        assert speed["samples"] == rounds * LINE_ACTIONS
        assert rounds <= speed["episodes"] <= rounds * LINE_ACTIONS
    else:
        rows = SMALL.num_agents if args.per_agent else 1
        assert speed["samples"] == rounds * rows * SMALL.num_steps / args.steps_per_action
        assert speed["episodes"] == rounds
    assert speed["samples_per_second"] == pytest.approx(speed["samples"] / (60 * speed["minutes"]))
    assert 0 < speed["environment_share"] < 1


def test_every_round_plays_its_own_flocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    played: list[int] = []
    reset = AgentVecEnv.reset

    def recorded(env: AgentVecEnv) -> Any:
        played.extend(env._seeds[:: SMALL.num_agents])
        return reset(env)

    monkeypatch.setattr(AgentVecEnv, "reset", recorded)
    train(small_run(tmp_path / "run", seed=7))
    assert played == list(training_seeds(7, 0, 2 * 4))


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
    np.testing.assert_allclose(chosen, np.array(ranges)[expected], rtol=0, atol=1e-14)
    assert set(expected) == set(range(len(ranges)))
    rounds.train()
    assert load_policy(rounds.args.run / "policy.npz").policy.architecture.ranges == ranges


def test_episodes_of_training_can_be_shorter(tmp_path: Path) -> None:
    train(small_run(tmp_path / "run", episode_steps=8, inputs=("last_range", "neighbor_count")))
    speed = json.loads((tmp_path / "run" / RUN_FILE).read_text())
    assert speed["episodes"] == 2 * 4
    assert speed["samples"] == 2 * 4 * SMALL.num_agents * 8 / 4
    assert load_policy(tmp_path / "run" / "policy.npz").scenario == SMALL


@pytest.mark.parametrize("ranges", [(), (0.0, 5.0, 20.0)])
def test_ranges_have_their_cost(ranges: tuple[float, ...], tmp_path: Path) -> None:
    free, costly = (ppo_rounds(tmp_path, ranges=ranges, range_cost=cost)._timed for cost in (0, 0.4))
    actions = np.array([0, 2, 1] * 4) if ranges else np.array([[-1.0], [1.0], [-0.5]] * 4)
    rewards = []
    for env in (free, costly):
        env.seed(3)
        env.reset()
        rewards.append(env.step(actions)[1])
    np.testing.assert_allclose(rewards[0] - rewards[1], [0, 0.4, 0.1] * 4, atol=1e-5)


def test_the_first_scores_fall_with_the_range(tmp_path: Path) -> None:
    rounds = ppo_rounds(tmp_path, **CANDIDATES)
    scores: Any = rounds.model.policy.mlp_extractor
    found = scores.forward_actor(torch.tensor(rounds._env.reset())).detach().numpy()
    ranges = np.array(rounds.args.profile_ranges) / 10
    expected = np.broadcast_to(-8 * np.tanh(np.tanh(ranges)), found.shape)
    np.testing.assert_allclose(found, expected, atol=0.05)


@pytest.mark.parametrize(("anneal", "last"), [(True, 0.25), (False, 1.0)])
def test_the_learning_rate_falls_to_a_last_round_above_zero(
    anneal: bool, last: float, tmp_path: Path
) -> None:
    rounds = ppo_rounds(tmp_path, anneal=anneal, learning_rate=1e-3)
    rounds.train()
    assert rounds.model.policy.optimizer.param_groups[0]["lr"] == pytest.approx(last * 1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reward": "praise"}, "reward: expected one of .* got 'praise'"),
        ({"steps_per_action": 0}, "steps_per_action: expected"),
        ({"scenario": "nowhere"}, "scenario: expected one of"),
        ({"seed": 1000}, "seed: expected an integer from 0 to 999, got 1000"),
        ({"inputs": ("mood",)}, "observation: expected an entry 'mood'"),
        *[
            ({"episode_steps": 8, "inputs": inputs}, "inputs: expected entries without time, because")
            for inputs in ((), ("last_range", "time"))
        ],
        ({"candidate_inputs": ("range",)}, "profile_ranges: expected candidate ranges for a network"),
        ({"num_episodes": 500_001}, "flocks of a run: expected indices in"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_written(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    args: Args = small_run(tmp_path / "run", **changes)
    with pytest.raises(ValueError, match=message):
        train(args)
    assert not (tmp_path / "run").exists()
