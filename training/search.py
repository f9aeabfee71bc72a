"""Policy search with CMA-ES: maximizes the objective over the parameters of a small network or a rule.

Hansen, "The CMA Evolution Strategy: A Tutorial" (2016), in the implementation of the library cmaes.
"""

from __future__ import annotations

import math
import time
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from cmaes import CMA

from flockesc_env.common.progress import progress_bar
from flockesc_env.common.stats import FloatArray
from training.config import SearchArgs
from training.families import Family, family_of
from training.outputs import Measured, begin, finish, load_checkpoint, save_checkpoint
from training.seeds import training_seeds


@dataclass
class SearchState:
    """Checkpoint of a search between two generations.

    Attributes:
        optimizer: the optimizer of cmaes; it is reseeded in every generation.
        generation: number of the next generation.
        best: parameters of the best checkpoint on tuning flocks.
        measured: measurements so far.
    """

    optimizer: CMA
    generation: int = 0
    best: FloatArray = field(default_factory=lambda: np.zeros(0))
    measured: Measured = field(default_factory=Measured)


def search(args: SearchArgs) -> Path:
    """Run a search, or continue an unfinished one, and return the path of the policy file.

    Raises:
        FileExistsError: if the folder holds a finished run, or a run with other arguments.
        ValueError: if ``args.start`` has another architecture.
    """
    family = family_of(args)
    begin(args)
    state: SearchState = load_checkpoint(args.run) or SearchState(_optimizer(args, family))
    if (args.start or args.rule) and not state.measured.curve:
        _measure(state, args, family)
    with progress_bar(f"Search {args.run.name}", args.generations, always=args.progress) as report:
        while state.generation < args.generations:
            report(state.generation, args.generations)
            _generation(state, args, family)
            is_point = state.generation % args.checkpoint_every == 0
            if is_point:
                _measure(state, args, family)
            if is_point or state.generation == args.generations:
                save_checkpoint(state, args.run)
    if args.generations % args.checkpoint_every:  # not in the checkpoint: a longer run lacks this point
        _measure(state, args, family)
    return finish(args, family.policy(state.best), state.measured)


def _optimizer(args: SearchArgs, family: Family) -> CMA:
    return CMA(np.zeros(family.size), args.step_size, population_size=args.population, seed=args.seed)


def _generation(state: SearchState, args: SearchArgs, family: Family) -> None:
    """Evaluate one generation of policies on the same flocks and update the optimizer."""
    begun = time.process_time()
    number, measured = state.generation, state.measured
    restart, since = divmod(number, math.ceil(args.generations / args.restarts))
    if restart and not since:
        state.optimizer = _optimizer(args, family)
    optimizer = state.optimizer
    optimizer.reseed_rng(int(np.random.SeedSequence([args.seed, number]).generate_state(1)[0]))
    vectors = np.array([optimizer.ask() for _ in range(args.population)])
    # Later generations need more flocks, because their policies differ by less than the noise.
    growth = (args.final_flocks / args.flocks) ** (since * args.restarts / args.generations)
    flocks = training_seeds(args.seed, measured.episodes // args.population, round(args.flocks * growth))
    values, num_actions = family.play(args, vectors, flocks)
    fitness = values.mean(axis=1)
    optimizer.tell(list(zip(vectors, -fitness, strict=True)))  # cmaes minimizes
    # A checkpoint stores one triangle of the covariance matrix. The copy does the same, so that interrupted
    # and uninterrupted runs give the same numbers.
    state.optimizer = deepcopy(optimizer)
    state.generation += 1
    measured.episodes += values.size
    measured.samples += num_actions
    measured.seconds += time.process_time() - begun


def _measure(state: SearchState, args: SearchArgs, family: Family) -> None:
    """Add the mean of the search distribution to the learning curve; save it if it is the best so far."""
    center = state.optimizer.mean
    curve = state.measured.curve
    state.measured.add_point(args, family.policy(center))
    if all(curve[-1]["objective"] > point["objective"] for point in curve[:-1]):
        state.best = center.copy()
