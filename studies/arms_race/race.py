"""Run the arms race: training runs in turns, the cross-play of all players, and the files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl
from training.versions import versions

from flockesc_env import Learned, save_policy
from flockesc_env.common.array_files import write_npz, write_table
from flockesc_env.common.files import write_text
from flockesc_env.episodes.splits import HELD_OUT, TUNING, first_seeds
from flockesc_env.jobs import Arrays
from studies.arms_race.evolve import SCENARIO, Budget, play_job, steps_per_action, train_job
from studies.arms_race.players import Flock, Predator
from studies.findings.results import load_study
from studies.measurements import Runner, chunks
from studies.study import document, machine
from studies.tables import rows

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


@dataclass
class Race:
    """Flock policies, predators and training runs so far.

    A trained predator has the name of the flock policy that it was trained against. ``leads`` holds the mean
    J_mean in m of the best fixed range on tuning flocks, by ``lead`` of the pursuit.
    """

    runner: Runner
    flocks: dict[str, Flock]
    predators: dict[str, Predator] = field(default_factory=dict)
    leads: dict[float, float] = field(default_factory=dict)
    trainings: list[dict[str, object]] = field(default_factory=list)

    def choose_predators(self) -> None:
        """Add the predators without training; choose ``lead`` against the best fixed range."""
        tuning = first_seeds(TUNING, LEAD_FLOCKS)
        jobs = {lead: play_job(self.flocks[BEST_FIXED], Predator("lead", lead), tuning) for lead in LEADS}
        found = self.runner.each(jobs, "Lead")
        self.leads = {lead: float(result["objective"].mean()) for lead, result in found.items()}
        best = min(self.leads, key=lambda lead: self.leads[lead])
        for kind in UNTRAINED:
            self.predators[kind] = Predator(kind, best if kind == "lead" else 0.0)

    def train_predators(self, starts: Mapping[str, str], budget: Budget, seed: int) -> None:
        """Train a predator against each flock policy in ``starts``, from the predator named there."""
        jobs = {
            name: train_job("predator", self.flocks[name], self.predators[start], budget, seed)
            for name, start in starts.items()
        }
        for name, result in self.runner.each(jobs, "Predators").items():
            lead = self.predators["lead"].lead
            self.predators[name] = Predator("network", lead, tuple(result["parameters"].tolist()))
            self._note("predator", name, result)

    def train_flocks(self, starts: Mapping[str, str], budget: Budget, seed: int) -> None:
        """Train a new flock policy from each policy named in ``starts``, against that policy's predator."""
        jobs = {
            name: train_job("flock", self.flocks[start], self.predators[start], budget, seed)
            for name, start in starts.items()
        }
        for name, result in self.runner.each(jobs, "Flock policies").items():
            self.flocks[name] = Flock(self.flocks[starts[name]].spec, tuple(result["parameters"].tolist()))
            self._note("flock", name, result)

    def cross_play(self, flocks: range) -> pl.DataFrame:
        """Play every flock policy against every predator on the same flocks; return a row per episode."""
        jobs = {
            (name, other): [play_job(flock, predator, chunk) for chunk in chunks(flocks, CHUNK)]
            for name, flock in self.flocks.items()
            for other, predator in self.predators.items()
        }
        found = self.runner.groups(jobs, "Cross-play")
        return pl.concat(
            rows(flocks, result["objective"], flock_policy=name, predator=other)
            for (name, other), result in found.items()
        )

    def _note(self, kind: str, name: str, result: Arrays) -> None:
        run_of = {"minutes": float(result["minutes"]), "episodes": int(result["episodes"])}
        for at, value in enumerate(result["curve"].tolist()):
            row = {"kind": kind, "name": name, "measurement": at, "objective": value}
            self.trainings.append({**row, **run_of})


@dataclass(frozen=True)
class RaceOptions:
    """The folder of learned ranges, rounds, held-out flocks, and the budget of a training run.

    In each round, a flock policy and then a predator is trained for each of ``tracks``.
    """

    learned: Path = Path("results/findings")
    rounds: int = 3
    num_flocks: int = 1000
    tracks: tuple[str, ...] = TRACKS
    budget: Budget = field(default_factory=Budget)


def arms_race(options: RaceOptions, runner: Runner, output: Path) -> Race:
    """Train in turns, play everybody against everybody, and write the files."""
    race = Race(runner, first_flocks(options.learned))
    race.choose_predators()
    race.train_predators(dict.fromkeys(race.flocks, "lead"), options.budget, FIRST_SEED)
    newest = {track: track for track in options.tracks}
    for number in range(1, options.rounds + 1):
        seed = FIRST_SEED + 2 * number
        names = {f"{track}, round {number}": newest[track] for track in options.tracks}
        race.train_flocks(names, options.budget, seed - 1)
        race.train_predators(names, options.budget, seed)
        newest = dict(zip(options.tracks, names, strict=True))
    table = race.cross_play(first_seeds(HELD_OUT, options.num_flocks))
    _write(race, table, options, output)
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
        flocks[name] = Flock(str(study.file(chosen, seed)))
    return flocks


def _write(race: Race, table: pl.DataFrame, options: RaceOptions, output: Path) -> None:
    """Write the table of the cross-play, the training runs, the trained policies and the record."""
    folder = output / "policies"
    folder.mkdir(parents=True, exist_ok=True)
    write_table(table, output / CROSS_PLAY_FILE)
    write_table(pl.DataFrame(race.trainings), output / TRAININGS_FILE)
    for name, flock in race.flocks.items():
        if flock.parameters:
            entry = dataclasses.replace(flock.entry(), name=name, scenario=SCENARIO)
            save_policy(entry, folder / f"{name.replace(',', '').replace(' ', '-')}.npz")
    trained = {name: np.array(p.parameters) for name, p in race.predators.items() if p.parameters}
    write_npz(folder / "predators.npz", trained)
    (predator,) = (each for each in SCENARIO.predators if isinstance(each, Learned))
    record = {
        "command": f"python -m studies arms-race --rounds {options.rounds} --num-flocks {options.num_flocks}",
        "rounds": options.rounds,
        "tracks": options.tracks,
        "held_out_flocks": options.num_flocks,
        "first_seed": FIRST_SEED,
        "budget": dataclasses.asdict(options.budget),
        "episodes_per_training": options.budget.episodes,
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
        "machine": machine(),
    }
    write_text(output / RECORD_FILE, document(record))


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
