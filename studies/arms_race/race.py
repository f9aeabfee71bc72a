"""The arms race: predators and flock policies trained in turns with CMA-ES, and the cross-play of all."""

import dataclasses
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from cmaes import CMA

from flockesc_env import FlockScenario, NetworkPolicy, rollout, save_policy
from flockesc_env.common.array_files import write_npz, write_table
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.splits import HELD_OUT, TUNING, first_seeds, training_seeds
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models import records
from flockesc_env.policies import BasePolicy, as_policy
from studies.arms_race.opponents import SIZE, Flock, LeadPursuit, NetworkPredator, Predator
from studies.measurements import Key, Runner, split, write_rows
from studies.study import document
from training.cma import growing, maximize
from training.families import Population

SCENARIO: Final = FlockScenario().with_learned_predators()
FIXED: Final = "best fixed range"
LEARNED: Final = {
    "one-range": "scoreboard/imitation/policies/one-range-1.npz",
    "one-range, searched": "scoreboard/search/policies/one-range-1.npz",
    "per agent": "scoreboard/search/policies/per-agent-visible-1.npz",
    "per agent, derived": "results/arms_race/policies/per-agent-derived.npz",
}
"""Files of the learned flock policies from the project's root: the best of their tasks on tuning flocks."""

TRACKS: Final = {"per agent": None, "one-range, searched": "search"}
"""Flock policies that are trained, small networks; the learner of one that is not the best of its task."""

UNTRAINED: Final = ("straight", "nearest", "centroid", "lead")
LEADS: Final = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)  # tried against the best fixed range
LEAD_FLOCKS: Final = 400
FIRST_SEED: Final = 100  # of training runs; the study of learned ranges uses smaller ones
BATCH: Final = 32  # flocks that are stepped together: larger batches leave the cache
CHUNK: Final = 100  # flocks of a job of the cross-play
EPISODE: Final = 5e-3  # estimated seconds

Value = Callable[[FloatArray, range], FloatArray]
"""J_mean in m, shape (k, flocks), by changes of one side's parameters, shape (k, size), and by flocks."""


@dataclass(frozen=True)
class Budget:
    """The size of one training run.

    The number of flocks per vector grows geometrically. The steps are initial standard deviations of
    parameters. The distribution's mean plays the tuning flocks after every ``check_every`` generations.
    """

    population: int = 16
    generations: int = 36
    flocks: int = 4
    final_flocks: int = 10
    predator_step: float = 0.5
    flock_step: float = 0.15
    check_every: int = 12
    tuning_flocks: int = 60

    def schedule(self) -> list[int]:
        """Return the number of flocks per vector in every generation."""
        shares = (generation / self.generations for generation in range(self.generations))
        return [growing(self.flocks, self.final_flocks, share) for share in shares]

    def episodes(self) -> int:
        """Return the number of episodes, those on tuning flocks included."""
        checks = 1 + self.generations // self.check_every
        return self.population * sum(self.schedule()) + checks * self.tuning_flocks


def play(flock: Flock, predator: Predator, flocks: range) -> Arrays:
    """Return J_mean in m of every flock."""
    return {"objective": _played(flock.entry(), predator.policy(SCENARIO), list(flocks))}


def train(kind: str, flock: Flock, predator: Predator, budget: Budget, seed: int) -> Arrays:
    """Train a ``"flock"`` policy, which maximizes J_mean, or a ``"predator"``, which minimizes it.

    The start and the means of the distribution play the tuning flocks; the best of them is returned.

    Returns:
        ``parameters``, shape (size,); ``curve``, J_mean on tuning flocks at every check; ``minutes`` of
        processor time.
    """
    begun = time.process_time()
    start, j_mean = learner(kind, flock, predator)
    sign, step = (1, budget.flock_step) if kind == "flock" else (-1, budget.predator_step)
    optimizer = CMA(np.zeros(len(start)), step, population_size=budget.population, seed=seed)
    tuning = first_seeds(TUNING, budget.tuning_flocks)
    checked = [np.zeros(len(start))]
    curve = [j_mean(checked[0][np.newaxis], tuning).mean()]
    num_played = 0
    for generation, num_flocks in enumerate(budget.schedule(), start=1):
        flocks = training_seeds(seed, num_played, num_flocks)
        maximize(optimizer, lambda changes, flocks: sign * j_mean(changes, flocks), flocks)
        num_played += num_flocks
        if generation % budget.check_every == 0:
            checked.append(optimizer.mean.copy())
            curve.append(j_mean(checked[-1][np.newaxis], tuning).mean())
    best = int(np.argmax(sign * np.array(curve)))
    return {
        "parameters": start + checked[best],
        "curve": np.array(curve),
        "minutes": np.array((time.process_time() - begun) / 60),
    }


def learner(kind: str, flock: Flock, predator: Predator) -> tuple[FloatArray, Value]:
    """Return the parameters of a ``"flock"`` policy or a ``"predator"``, and J_mean against the other side.

    Changes of the parameters are played in groups, so that a call steps ``BATCH`` flocks together. Those of a
    predator change the network that corrects its lead pursuit.
    """
    entry: Any = flock.entry()
    start = entry.parameters if kind == "flock" else predator.parameters or np.zeros(SIZE)
    parameters = np.array(start, np.float64)
    opponent, pursuit = predator.policy(SCENARIO), LeadPursuit(SCENARIO, predator.lead)

    def play_group(group: FloatArray, seeds: list[int]) -> FloatArray:
        if kind == "predator":
            predators: Any = [NetworkPredator(changed, pursuit) for changed in group]
            return _played(entry, Population(predators), seeds)
        networks = Population([NetworkPolicy(entry.architecture, changed) for changed in group])
        played = as_policy(networks).with_options(per_agent=entry.per_agent, **(entry.options or {}))
        return _played(played, opponent, seeds)

    def j_mean(changes: FloatArray, flocks: range) -> FloatArray:
        size = max(1, BATCH // len(flocks))
        groups = np.split(parameters + changes, range(size, len(changes), size))
        played = [play_group(group, list(flocks) * len(group)).reshape(len(group), -1) for group in groups]
        return np.concatenate(played)

    return parameters, j_mean


@dataclass
class _Race:
    """The opponents of a race, those that are trained included, and a row per check of every training run.

    A trained predator has the name of the flock policy that it was trained against.
    """

    runner: Runner
    budget: Budget
    lead: float
    flocks: dict[str, Flock]
    predators: dict[str, Predator]
    trainings: list[dict[str, object]] = field(default_factory=list)

    def train(self, kind: str, starts: Mapping[str, str], seed: int) -> None:
        """Train new flock policies or predators by name, each from its start.

        A flock policy plays the predator with the name of its start, and a predator the flock policy with
        its own name.
        """
        jobs = {}
        for name, start in starts.items():
            flock = self.flocks[start if kind == "flock" else name]
            arguments = (kind, flock, self.predators[start], self.budget, seed)
            jobs[name] = Job(f"{__name__}:train", arguments, self.budget.episodes() * EPISODE)
        for name, found in self.runner.run(jobs, f"Training: {kind}").items():
            parameters = tuple(found["parameters"].tolist())
            if kind == "flock":
                self.flocks[name] = Flock(self.flocks[starts[name]].spec, parameters)
            else:
                self.predators[name] = Predator("lead", self.lead, parameters)
            run = {"kind": kind, "name": name, "minutes": float(found["minutes"])}
            for check, value in enumerate(found["curve"].tolist()):
                self.trainings.append({**run, "measurement": check, "objective": value})


def measure(runner: Runner, output: Path, rounds: int, num_flocks: int, budget: Budget = Budget()) -> None:
    """Train in turns, play all flock policies against all predators on held-out flocks; write the files.

    Each round trains a flock policy of each track against its predator, and then a predator against the new
    policy.
    """
    flocks = {FIXED: Flock("fixed:12"), "stubborn leaders": Flock("stubborn-leaders")}
    flocks |= {name: Flock(file) for name, file in LEARNED.items()}
    tuning, held_out = first_seeds(TUNING, LEAD_FLOCKS), first_seeds(HELD_OUT, num_flocks)
    tried = {lead: (flocks[FIXED], Predator("lead", lead)) for lead in LEADS}
    leads = {lead: float(found.mean()) for lead, found in _play_all(runner, tried, tuning, "Lead").items()}
    lead = min(leads, key=lambda value: leads[value])
    predators = {kind: Predator(kind, lead if kind == "lead" else 0.0) for kind in UNTRAINED}
    race = _Race(runner, budget, lead, flocks, predators)
    race.train("predator", dict.fromkeys(flocks, "lead"), FIRST_SEED)
    newest = {track: track for track in TRACKS}
    for number in range(1, rounds + 1):
        starts = {f"{track}, round {number}": start for track, start in newest.items()}
        race.train("flock", starts, FIRST_SEED + 2 * number - 1)
        race.train("predator", starts, FIRST_SEED + 2 * number)
        newest = dict(zip(newest, starts, strict=True))
    (output / "policies").mkdir(parents=True, exist_ok=True)
    pairs = {
        (name, other): (flock, predator)
        for name, flock in race.flocks.items()
        for other, predator in race.predators.items()
    }
    rows = (
        {"flock_policy": name, "predator": other, "seed": held_out, "objective": values}
        for (name, other), values in _play_all(runner, pairs, held_out, "Cross-play").items()
    )
    write_rows(output / "cross_play.parquet", rows)
    write_table(pl.DataFrame(race.trainings), output / "trainings.parquet")
    _write_policies(race, output / "policies")
    record = {
        "command": f"python -m studies arms-race --rounds {rounds} --num-flocks {num_flocks}",
        "rounds": rounds,
        "tracks": list(TRACKS),
        "held_out_flocks": num_flocks,
        "budget": dataclasses.asdict(budget),
        "episodes_per_training": budget.episodes(),
        "lead_flocks": LEAD_FLOCKS,
        "leads": {f"{value:g}": objective for value, objective in leads.items()},
        "lead": lead,
        "flock_policies": {name: _description(name, flock) for name, flock in race.flocks.items()},
        "versions": records.versions("cmaes"),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
    }
    write_text(output / "arms_race.json", document(record))


def _play_all(
    runner: Runner, pairs: Mapping[Key, tuple[Flock, Predator]], flocks: range, title: str
) -> dict[Key, FloatArray]:
    """Play flock policies against predators; return J_mean in m of every flock by pair."""
    jobs = {
        key: split(play, *pair, flocks=flocks, size=CHUNK, seconds=EPISODE) for key, pair in pairs.items()
    }
    return {key: found["objective"] for key, found in runner.run(jobs, title).items()}


def _write_policies(race: _Race, folder: Path) -> None:
    """Write a policy file per trained flock policy, and the parameters of all trained predators."""
    for name, flock in race.flocks.items():
        if flock.parameters:
            file = folder / f"{name.replace(',', '').replace(' ', '-')}.npz"
            save_policy(flock.entry().with_options(name=name, scenario=SCENARIO), file)
    trained = {name: np.array(one.parameters) for name, one in race.predators.items() if one.parameters}
    write_npz(folder / "predators.npz", trained)


def _description(name: str, flock: Flock) -> dict[str, object]:
    """Return what the report says about a flock policy."""
    entry = flock.entry()
    return {
        "from": flock.spec,
        "learner": TRACKS.get(name),
        "parameters": len(getattr(entry, "parameters", ())),
        "steps_per_action": (entry.options or {})["steps_per_action"],
    }


def _played(entry: BasePolicy, predator: Any, seeds: list[int]) -> FloatArray:
    """Return J_mean in m, shape (seeds,)."""
    episodes = rollout(SCENARIO, entry, seeds, predator_policy=predator, batch_size=BATCH, num_threads=1)
    values: FloatArray = episodes.min_mean_distance
    return values
