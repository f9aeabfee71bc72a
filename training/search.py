"""CMA-ES over the parameters of a small network: no gradients, no reward, the objective itself.

Hansen, "The CMA Evolution Strategy: A Tutorial" (2016), as the library cmaes implements it.
"""

from __future__ import annotations

import pickle
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from cmaes import CMA

from flockesc_env.atomic import writing
from flockesc_env.contenders import Contender
from flockesc_env.network import Architecture, NetworkPolicy
from flockesc_env.policy_files import save_policy
from flockesc_env.progress import bar
from flockesc_env.stats import FloatArray
from training.config import CURVE_FILE, POLICY_FILE, SearchArgs
from training.evaluation import control, objective
from training.seeds import TUNING, first_seeds, training_seeds

CHECKPOINT = "checkpoint.pickle"
CURVE_FLOCKS = 200
"""Tuning flocks on which learning curves are measured and the best checkpoint is chosen."""


@dataclass
class State:
    """All that the next generation depends on, and what was measured so far.

    Attributes:
        optimizer: of cmaes; it is seeded anew for every generation, so its own random state does not count.
        generation: number of the next one.
        episodes: played so far.
        seconds: of the processor, spent on that.
        curve: a row per checkpoint.
        best: parameters of the best checkpoint.
    """

    optimizer: Any
    generation: int = 0
    episodes: int = 0
    seconds: float = 0.0
    curve: list[dict[str, float]] = field(default_factory=list)
    best: FloatArray | None = None


def search(args: SearchArgs) -> Path:
    """Search, or go on with an unfinished search, and return the policy's file."""
    architecture = Architecture(args.inputs or control(args).layout.names, args.hidden, args.memory, args.mirror)
    state = _load(args) or State(
        CMA(np.zeros(architecture.size), args.step_size, population_size=args.population, seed=args.seed)
    )
    with bar(f"Search {args.run.name}", args.generations, always=args.progress) as report:
        while state.generation < args.generations:
            begun = time.process_time()
            _generation(state, args, architecture)
            state.seconds += time.process_time() - begun
            if state.generation % args.checkpoint_every == 0 or state.generation == args.generations:
                _measure(state, args, architecture)
                _save(state, args)
            report(state.generation, args.generations)
    assert state.best is not None  # noqa: S101, the last generation is a checkpoint
    policy = NetworkPolicy(architecture, state.best)
    made_for = {"per_agent": args.per_agent, "options": args.env_options(), "scenario": args.model}
    save_policy(Contender(args.run.name, policy, **made_for), args.run / POLICY_FILE)
    pl.DataFrame(state.curve).write_parquet(args.run / CURVE_FILE)
    (args.run / CHECKPOINT).unlink()
    return args.run / POLICY_FILE


def _generation(state: State, args: SearchArgs, architecture: Architecture) -> None:
    """Let the networks of one generation play the same flocks, and tell the optimizer how they fared."""
    optimizer, number = state.optimizer, state.generation
    optimizer.reseed_rng(np.random.SeedSequence([args.seed, number]).generate_state(1)[0])
    networks = np.array([optimizer.ask() for _ in range(args.population)])
    # Few flocks find the way, many tell good networks from lucky ones.
    growth = (args.final_flocks / args.flocks) ** (number / args.generations)
    flocks = training_seeds(args.seed, state.episodes // args.population, round(args.flocks * growth))
    fitness = _play(args, architecture, networks, flocks).mean(axis=1)
    # cmaes minimizes.
    optimizer.tell(list(zip(networks, -fitness, strict=True)))
    state.generation += 1
    state.episodes += args.population * len(flocks)


def _play(args: SearchArgs, architecture: Architecture, networks: FloatArray, flocks: range) -> FloatArray:
    """Return the objective of every network on every flock, shape (networks, flocks)."""
    seeds = list(flocks) * len(networks)
    values = objective(args, NetworkPolicy(architecture, networks), seeds, batch_size=len(seeds))
    return values.reshape(len(networks), -1)


def _measure(state: State, args: SearchArgs, architecture: Architecture) -> None:
    """Add a point to the learning curve: the mean of the search distribution on tuning flocks."""
    center = state.optimizer.mean
    value = float(_play(args, architecture, center[None], first_seeds(TUNING, CURVE_FLOCKS)).mean())
    if all(value > point["objective"] for point in state.curve):
        state.best = center.copy()
    state.curve.append({"episodes": state.episodes, "seconds": state.seconds, "objective": value})


def _save(state: State, args: SearchArgs) -> None:
    with writing(args.run / CHECKPOINT) as file:
        pickle.dump(state, file)


def _load(args: SearchArgs) -> State | None:
    path = args.run / CHECKPOINT
    return pickle.loads(path.read_bytes()) if path.is_file() else None  # noqa: S301, of our own making
