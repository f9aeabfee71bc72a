"""Policies of a generation play as each does alone; searches start, restart and resume."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cmaes import CMA
from numpy.typing import NDArray
from small_runs import SMALL, small_run

from flockesc_env import load_policy
from flockesc_env.common.errors import InputError
from flockesc_env.policies import Architecture, WinStayLoseShift
from training.families import Family, Networks, Rules
from training.imitation import ImitationRounds
from training.run import Run
from training.search import SearchRounds
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
    family: Family = FAMILIES[name](run)
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
    found: list[tuple[int, float]] = json.loads((run.folder / "run.json").read_text())["curve"]
    return found


def test_a_search_of_a_rule_begins_with_parameters_chosen_by_hand(tmp_path: Path) -> None:
    own = {"extra_entries": ("closest_approach",), "steps_per_action": 1, "max_range": 100.0}
    run = search(tmp_path / "run", rule="win-stay-lose-shift", step_size=1e-12, options=own)
    found = load_policy(train(run))
    assert isinstance(found, WinStayLoseShift)
    np.testing.assert_allclose(found.parameters, WinStayLoseShift().parameters)
    assert curve(run)[0][0] == 0


def test_a_restart_draws_from_the_first_distribution_on_new_flocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[NDArray[np.float64], list[int]]] = []
    play = Networks.play

    def recorded(family: Networks, vectors: NDArray[np.float64], seeds: Sequence[int]) -> Any:
        drawn.append((vectors, list(seeds)))
        return play(family, vectors, seeds)

    monkeypatch.setattr(Networks, "play", recorded)
    run = small_run(tmp_path / "run", "search", generations=6, restarts=2, final_flocks=8)
    rounds = SearchRounds(run)
    rounds.train()
    fresh = CMA(np.zeros(rounds._family.size), 0.5, population_size=6, seed=run.seed)
    fresh.reseed_rng(int(np.random.SeedSequence([run.seed, 3]).generate_state(1)[0]))
    np.testing.assert_array_equal(drawn[3][0], [fresh.ask() for _ in range(6)])
    assert [len(flocks) for _, flocks in drawn] == [2, 3, 5] * 2
    flocks = [flock for _, flocks in drawn for flock in flocks]
    assert len(set(flocks)) == len(flocks)


def stop(*_: Any) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("algorithm", ["search", "imitation"])
def test_a_resumed_run_ends_as_one_that_nobody_interrupts(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = load_policy(train(small_run(tmp_path / "whole", algorithm)))
    kind, run = (
        (SearchRounds if algorithm == "search" else ImitationRounds),
        small_run(tmp_path / "cut", algorithm),
    )
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


@pytest.mark.parametrize(
    ("file", "damage", "message"),
    [
        ("checkpoint.pickle", lambda whole: whole[: len(whole) // 2], "a damaged one"),
        (
            "checkpoint.pickle",
            lambda whole: whole[:400] + bytes([whole[400] ^ 1]) + whole[401:],
            "a damaged one",
        ),
        ("config.json", lambda _: b"{", "expected the record of a run"),
    ],
)
def test_a_damaged_file_of_a_run_is_named(
    file: str, damage: Any, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = small_run(tmp_path / "run", "search")
    with monkeypatch.context() as patch:
        patch.setattr(Run, "finish", stop)
        with pytest.raises(KeyboardInterrupt):
            train(run)
    path = run.folder / file
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=message) as caught:
        train(run, resume=True)
    assert caught.value.field == str(path)
