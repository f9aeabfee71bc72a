"""Search for the best rule of a task: CMA-ES moves the numbers of all rules, and the worse half drops out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
import numpy as np
from cmaes import CMA

from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.splits import TUNING, first_seeds, training_seeds
from flockesc_env.policies import load_policy
from flockesc_env.policies.registry import Stored
from training.cma import generation
from training.families import FIXED, RULES, Rules, rules_of
from training.rounds import Arguments, Rounds, hyperparameters_of
from training.run import Run


class RuleArguments(Arguments, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Hyperparameters of the search for the best rule; the defaults are the same for every task.

    Attributes:
        checkpoint_every: number of rounds after which tuning flocks judge the rules.
        rounds: number of rounds. A round is a generation of CMA-ES of every rule that is left.
        population: number of variants of a rule per generation.
        episodes: number of episodes of a round, which the rules share equally.
        judged: number of episodes on tuning flocks, which the rules share equally.
    """

    checkpoint_every: int = 3
    rounds: int = 12
    population: int = 8
    episodes: int = 96
    judged: int = 200


@dataclass
class Contender:
    """A rule, the optimizer of its numbers, and its best numbers on tuning flocks: at first those by hand."""

    name: str
    optimizer: CMA
    best: FloatArray
    value: float = -np.inf


class RuleRounds(Rounds[RuleArguments]):
    """A search for the best rule among the constant range and the built-in rules that fit the task.

    Every ``checkpoint_every`` rounds, each rule plays its best numbers and the mean of its optimizer on the
    same tuning flocks. The better numbers stay, and the better half of the rules.
    """

    kept = ("_left",)

    def __init__(self, run: Run) -> None:
        args = hyperparameters_of(run, RuleArguments)
        super().__init__(run, args, args.rounds)
        known = dict.fromkeys(name.removesuffix("-local") for name in rules_of(run.task))
        names = [FIXED, *(name for name in known if name in RULES)]
        entries = sorted({entry for name in names for entry in _entries_of(name)})
        options = {**run.learner.options, "extra_entries": entries} if len(names) > 1 else {}
        seeing = replace(run, learner=msgspec.structs.replace(run.learner, options=options))
        self._families = {name: Rules(seeing, name) for name in names}
        self._left = [self._contender(name) for name in names]

    def round(self) -> float:
        """Play a generation of every rule that is left, on the same flocks; return the mean objective."""
        args, values = self.args, []
        flocks = max(1, args.episodes // (args.population * len(self._left)))
        seeds = training_seeds(self.run.seed, self.completed * args.episodes, flocks)
        for one in self._left:
            played, one.optimizer = generation(self, self._families[one.name], one.optimizer, seeds)
            values.append(played)
        return float(np.mean(values))

    def add_point(self) -> None:
        """Judge the rules that are left, drop the worse half, and add the best to the learning curve."""
        flocks = first_seeds(TUNING, max(1, self.args.judged // (2 * len(self._left))))
        for one in self._left:
            vectors = np.array([one.best, one.optimizer.mean])
            values, _ = self._families[one.name].play(vectors, flocks)
            self.measured.evaluations += values.size
            means = values.mean(axis=1)
            one.best, one.value = vectors[means.argmax()], float(means.max())
        self._left.sort(key=lambda one: -one.value)
        del self._left[(len(self._left) + 1) // 2 :]
        self.measured.curve.append((self.measured.samples, self._left[0].value))

    def policy(self) -> Stored:
        """Return the best rule with its best numbers; it requires no entries but its own."""
        best = self._left[0]
        rule, entries = self._families[best.name].policy(best.best), _entries_of(best.name)
        return rule.with_options(extra_entries=entries) if entries else rule

    def _contender(self, name: str) -> Contender:
        zero = np.zeros(self._families[name].size)
        return Contender(name, CMA(zero, 1.0, population_size=self.args.population, seed=self.run.seed), zero)


def _entries_of(name: str) -> tuple[str, ...]:
    """Return the entries that a rule observes beside those that every observation has."""
    known = {} if name == FIXED else load_policy(name).options or {}
    return tuple(known.get("extra_entries", ()))
