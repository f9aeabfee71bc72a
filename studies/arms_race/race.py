"""Run the arms race: training runs in turns, the cross-play of all players, and the files."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from flockesc_env import save_policy
from flockesc_env.common.array_files import write_npz, write_table
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from studies.arms_race.evolve import SCENARIO, STEPS_PER_ACTION, Budget, flock_job, play_job, predator_job
from studies.arms_race.players import Flock, Predator
from training.seeds import HELD_OUT, first_seeds
from training.versions import versions

BEST_FIXED, LEADERS, SHARED, PER_AGENT = "best fixed range", "stubborn leaders", "shared", "per agent"
"""Flock policies before the first round."""

SETTINGS: Final = {SHARED: "shared", PER_AGENT: "per-agent-visible"}
"""Study of learned ranges that each learned policy is from."""

TRACKS: Final = (PER_AGENT, SHARED)
"""Flock policies that are trained in turns with a predator."""

UNTRAINED: Final = {
    "straight": Predator("straight"),
    "nearest": Predator("nearest"),
    "centroid": Predator("centroid"),
}
"""Predators without training: straight flight, and pursuit of the nearest agent and of the centroid."""

FIRST_SEED: Final = 100
"""Seed of the first training runs; the study of learned ranges uses smaller ones."""

CHUNK: Final = 100
"""Flocks of a job of the cross-play."""

CROSS_PLAY_FILE, TRAININGS_FILE, RECORD_FILE = "cross_play.parquet", "trainings.parquet", "arms_race.json"

Runs = Callable[[list[Job], str], list[Arrays]]
"""Runs jobs under a title and returns their results."""


@dataclass
class Race:
    """Flock policies, predators and training runs so far.

    Attributes:
        flocks: flock policies by name.
        predators: by name; a trained one has the name of the flock policy that it was trained against.
        trainings: a row per measurement of a training run on tuning flocks.
    """

    flocks: dict[str, Flock]
    predators: dict[str, Predator] = field(default_factory=lambda: dict(UNTRAINED))
    trainings: list[dict[str, object]] = field(default_factory=list)

    def train_predators(self, starts: Mapping[str, str], budget: Budget, seed: int, runs: Runs) -> None:
        """Train a predator against each flock policy in ``starts``, from the predator named there."""
        jobs = [
            predator_job(self.flocks[name], self.predators[start], budget, seed)
            for name, start in starts.items()
        ]
        for name, result in zip(starts, runs(jobs, "Predators"), strict=True):
            self.predators[name] = Predator("network", tuple(result["parameters"].tolist()))
            self._note("predator", name, result)

    def train_flocks(self, starts: Mapping[str, str], budget: Budget, seed: int, runs: Runs) -> None:
        """Train a new flock policy from each policy named in ``starts``, against that policy's predator."""
        jobs = [
            flock_job(self.flocks[start], self.predators[start], budget, seed) for start in starts.values()
        ]
        for (name, start), result in zip(starts.items(), runs(jobs, "Flock policies"), strict=True):
            self.flocks[name] = Flock(self.flocks[start].spec, tuple(result["parameters"].tolist()))
            self._note("flock", name, result)

    def cross_play(self, flocks: range, runs: Runs) -> pl.DataFrame:
        """Play every flock policy against every predator on the same flocks; return a row per episode."""
        chunks = [flocks[start : start + CHUNK] for start in range(0, len(flocks), CHUNK)]
        cells = [(name, other, chunk) for name in self.flocks for other in self.predators for chunk in chunks]
        jobs = [play_job(self.flocks[name], self.predators[other], chunk) for name, other, chunk in cells]
        results = zip(cells, runs(jobs, "Cross-play"), strict=True)
        return pl.concat(
            pl.DataFrame({"flock_policy": name, "predator": other, "seed": chunk, **result})
            for (name, other, chunk), result in results
        )

    def _note(self, kind: str, name: str, result: Arrays) -> None:
        """Add the rows of a training run; a predator has the name of the policy it was trained against."""
        run_of = {"minutes": float(result["minutes"]), "episodes": int(result["episodes"])}
        for at, value in enumerate(result["curve"].tolist()):
            row = {"kind": kind, "name": name, "measurement": at, "objective": value}
            self.trainings.append({**row, **run_of})


@dataclass(frozen=True)
class RaceArgs:
    """Arguments of ``arms_race``.

    Attributes:
        output: folder of the results.
        learned: folder of the studies of learned ranges.
        rounds: number of rounds; in each, a flock policy and then a predator is trained.
        num_flocks: number of held-out flocks of the cross-play.
        tracks: flock policies that are trained in turns, some of ``TRACKS``.
        budget: size of a training run.
    """

    output: Path = Path("results/arms_race")
    learned: Path = Path("results/learned")
    rounds: int = 3
    num_flocks: int = 1000
    tracks: tuple[str, ...] = TRACKS
    budget: Budget = field(default_factory=Budget)


def arms_race(args: RaceArgs, backend: Backend, *, cache: Path | None = None, progress: bool = False) -> Race:
    """Train in turns, play everybody against everybody, and write the files.

    Called again after an interrupt, it continues where it stopped and ends with the same bytes.

    Args:
        args: the arguments.
        backend: where the jobs run.
        cache: folder of finished jobs; default: ``cache`` in the output folder.
        progress: whether to show the progress bar even if stderr is not a terminal.

    Raises:
        JobError: if jobs failed.
    """
    kept = Cache(cache or args.output / "cache")

    def runs(jobs: list[Job], title: str) -> list[Arrays]:
        return run(jobs, kept, backend, title=title, progress=progress)

    race = Race(first_flocks(args.learned))
    race.train_predators(dict.fromkeys(race.flocks, "centroid"), args.budget, FIRST_SEED, runs)
    newest = {track: track for track in args.tracks}
    for number in range(1, args.rounds + 1):
        seed = FIRST_SEED + 2 * number
        names = {f"{track}, round {number}": newest[track] for track in args.tracks}
        race.train_flocks(names, args.budget, seed - 1, runs)
        race.train_predators(names, args.budget, seed, runs)
        newest = dict(zip(args.tracks, names, strict=True))
    table = race.cross_play(first_seeds(HELD_OUT, args.num_flocks), runs)
    _write(race, table, args)
    return race


def first_flocks(learned: Path) -> dict[str, Flock]:
    """Return the flock policies before the first round; of the learned ones, the best on tuning flocks."""
    fixed = json.loads((learned / SETTINGS[SHARED] / "study.json").read_text())["best_fixed_range"]
    flocks = {BEST_FIXED: Flock(f"fixed:{fixed:g}"), LEADERS: Flock("stubborn-leaders")}
    for name, setting in SETTINGS.items():
        curves = pl.read_parquet(learned / setting / "curves.parquet").filter(learner="search")
        best = curves.sort("objective", "training_seed", descending=[True, False]).row(0, named=True)
        flocks[name] = Flock(str(learned / setting / "policies" / f"search-{best['training_seed']}.npz"))
    return flocks


def _write(race: Race, table: pl.DataFrame, args: RaceArgs) -> None:
    """Write the table of the cross-play, the training runs, the trained policies and the record."""
    folder = args.output / "policies"
    folder.mkdir(parents=True, exist_ok=True)
    write_table(table, args.output / CROSS_PLAY_FILE)
    write_table(pl.DataFrame(race.trainings), args.output / TRAININGS_FILE)
    for name, flock in race.flocks.items():
        if flock.parameters:
            entry = dataclasses.replace(flock.entry(), name=name, scenario=SCENARIO)
            save_policy(entry, folder / f"{name.replace(', ', '-').replace(' ', '-')}.npz")
    trained = {name: np.array(p.parameters) for name, p in race.predators.items() if p.parameters}
    write_npz(folder / "predators.npz", trained)
    record = {
        "command": f"python -m studies arms-race --rounds {args.rounds} --num-flocks {args.num_flocks}",
        "rounds": args.rounds,
        "tracks": args.tracks,
        "held_out_flocks": args.num_flocks,
        "first_seed": FIRST_SEED,
        "steps_per_action": STEPS_PER_ACTION,
        "budget": dataclasses.asdict(args.budget),
        "episodes_per_training": args.budget.episodes,
        "flock_policies": {name: flock.spec for name, flock in race.flocks.items()},
        "versions": versions(),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
    }
    write_text(args.output / RECORD_FILE, json.dumps(record, indent=1) + "\n")
