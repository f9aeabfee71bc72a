"""The search: parts between restarts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from cmaes import CMA
from numpy.typing import NDArray
from small_runs import small_run

from training import search
from training.config import SearchArgs, Setting
from training.families import Networks, family_of
from training.train import train


def test_a_restart_draws_from_the_first_distribution_on_new_flocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[NDArray[np.float64], list[int]]] = []

    class Recorded(Networks):
        def play(
            self, setting: Setting, vectors: NDArray[np.float64], seeds: Sequence[int]
        ) -> tuple[NDArray[np.float64], int]:
            drawn.append((vectors, list(seeds)))
            return super().play(setting, vectors, seeds)

    args = small_run(tmp_path / "run", "search", generations=6, restarts=2, final_flocks=8)
    assert isinstance(args, SearchArgs)
    family = family_of(args)
    assert isinstance(family, Networks)
    monkeypatch.setattr(search, "family_of", lambda _: Recorded(family.architecture))
    train(args)
    fresh = CMA(np.zeros(family.size), args.step_size, population_size=args.population, seed=args.seed)
    fresh.reseed_rng(int(np.random.SeedSequence([args.seed, 3]).generate_state(1)[0]))
    np.testing.assert_array_equal(drawn[3][0], [fresh.ask() for _ in range(args.population)])
    assert [len(flocks) for _, flocks in drawn] == [2, 3, 5] * 2
    flocks = [flock for _, flocks in drawn for flock in flocks]
    assert len(set(flocks)) == len(flocks)
