"""Policy search with CMA-ES: maximizes the objective over the parameters of a small network or a rule."""

from __future__ import annotations

import math
from copy import deepcopy
from typing import Any

import numpy as np
from cmaes import CMA

from flockesc_env.common.stats import FloatArray
from flockesc_env.policies.files import Stored
from flockesc_env.tasks.seeds import training_seeds
from training.cma import growing, maximize
from training.config import SearchArgs
from training.families import family_of
from training.train import Rounds


class SearchRounds(Rounds[SearchArgs]):
    """A search; a round is a generation, whose policies play the same flocks.

    Raises:
        ArgumentError: if ``args.start`` has another architecture.
    """

    def __init__(self, args: SearchArgs) -> None:
        super().__init__(args)
        self.measures_start = bool(args.start or args.rule)
        self._family = family_of(args)
        self._optimizer = self._new_optimizer()
        self._best: FloatArray = np.zeros(0)  # the best center of a checkpoint on tuning flocks

    def round(self) -> float:
        """Evaluate one generation of policies and update the optimizer; return its mean objective."""
        args = self.args
        restart, since = divmod(self.completed, math.ceil(args.generations / args.restarts))
        if restart and not since:
            self._optimizer = self._new_optimizer()
        self._optimizer.reseed_rng(
            int(np.random.SeedSequence([args.seed, self.completed]).generate_state(1)[0])
        )
        count = growing(args.flocks, args.final_flocks, since * args.restarts / args.generations)
        flocks = training_seeds(args.seed, self.measured.episodes // args.population, count)

        values = maximize(self._optimizer, self._play, flocks)
        # A checkpoint stores one triangle of the covariance matrix. The copy does the same, so that
        # interrupted and uninterrupted runs give the same numbers.
        self._optimizer = deepcopy(self._optimizer)
        return float(values.mean())

    def policy(self) -> Stored:
        """Return the policy at the mean of the search distribution."""
        return self._family.policy(self._optimizer.mean)

    def result(self) -> Stored:
        """Return the best policy of the learning curve."""
        return self._family.policy(self._best)

    def add_point(self) -> None:
        """Add a point to the learning curve, and keep its policy if it is the best so far."""
        super().add_point()
        *before, last = (point["objective"] for point in self.measured.curve)
        if all(last > value for value in before):
            self._best = self._optimizer.mean.copy()

    def state(self) -> Any:
        """Return the optimizer and the best parameters."""
        return self._optimizer, self._best

    def restore(self, state: Any) -> None:
        """Restore the optimizer and the best parameters."""
        self._optimizer, self._best = state

    def _play(self, vectors: FloatArray, flocks: range) -> FloatArray:
        values, num_actions = self._family.play(self.args, vectors, flocks)
        self.measured.episodes += values.size
        self.measured.samples += num_actions
        return values

    def _new_optimizer(self) -> CMA:
        args = self.args
        zero = np.zeros(self._family.size)
        return CMA(zero, args.step_size, population_size=args.population, seed=args.seed)
