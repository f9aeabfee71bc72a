"""The arms race: predators and flock policies trained in turns with CMA-ES, and the cross-play of all."""

from __future__ import annotations

import dataclasses
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

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
from studies.measurements import Runner, split
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
    origin, value = learner(kind, flock, predator)
    sign, step = (1, budget.flock_step) if kind == "flock" else (-1, budget.predator_step)
    optimizer = CMA(np.zeros(len(origin)), step, population_size=budget.population, seed=seed)
    tuning = first_seeds(TUNING, budget.tuning_flocks)
    means = [np.zeros(len(origin))]
    curve = [value(means[0][np.newaxis], tuning).mean()]
    played = 0
    for generation, num_flocks in enumerate(budget.schedule(), start=1):
        flocks = training_seeds(seed, played, num_flocks)
        maximize(optimizer, lambda changes, flocks: sign * value(changes, flocks), flocks)
        played += num_flocks
        if generation % budget.check_every == 0:
            means.append(optimizer.mean.copy())
            curve.append(value(means[-1][np.newaxis], tuning).mean())
    return {
        "parameters": origin + means[int(np.argmax(sign * np.array(curve)))],
        "curve": np.array(curve),
        "minutes": np.array((time.process_time() - begun) / 60),
    }


def learner(kind: str, flock: Flock, predator: Predator) -> tuple[FloatArray, Value]:
    """Return the parameters of a ``"flock"`` policy or a ``"predator"``, and J_mean against the other."""
    entry, opponent = flock.entry(), predator.policy(SCENARIO)
    pursuit, network = LeadPursuit(SCENARIO, predator.lead), cast("NetworkPolicy", entry)
    start = network.parameters if kind == "flock" else predator.parameters or np.zeros(SIZE)
    origin = np.array(start, np.float64)

    def value(changes: FloatArray, flocks: range) -> FloatArray:
        size = max(1, BATCH // len(flocks))
        values = []
        for group in np.split(origin + changes, range(size, len(changes), size)):
            if kind == "flock":
                networks = Population([NetworkPolicy(network.architecture, vector) for vector in group])
                known: Any = {"per_agent": entry.per_agent, **(entry.options or {})}
                sides: tuple[Any, Any] = as_policy(networks).with_options(**known), opponent
            else:
                predators: Any = [NetworkPredator(vector, pursuit) for vector in group]
                sides = entry, Population(predators)
            values.append(_played(*sides, list(flocks) * len(group)).reshape(len(group), -1))
        return np.concatenate(values)

    return origin, value


def measure(runner: Runner, output: Path, rounds: int, num_flocks: int, budget: Budget = Budget()) -> None:
    """Train in turns, play all flock policies against all predators on held-out flocks; write the files.

    A trained predator has the name of the flock policy that it was trained against. Each round trains a flock
    policy of each track against its predator, and then a predator against the new policy.
    """
    flocks = {FIXED: Flock("fixed:12"), "stubborn leaders": Flock("stubborn-leaders")}
    flocks |= {name: Flock(file) for name, file in LEARNED.items()}
    tuning = first_seeds(TUNING, LEAD_FLOCKS)
    tried = {
        value: split(f"{__name__}:play", (flocks[FIXED], Predator("lead", value)), tuning, CHUNK, EPISODE)
        for value in LEADS
    }
    leads = {value: float(found["objective"].mean()) for value, found in runner.run(tried, "Lead").items()}
    lead = min(leads, key=lambda value: leads[value])
    predators = {kind: Predator(kind, lead if kind == "lead" else 0.0) for kind in UNTRAINED}
    trainings: list[dict[str, object]] = []

    def train_each(kind: str, starts: Mapping[str, str], seed: int) -> None:
        jobs = {}
        for name, start in starts.items():
            flock = flocks[start if kind == "flock" else name]
            arguments = (kind, flock, predators[start], budget, seed)
            jobs[name] = Job(f"{__name__}:train", arguments, budget.episodes() * EPISODE)
        for name, found in runner.run(jobs, f"Training: {kind}").items():
            parameters = tuple(found["parameters"].tolist())
            if kind == "flock":
                flocks[name] = Flock(flocks[starts[name]].spec, parameters)
            else:
                predators[name] = Predator("lead", lead, parameters)
            run = {"kind": kind, "name": name, "minutes": float(found["minutes"])}
            for at, value in enumerate(found["curve"].tolist()):
                trainings.append({**run, "measurement": at, "objective": value})

    train_each("predator", dict.fromkeys(flocks, "lead"), FIRST_SEED)
    newest = {track: track for track in TRACKS}
    for number in range(1, rounds + 1):
        starts = {f"{track}, round {number}": start for track, start in newest.items()}
        train_each("flock", starts, FIRST_SEED + 2 * number - 1)
        train_each("predator", starts, FIRST_SEED + 2 * number)
        newest = dict(zip(newest, starts, strict=True))

    held_out = first_seeds(HELD_OUT, num_flocks)
    jobs = {
        (name, other): split(f"{__name__}:play", (flock, predator), held_out, CHUNK, EPISODE)
        for name, flock in flocks.items()
        for other, predator in predators.items()
    }
    table = pl.concat(
        pl.DataFrame({"flock_policy": name, "predator": other, "seed": held_out, **found})
        for (name, other), found in runner.run(jobs, "Cross-play").items()
    )
    (output / "policies").mkdir(parents=True, exist_ok=True)
    write_table(table, output / "cross_play.parquet")
    write_table(pl.DataFrame(trainings), output / "trainings.parquet")
    policies = {}
    for name, flock in flocks.items():
        entry = flock.entry()
        policies[name] = {
            "from": flock.spec,
            "learner": TRACKS.get(name),
            "parameters": len(getattr(entry, "parameters", ())),
            "steps_per_action": (entry.options or {})["steps_per_action"],
        }
        if flock.parameters:
            file = output / "policies" / f"{name.replace(',', '').replace(' ', '-')}.npz"
            save_policy(entry.with_options(name=name, scenario=SCENARIO), file)
    trained = {name: np.array(each.parameters) for name, each in predators.items() if each.parameters}
    write_npz(output / "policies" / "predators.npz", trained)
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
        "flock_policies": policies,
        "versions": records.versions("cmaes"),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
    }
    write_text(output / "arms_race.json", document(record))


def _played(entry: BasePolicy, predator: Any, seeds: list[int]) -> FloatArray:
    """Return J_mean in m, shape (seeds,)."""
    episodes = rollout(SCENARIO, entry, seeds, predator_policy=predator, batch_size=BATCH, num_threads=1)
    values: FloatArray = episodes.min_mean_distance
    return values
