"""Own learners: a generation plays as its policies do, imitation learns the better candidate, runs resume."""

import dataclasses
import json
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pytest
from small_runs import SMALL, small_run, small_task

from flockesc_env import InputError, load_policy, simulate
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.policies import Architecture, WinStayLoseShift
from flockesc_env.taskset.learners import Learner
from training.families import Networks, Rules, rules_of
from training.imitation import ImitationArguments, ImitationRounds, fit
from training.rule_search import RuleRounds
from training.run import Run
from training.train import train

SEEDS = [4, 5]
INPUTS = ("time", "predator_sensed", "predator_direction_ahead", "predator_direction_left")
OPTIONS = {
    "max_range": 30.0,
    "predator_sensing_range": 30.0,
    "steps_per_action": 1,
    "extra_entries": ("closest_approach", "escape_direction"),
}
FAMILIES = {
    "networks": lambda run: Networks(run, Architecture(INPUTS, memory=2)),
    "linear networks": lambda run: Networks(run, Architecture(INPUTS, ())),
    "stubborn-witnesses": lambda run: Rules(run, "stubborn-witnesses"),
    "win-stay-lose-shift": lambda run: Rules(run, "win-stay-lose-shift"),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_a_generation_plays_as_its_policies_do(name: str, tmp_path: Path) -> None:
    run = small_run(tmp_path / "run", "search", options=OPTIONS)
    family: Any = FAMILIES[name](run)
    vectors = np.random.default_rng(0).normal(size=(3, family.size))
    for _ in range(2):  # the second run starts without the memory of the first
        together, num_actions = family.play(vectors, SEEDS)
        alone = np.array([run.objectives(family.policy(vector), SEEDS) for vector in vectors])
        np.testing.assert_array_equal(together, alone)
    assert len(set(alone.ravel().round(3))) >= 3
    assert num_actions == 6 * SMALL.num_agents * SMALL.num_steps


def search(folder: Path, *, seed: int = 0, options: Any = None, **changes: Any) -> Run:
    small = {"inputs": INPUTS, "hidden": (3,), "memory": 1, "generations": 2}
    return small_run(folder, "search", seed=seed, options=options, **{**small, **changes})


def curve(run: Run) -> list[tuple[int, float]]:
    return json.loads((run.folder / "run.json").read_text())["curve"]


def stop(*_: Any) -> None:
    raise KeyboardInterrupt


def test_a_search_for_a_rule_keeps_the_better_half_with_the_numbers_that_are_best_on_tuning_flocks(
    tmp_path: Path,
) -> None:
    run = small_run(tmp_path / "run", "rule")
    rounds = RuleRounds(run)
    judged, left = [], []

    def judge(rounds: RuleRounds) -> None:
        before = [one.name for one in rounds._left]
        RuleRounds.add_point(rounds)
        judged.append(first_seeds(TUNING, 40 // (2 * len(before))))
        left.append([one.name for one in rounds._left])

    rounds.add_point = lambda: judge(rounds)  # type: ignore[method-assign]
    found = load_policy(rounds.train())
    assert [len(names) for names in left] == [4, 2]
    assert set(left[1]) < set(left[0]) < {"fixed", *rules_of(run.task)}
    best = [run.objectives(found, judged[1]).mean(), curve(run)[-1][1]]
    assert best[0] == best[1]
    by_hand = [run.objectives(Rules(run, name).policy(np.zeros(5)), judged[1]).mean() for name in left[1]]
    assert best[0] >= max(by_hand)
    assert run.task.setup(found).options.extra_entries == ()
    measured = json.loads((run.folder / "run.json").read_text())
    assert measured["episodes"] + measured["evaluations"] <= 4 * 84 + 2 * 40


@pytest.mark.parametrize("steps", [1, 2, 4])
def test_a_pause_lasts_seconds_at_every_rate(steps: int) -> None:
    """An agent that lost listens again after the pause: it is below the threshold all the time."""
    flock = SMALL.replace(num_steps=32)
    rule = WinStayLoseShift(30.0, 30.0, 2.0, 0.4, criterion="estimated_escape_direction")
    options: dict[str, Any] = {"predator_sensing_range": np.inf, "steps_per_action": steps}
    ranges = simulate(flock, policy=rule, seed=3, **options).interaction_ranges
    silent = "".join("l" if rho else "s" for rho in ranges[:, 0]).strip("s").split("l")
    assert {len(part) for part in silent if part} == {round(0.4 / flock.time_step)}


@pytest.mark.parametrize("algorithm", ["search", "gradient", "imitation", "rule"])
def test_a_resumed_run_ends_as_one_that_nobody_interrupts(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if algorithm == "gradient":
        pytest.importorskip("optax", reason="the extra jax is not installed")
    whole = load_policy(train(small_run(tmp_path / "whole", algorithm)))
    module = {"rule": "rule_search"}.get(algorithm, algorithm)
    kind: Any = resolve_name(f"training.{module}:{algorithm.title()}Rounds")
    run = small_run(tmp_path / "cut", algorithm)
    round_ = kind.round
    with monkeypatch.context() as patch:
        patch.setattr(kind, "round", lambda rounds: stop() if rounds.completed == 3 else round_(rounds))
        with pytest.raises(KeyboardInterrupt, match=r"2 of 4 rounds are saved in .*; --resume"):
            train(run)
    with pytest.raises(InputError, match="run: expected a new folder, or --resume"):
        train(run)
    with pytest.raises(InputError, match=r"run: expected the task, learner, seed .*, got others"):
        train(dataclasses.replace(run, seed=1), resume=True)
    resumed = load_policy(train(run, resume=True))
    assert resumed.parameters.tobytes() == whole.parameters.tobytes()
    assert curve(run) == curve(small_run(tmp_path / "whole", algorithm))


@pytest.mark.parametrize("algorithm", ["search", "PPO"])
@pytest.mark.parametrize(
    ("file", "damage", "message"),
    [
        ("checkpoint.pickle", lambda whole: whole[: len(whole) // 2], "a damaged one"),
        (
            "checkpoint.pickle",
            lambda whole: whole[:400] + bytes([whole[400] ^ 1]) + whole[401:],
            "a damaged one",
        ),
        ("checkpoint.pickle", lambda whole: bytes(len(whole)), "a damaged one"),
        ("config.json", lambda _: b"{", "expected the record of a run"),
        ("config.json", lambda _: b"[" * 100_000, "expected the record of a run, got nested too deeply"),
    ],
)
def test_a_damaged_file_of_a_run_is_named(
    algorithm: str, file: str, damage: Any, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = small_run(tmp_path / "run", algorithm)
    with monkeypatch.context() as patch:
        patch.setattr(Run, "finish", stop)
        with pytest.raises(KeyboardInterrupt):
            train(run)
    path = run.folder / file
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=message) as caught:
        train(run, resume=True)
    assert caught.value.field == str(path)


RANGES = (0.0, 5.0, 10.0)
NAMES = ["polarization", "mean_distance", "heading_away"]


@pytest.mark.parametrize("objective", ["min_mean_distance", "min_min_distance"])
def test_values_equal_single_episodes(
    tmp_path: Path, objective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each flock is played again in an environment of its own, up to where it was copied and to the end."""
    monkeypatch.setattr("training.imitation.EXPLORATION", 0.0)
    run = small_run(tmp_path / "run", "imitation", branches=3)
    task = small_task("one-range" if objective == "min_mean_distance" else "one-range-minimum")
    run = dataclasses.replace(run, task=task)
    visitor, teacher = load_policy("listen-while-fleeing"), load_policy("fixed:5")
    flocks = range(100, 104)
    rounds = ImitationRounds(run)
    rng = np.random.default_rng(2)
    actions_before = set()
    for _ in range(6):
        seen, values, num_actions = rounds.values(visitor, teacher, flocks, rng)
        taken = 0
        assert (np.isfinite(values).sum(axis=1) == 3).all()
        for flock, row, expected in zip(flocks, seen, values, strict=True):
            before = []
            for k in np.flatnonzero(np.isfinite(expected)):
                env = task.env()
                spec = env.policy_spec
                observation, _ = env.reset(seed=flock)
                count, has_ended = 0, False
                while not np.array_equal(observation, row):
                    observation, *_ = env.step(visitor.act(observation[np.newaxis], spec)[0])
                    count += 1
                before.append(count)
                action = spec.actions.from_ranges(np.array(RANGES[k : k + 1]))[0]
                while not has_ended:
                    observation, *_, has_ended, info = env.step(action)
                    action = teacher.act(observation[np.newaxis], spec)[0]
                    taken += 1
                assert info[task.spec.name] == expected[k]
            assert len(set(before)) == 1
            actions_before.add(before[0])
            taken += before[0]
        assert np.ptp(values[np.isfinite(values)]) > 0
        assert num_actions == taken
    assert len(actions_before) > 1


@pytest.mark.parametrize("hidden", [(), (8,)])
def test_the_network_sets_the_better_candidate(hidden: tuple[int, ...], tmp_path: Path) -> None:
    """The values are those of a candidate's entry plus what depends on the flock alone."""
    args = ImitationArguments(
        teacher="fixed:5",
        ranges=RANGES,
        inputs=("time", *NAMES),
        hidden=hidden,
        epochs=100,
        learning_rate=0.03,
        weight_decay=0.01,
    )
    spec = small_run(tmp_path / "run", "imitation").policy_spec
    rng = np.random.default_rng(0)
    shape = (400, len(spec.layout.names))
    known, unseen = (0.5 + 0.1 * rng.normal(size=shape).astype(np.float32) for _ in range(2))
    columns = [spec.layout.index(name) for name in NAMES]
    values = 70 + 5 * known[:, columns] + 100 * rng.normal(size=(400, 1))
    values[np.arange(400), rng.integers(len(columns), size=400)] = np.nan
    network = fit(args, spec, known, values, seed=0)
    np.testing.assert_array_equal(network.parameters, fit(args, spec, known, values, seed=0).parameters)
    chosen = spec.actions.to_ranges(network.act(unseen, spec), 400)
    best = np.array(RANGES)[unseen[:, columns].argmax(axis=1)]
    assert np.mean(np.isclose(chosen, best, atol=1e-4)) > 0.9


def test_imitation_refuses_what_it_cannot_learn(tmp_path: Path) -> None:
    run = dataclasses.replace(small_run(tmp_path / "run", "imitation"), task=small_task("per-agent-visible"))
    with pytest.raises(InputError, match="task: expected one range for a flock, got per-agent-visible"):
        ImitationRounds(run)
    learner = Learner(algorithm="imitation", hyperparameters={"ranges": [1.0]})
    with pytest.raises(InputError, match=r"imitation\.hyperparameters: .* missing required field `teacher`"):
        ImitationRounds(dataclasses.replace(run, learner=learner))
