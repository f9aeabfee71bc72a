"""Training with stable-baselines3: every algorithm, the file of the policy, resumed runs, refusals."""

import dataclasses
import inspect
import json
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from rounding import choose_alike
from small_runs import LEARNERS, SMALL, small_run, small_task
from stable_baselines3 import PPO

from flockesc_env import InputError, load_policy, rollout
from flockesc_env.episodes.splits import TUNING
from flockesc_env.policies import SB3Policy
from flockesc_env.sb3 import RangePolicy
from flockesc_env.taskset import tasks
from flockesc_env.taskset.learners import OWN_ALGORITHMS, Learner, read_learners
from training import sb3
from training.imitation import ImitationArguments
from training.rounds import hyperparameters_of
from training.rule_search import RuleArguments
from training.run import Run
from training.search import SearchArguments
from training.train import train

SB3 = [name for name in LEARNERS if name not in OWN_ALGORITHMS]
TABLES = [(task, name) for task in tasks for name in tasks[task].learners]


@pytest.mark.parametrize("algorithm", SB3)
def test_every_algorithm_trains_and_ends_with_its_best_model(algorithm: str, tmp_path: Path) -> None:
    run = small_run(tmp_path / "run", algorithm)
    path = train(run)
    measured = json.loads((run.folder / "run.json").read_text())
    (start, first), *_ = curve = measured["curve"]
    assert start == 0
    assert measured["samples"] >= run.learner.samples
    model = sb3.algorithm_of(run).load(run.folder / "best_model.zip", device="cpu")
    spec, view = run.task.spec, {"per_agent": run.task.per_agent}
    values = spec.values(rollout(SMALL, SB3Policy(model), TUNING[:64], **run.options, **view))
    assert values.mean() == pytest.approx(max(value for _, value in curve), rel=1e-6)
    assert values.mean() >= first * (1 - 1e-6)
    assert measured["evaluations"] == 64 * len(curve)
    if algorithm == "RecurrentPPO":
        assert path.name == "best_model.zip"
        return
    entry = load_policy(path)
    assert (entry.scenario, entry.per_agent) == (SMALL, run.task.per_agent)
    own = spec.values(rollout(SMALL, entry, TUNING[:64]))
    np.testing.assert_allclose(own, values, rtol=1e-3)


@pytest.mark.parametrize(
    "options",
    [{}, {"action_mode": "range"}, {"action_mode": "discrete", "range_grid": (0.0, 5.0, 20.0)}],
)
def test_the_untrained_policy_is_a_fixed_range(options: dict[str, Any]) -> None:
    task = small_task()
    env, spec = task.vec_env(**options), task.spec_with(**options)
    first = {"spec": spec, "first_range": 5.0, "first_std": 0.25}
    model = PPO(RangePolicy, env, policy_kwargs=first, device="cpu", seed=0)
    options = {**task.options, **options, "per_agent": True}
    played = rollout(SMALL, SB3Policy(model), TUNING[:20], **options).min_mean_distance
    np.testing.assert_array_equal(played, rollout(SMALL, "fixed:5", TUNING[:20], **options).min_mean_distance)
    if not options.get("range_grid"):
        rows, half = (
            np.repeat(env.reset(), 2000, axis=0),
            np.ptp([env.action_space.low, env.action_space.high]) / 2,
        )
        drawn, _ = model.predict(rows, deterministic=False)
        assert np.std(drawn) == pytest.approx(0.25 * half, rel=0.03)  # 4 standard errors of 12,000 draws
        del first["first_std"]
        squashed = {"first_range": 5.0, "squash_output": True, "log_std_init": -9.0}
        for use_sde, given, told in (
            (True, squashed, ""),
            (True, squashed | {"first_range": 0.0}, "first_range: .* ends, which squash_output"),
            (True, squashed | {"first_range": 20.0}, "first_range: .* ends, which squash_output"),
            (True, {"first_std": 0.6}, "first_std: expected None with log_std_init or use_sde"),
            (False, {"first_std": 0.6, "log_std_init": -9.0}, "first_std: expected None with log_std_init"),
        ):
            make = partial(PPO, RangePolicy, env, use_sde=use_sde, policy_kwargs=first | given, device="cpu")
            if told:
                with pytest.raises(InputError, match=told):
                    make()
            else:
                drawn, _ = make().predict(rows, deterministic=False)
                np.testing.assert_allclose(spec.actions.to_ranges(drawn, len(rows)), 5.0, atol=0.1)
    for field, value in (("first_range", 20.5), ("first_range", "far"), ("first_std", 0.0), ("spec", None)):
        wrong = {**first, field: tasks["one-range"].policy_spec if field == "spec" else value}
        with pytest.raises(InputError, match="interaction_range" if value == 20.5 else field):
            PPO(RangePolicy, env, policy_kwargs=wrong, device="cpu")


def test_a_scorer_of_candidates_is_stored_as_it_chooses(tmp_path: Path) -> None:
    grid = (0.0, 5.0, 10.0)
    options = {"profile_ranges": grid, "extra_entries": ("escape_direction",)}
    options |= {"action_mode": "discrete", "range_grid": grid}
    seen = {"inputs": ("speed",), "candidate_inputs": ("velocity_left", "escape_cosine", "range")}
    scorer = {"policy": "flockesc_env.sb3:ScorerPolicy", "policy_kwargs": {"net_arch": [8], **seen}}
    run = small_run(tmp_path / "run", options=options, learning_rate=0.05, **scorer)
    policy: Any = load_policy(train(run))
    model: Any = sb3.algorithm_of(run).load(run.folder / "best_model.zip", device="cpu")
    spec, scores = run.policy_spec, model.policy.mlp_extractor
    observations = np.random.default_rng(0).normal(size=(500, len(spec.layout.names))).astype(np.float32)
    expected, _ = model.predict(observations, deterministic=True)
    actions = policy.with_options(**asdict(spec.options)).act(observations, spec)
    ranges = np.tile(scores._ranges, (len(observations), 1))
    candidates = np.hstack([observations, ranges])[:, scores._columns]
    assert choose_alike(scores.policy_net, candidates, actions, expected)


class _Stop(sb3.Evaluation):
    """Interrupts training after some calls of ``env.step``."""

    def _on_step(self) -> bool:
        if self.n_calls == 14:
            raise KeyboardInterrupt
        return super()._on_step()


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_an_interrupted_run_goes_on_from_its_last_checkpoint(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, whole = (small_run(tmp_path / name, algorithm, num_evaluations=7) for name in ("run", "whole"))
    with monkeypatch.context() as patch:
        patch.setattr(sb3, "Evaluation", _Stop)
        with pytest.raises(KeyboardInterrupt, match="--resume continues"):
            train(run)
    with pytest.raises(InputError, match="run: expected a new folder, or --resume"):
        train(run)
    before, log = run.load_checkpoint()[0], (run.folder / "progress.csv").read_bytes()
    (run.folder / "best_model.zip").write_bytes(b"of an evaluation after the checkpoint")
    train(run, resume=True)
    train(whole)
    measured, uninterrupted = (json.loads((one.folder / "run.json").read_text()) for one in (run, whole))
    kept = [list(point) for point in before.curve]
    assert measured["curve"][: len(kept)] == kept != uninterrupted["curve"]
    assert [samples for samples, _ in measured["curve"]] == [point[0] for point in uninterrupted["curve"]]
    assert measured["cpu_seconds"] > before.cpu_seconds
    assert (run.folder / "progress.csv").read_bytes() == log
    for name in ("samples", "evaluations"):
        assert measured[name] == uninterrupted[name]
    with pytest.raises(InputError, match="run: expected a folder without a finished run"):
        train(run, resume=True)


def test_training_is_reproducible(tmp_path: Path) -> None:
    one, same, other = (
        load_policy(train(small_run(tmp_path / f"{at}", seed=seed, learning_rate=0.01)))
        for at, seed in enumerate((0, 0, 1))
    )
    np.testing.assert_array_equal(one.parameters, same.parameters)
    assert not np.array_equal(one.parameters, other.parameters)


@pytest.mark.parametrize(("task", "name"), TABLES)
def test_the_tables_have_hyperparameters_that_their_algorithms_take(task: str, name: str) -> None:
    run = Run.of(task, name, 0, Path("nowhere"))
    assert run.learner.num_steps == 0 or run.task.scenario.replace(num_steps=run.learner.num_steps)
    match run.learner.algorithm:
        case "search":
            args: Any = hyperparameters_of(run, SearchArguments)
            assert {*args.inputs} <= {*run.policy_spec.layout.names}
        case "imitation":
            args = hyperparameters_of(run, ImitationArguments)
            assert {*args.inputs} <= {*run.policy_spec.layout.names}
        case "gradient":
            gradient = pytest.importorskip("training.gradient", reason="the extra jax is not installed")
            assert hyperparameters_of(run, gradient.GradientArguments).updates
        case "rule":
            assert hyperparameters_of(run, RuleArguments).rounds
        case _:
            found = run.task.hyperparameters(name)
            assert {*found} <= {*inspect.signature(sb3.algorithm_of(run)).parameters}
            assert run.task.vec_env(1, learner=name).num_envs == run.policy_spec.rows


@pytest.mark.parametrize("task", tasks.values(), ids=tasks)
def test_the_lines_of_the_readme_train_on_every_task(task: Any) -> None:
    short = {"n_steps": 2, "batch_size": 2 * task.policy_spec.rows}
    model = PPO(env=task.vec_env(num_flocks=1), device="cpu", **task.hyperparameters("ppo") | short)
    assert model.learn(1).num_timesteps == short["batch_size"]
    options = model.get_env().get_attr("options")[0]
    assert options == dataclasses.replace(options, **task.learner("ppo").options)
    assert task.compare(model, num_flocks=2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"learning_rat": 1e-3},
            "ppo.hyperparameters.learning_rat: expected arguments of PPO: learning_rate, n_steps, batch_size",
        ),
        ({"options": {"max_rang": 3.0}}, "max_rang"),
    ],
)
def test_a_bad_table_is_refused_before_anything_is_written(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    run = small_run(tmp_path / "run", **changes)
    with pytest.raises(InputError, match=message):
        train(run)
    learner = msgspec.structs.replace(run.learner, algorithm="PPOO")
    with pytest.raises(InputError, match=r"ppo.algorithm: expected search, imitation or one of A2C, "):
        train(dataclasses.replace(run, learner=learner))
    assert not (tmp_path / "run").exists()


def test_an_unknown_learner_or_field_lists_the_known_ones() -> None:
    with pytest.raises(
        InputError, match=r"learner: expected one of ppo, .* \(did you mean ppo or ppo-10x\?\)"
    ):
        tasks["one-range"].hyperparameters("pp0")
    with pytest.raises(InputError, match="python -m training train one-range --learner search runs"):
        tasks["one-range"].hyperparameters("search")
    with pytest.raises(InputError, match=r"a\.toml: expected tables with .*unknown field `seed`"):
        read_learners({"ppo": {"algorithm": "PPO", "seed": 3}}, "a.toml")
    assert read_learners({"ppo": {"algorithm": "PPO"}}, "a.toml") == {"ppo": Learner(algorithm="PPO")}
