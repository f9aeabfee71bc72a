"""Policy search with CMA-ES: maximizes the objective over the parameters of a small network."""

import math

import numpy as np
from cmaes import CMA

from flockesc_env import NetworkPolicy
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.policies import Architecture
from training.cma import generation
from training.families import Networks
from training.rounds import Arguments, Rounds, hyperparameters_of
from training.run import Run


class SearchArguments(Arguments, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Hyperparameters of the search with CMA-ES, which maximizes the objective itself.

    Attributes:
        inputs: observation entries that the network sees; empty: all. With ``time`` alone the network is an
            open-loop schedule.
        candidate_inputs: entries of a candidate range that the network sees; it then scores every candidate.
        hidden: widths of the hidden layers.
        memory: number of recurrent values of the network.
        mirror: reflect observations such that the predator is on the left.
        population: number of networks per generation.
        flocks: number of flocks per network in the first generation.
        final_flocks: number of flocks per network in the last generation; it grows geometrically.
        generations: number of generations.
        step_size: initial standard deviation of the parameters.
        restarts: number of equal parts of the search. Each part starts again from the first parameters. The
            best checkpoint of all parts is kept.
    """

    inputs: tuple[str, ...] = ()
    candidate_inputs: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (8,)
    memory: int = 0
    mirror: bool = False
    population: int = 16
    flocks: int = 4
    final_flocks: int = 32
    generations: int = 300
    step_size: float = 0.5
    restarts: int = 1


class SearchRounds(Rounds[SearchArguments]):
    """A search; a round is a generation, whose policies play the same flocks.

    Raises:
        InputError: if a hyperparameter is unknown.
    """

    kept = ("_optimizer",)
    ends_with_best = True

    def __init__(self, run: Run) -> None:
        args = hyperparameters_of(run, SearchArguments)
        super().__init__(run, args, args.generations)
        candidates = args.candidate_inputs
        inputs = args.inputs if args.inputs or candidates else run.policy_spec.layout.names
        network = Architecture(inputs, args.hidden, args.memory, args.mirror, candidate_inputs=candidates)
        self.family = Networks(run, network)
        self._optimizer = self._new_optimizer()

    def round(self) -> float:
        """Evaluate one generation of policies and update the optimizer; return its mean objective."""
        args = self.args
        restart, since = divmod(self.completed, math.ceil(args.generations / args.restarts))
        if restart and not since:
            self._optimizer = self._new_optimizer()
        # Later generations need more flocks, because their policies differ by less than the noise.
        growth = (args.final_flocks / args.flocks) ** (since * args.restarts / args.generations)
        count = round(args.flocks * growth)
        flocks = training_seeds(self.run.seed, self.measured.episodes // args.population, count)
        values, self._optimizer = generation(self, self.family, self._optimizer, flocks)
        return float(values.mean())

    def policy(self) -> NetworkPolicy:
        """Return the network with the mean of the search distribution."""
        return self.family.policy(self._optimizer.mean)

    def _new_optimizer(self) -> CMA:
        zero, args = np.zeros(self.family.size), self.args
        return CMA(zero, args.step_size, population_size=args.population, seed=self.run.seed)
