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

from flockesc_env import Learned, save_policy
from flockesc_env.common.array_files import write_npz, write_table
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from studies.arms_race.evolve import SCENARIO, Budget, flock_job, play_job, predator_job, steps_per_action
from studies.arms_race.players import Flock, Predator
from studies.learned.results import POLICIES, load_study
from training.seeds import HELD_OUT, TUNING, first_seeds
from training.versions import versions

BEST_FIXED, LEADERS = "best fixed range", "stubborn leaders"
SHARED, SMALL_SHARED, PER_AGENT, DERIVED = "shared", "shared, searched", "per agent", "per agent, derived"
"""Flock policies before the first round."""

LEARNED: Final = {
    SHARED: ("shared", None),
    SMALL_SHARED: ("shared", "search"),
    PER_AGENT: ("per-agent-visible", None),
    DERIVED: ("per-agent-visible-derived", None),
}
"""Study and learner of each learned flock policy; ``None``: the study's best learner on tuning flocks."""

TRACKS: Final = (PER_AGENT, SMALL_SHARED)
"""Flock policies that are trained in turns with a predator: small networks."""

UNTRAINED: Final = ("straight", "nearest", "centroid", "lead")
"""Predators without training: see ``Predator.kind``."""

LEADS: Final = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
"""Values of ``lead`` that are tried against the best fixed range."""

LEAD_FLOCKS: Final = 400
"""Tuning flocks on which ``lead`` is chosen."""

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
        leads: mean J_mean in m of the best fixed range on tuning flocks, by ``lead`` of the pursuit.
        trainings: a row per measurement of a training run on tuning flocks.
    """

    flocks: dict[str, Flock]
    predators: dict[str, Predator] = field(default_factory=dict)
    leads: dict[float, float] = field(default_factory=dict)
    trainings: list[dict[str, object]] = field(default_factory=list)

    def choose_predators(self, runs: Runs) -> None:
        """Add the predators without training; choose ``lead`` against the best fixed range."""
        tuning = first_seeds(TUNING, LEAD_FLOCKS)
        jobs = [play_job(self.flocks[BEST_FIXED], Predator("lead", lead), tuning) for lead in LEADS]
        results = zip(LEADS, runs(jobs, "Lead"), strict=True)
        self.leads = {lead: float(result["objective"].mean()) for lead, result in results}
        best = min(self.leads, key=lambda lead: self.leads[lead])
        for kind in UNTRAINED:
            self.predators[kind] = Predator(kind, best if kind == "lead" else 0.0)

    def train_predators(self, starts: Mapping[str, str], budget: Budget, seed: int, runs: Runs) -> None:
        """Train a predator against each flock policy in ``starts``, from the predator named there."""
        jobs = [
            predator_job(self.flocks[name], self.predators[start], budget, seed)
            for name, start in starts.items()
        ]
        for name, result in zip(starts, runs(jobs, "Predators"), strict=True):
            lead = self.predators["lead"].lead
            self.predators[name] = Predator("network", lead, tuple(result["parameters"].tolist()))
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
    race.choose_predators(runs)
    race.train_predators(dict.fromkeys(race.flocks, "lead"), args.budget, FIRST_SEED, runs)
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
    studies = {setting: load_study(learned / setting) for setting, _ in LEARNED.values()}
    fixed = studies["shared"].best_fixed_range
    flocks = {BEST_FIXED: Flock(f"fixed:{fixed:g}"), LEADERS: Flock("stubborn-leaders")}
    for name, (setting, learner) in LEARNED.items():
        study = studies[setting]
        chosen = learner or study.best_learner
        _, seed = max((value, seed) for (each, seed), value in study.tuned.items() if each == chosen)
        flocks[name] = Flock(str(learned / setting / POLICIES / f"{chosen}-{seed}.npz"))
    return flocks


def file_name(flock: str) -> str:
    """Return the file name, without suffix, of a trained flock policy."""
    return flock.replace(",", "").replace(" ", "-")


def _write(race: Race, table: pl.DataFrame, args: RaceArgs) -> None:
    """Write the table of the cross-play, the training runs, the trained policies and the record."""
    folder = args.output / "policies"
    folder.mkdir(parents=True, exist_ok=True)
    write_table(table, args.output / CROSS_PLAY_FILE)
    write_table(pl.DataFrame(race.trainings), args.output / TRAININGS_FILE)
    for name, flock in race.flocks.items():
        if flock.parameters:
            entry = dataclasses.replace(flock.entry(), name=name, scenario=SCENARIO)
            save_policy(entry, folder / f"{file_name(name)}.npz")
    trained = {name: np.array(p.parameters) for name, p in race.predators.items() if p.parameters}
    write_npz(folder / "predators.npz", trained)
    (predator,) = (each for each in SCENARIO.predators if isinstance(each, Learned))
    record = {
        "command": f"python -m studies arms-race --rounds {args.rounds} --num-flocks {args.num_flocks}",
        "rounds": args.rounds,
        "tracks": args.tracks,
        "held_out_flocks": args.num_flocks,
        "first_seed": FIRST_SEED,
        "budget": dataclasses.asdict(args.budget),
        "episodes_per_training": args.budget.episodes,
        "predator": {
            "max_speed": predator.max_speed,
            "max_acceleration": predator.max_acceleration,
            "agent_speed": SCENARIO.speed,
        },
        "lead_flocks": LEAD_FLOCKS,
        "leads": {f"{lead:g}": value for lead, value in race.leads.items()},
        "lead": race.predators["lead"].lead,
        "flock_policies": {name: _described(name, flock) for name, flock in race.flocks.items()},
        "versions": versions(),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
    }
    write_text(args.output / RECORD_FILE, json.dumps(record, indent=1) + "\n")


def _described(name: str, flock: Flock) -> dict[str, object]:
    """Return where a flock policy is from, its number of parameters and its steps per action."""
    entry = flock.entry()
    _, learner = LEARNED.get(name, ("", None))
    return {
        "from": flock.spec,
        "learner": learner,
        "parameters": len(getattr(entry.policy, "parameters", ())),
        "steps_per_action": steps_per_action(entry),
    }
