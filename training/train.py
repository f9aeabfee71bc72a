"""The loop of every training run: rounds, learning curve, checkpoints and, at the end, the policy."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Generic, TypeVar

from flockesc_env.common.progress import progress_bar
from flockesc_env.policies.files import Stored
from flockesc_env.tasks.seeds import TUNING, first_seeds
from training.config import Args
from training.evaluation import objective
from training.outputs import CURVE_FLOCKS, Measured, begin, finish, load_checkpoint, save_checkpoint

A = TypeVar("A", bound=Args)


def train(args: Args) -> Path:
    """Train a policy, or continue an unfinished run, and return the path of the policy file.

    A run that was interrupted and continued ends with the same parameters as an uninterrupted one.

    Raises:
        ArgumentError: if an argument is out of bounds, or if the folder holds a finished run or a run with
            other arguments.
    """
    learner: type[Rounds[Any]] = resolve_name(args.learner)  # importing torch takes seconds
    return learner(args).train()


class Rounds(ABC, Generic[A]):
    """A training run in rounds. A round depends on ``args``, ``completed`` and ``state()`` only.

    Attributes:
        args: arguments of the run.
        completed: number of completed rounds.
        measured: measurements so far.
        measures_start: whether the learning curve begins before the first round.
    """

    measures_start = False

    def __init__(self, args: A) -> None:
        self.args: A = args
        self.completed = 0
        self.measured = Measured()

    @abstractmethod
    def round(self) -> float:
        """Do the next round, add its episodes and samples to ``measured``; return their mean objective."""

    @abstractmethod
    def policy(self) -> Stored:
        """Return the policy after the last round, which the learning curve shows."""

    @abstractmethod
    def state(self) -> Any:
        """Return what the next round depends on, as a value that can be pickled."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Restore what ``state`` returned."""

    def result(self) -> Stored:
        """Return the policy that the run ends with."""
        return self.policy()

    def add_point(self) -> None:
        """Add the mean objective of ``policy`` on tuning flocks to the learning curve."""
        measured = self.measured
        value = objective(self.args, self.policy(), first_seeds(TUNING, CURVE_FLOCKS)).mean()
        point = {"episodes": measured.episodes, "seconds": measured.seconds, "objective": float(value)}
        measured.curve.append(point)

    def train(self) -> Path:
        """Train, or continue an unfinished run; see ``train``.

        Raises:
            KeyboardInterrupt: on Ctrl-C, saying how much is saved.
        """
        args, total = self.args, getattr(self.args, self.args.budget)
        record = begin(args)
        if (checkpoint := load_checkpoint(record)) is not None:
            self.completed, self.measured, state = checkpoint
            self.restore(state)
        saved = self.completed
        try:
            if self.measures_start and not self.measured.curve:
                self.add_point()
            with progress_bar(f"Train {args.run.name}", total, always=args.progress) as report:
                report(self.completed, total)
                while self.completed < total:
                    begun = time.process_time()
                    value = self.round()
                    self.completed += 1
                    self.measured.seconds += time.process_time() - begun
                    report(self.completed, total, f"{args.spec.symbol} {args.spec.text(value)}")
                    if self.completed % args.checkpoint_every == 0 or self.completed == total:
                        self.add_point()
                        save_checkpoint(record, (self.completed, self.measured, self.state()))
                        saved = self.completed
        except KeyboardInterrupt:
            kept = f"{saved} of {total} rounds are saved in {args.run}; the same command continues"
            raise KeyboardInterrupt(kept if saved else "nothing is saved yet") from None
        return finish(args, self.result(), self.measured)
