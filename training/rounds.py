"""``Rounds``: the loop of search and imitation, with learning curve and checkpoints."""

import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar, Generic, TypeVar

import msgspec

from flockesc_env.common.errors import InputError
from flockesc_env.common.progress import progress_bar
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.policies.registry import Stored
from training.run import CURVE_FLOCKS, Measured, Run


class Arguments(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Hyperparameters of every learner in rounds.

    Attributes:
        checkpoint_every: number of rounds between checkpoints.
    """

    checkpoint_every: int = 25


A = TypeVar("A", bound=Arguments)


class Rounds(ABC, Generic[A]):
    """A training run in rounds. A round depends on ``run``, ``completed`` and the attributes ``kept`` only.

    A run that was interrupted and continued ends with the same parameters as an uninterrupted one.

    Attributes:
        kept: names of attributes that a checkpoint holds besides ``completed``, ``measured`` and ``best``.
        ends_with_best: the run ends with ``best`` instead of the last policy.
        run: the run.
        args: hyperparameters.
        total: number of rounds.
        completed: number of completed rounds.
        measured: measurements so far.
        best: the best policy of the learning curve.
    """

    kept: ClassVar[tuple[str, ...]]
    ends_with_best: ClassVar[bool] = False

    def __init__(self, run: Run, args: A, total: int) -> None:
        self.run, self.args, self.total = run, args, total
        self.completed = 0
        self.measured = Measured()
        self.best: Stored | None = None

    @abstractmethod
    def round(self) -> float:
        """Do the next round, add its episodes and samples to ``measured``; return their mean objective."""

    @abstractmethod
    def policy(self) -> Stored:
        """Return the policy after the last round, which the learning curve shows."""

    def add_point(self) -> None:
        """Add the mean objective of ``policy`` on tuning flocks to the learning curve, and keep the best."""
        policy = self.policy()
        value = float(self.run.objectives(policy, first_seeds(TUNING, CURVE_FLOCKS)).mean())
        if all(value > before for _, before in self.measured.curve):
            self.best = policy
        self.measured.evaluations += CURVE_FLOCKS
        self.measured.curve.append((self.measured.samples, value))

    def train(self, *, resume: bool = False) -> Path:
        """Train, or continue an unfinished run, and return the path of the policy file.

        Raises:
            InputError: see ``Run.begin``.
            KeyboardInterrupt: on Ctrl-C, saying how much is saved.
        """
        run, total = self.run, self.total
        run.begin(resume=resume)
        if (checkpoint := run.load_checkpoint()) is not None:
            vars(self).update(checkpoint)
        saved, spec = self.completed, run.task.spec
        try:
            with progress_bar(f"Train {run.task.name} {run.name}", total, always=run.progress) as report:
                report(self.completed, total)
                while self.completed < total:
                    begun = time.process_time()
                    value = self.round()
                    self.completed += 1
                    self.measured.cpu_seconds += time.process_time() - begun
                    report(self.completed, total, f"{spec.symbol} {spec.text(value)}")
                    if self.completed % self.args.checkpoint_every == 0 or self.completed == total:
                        self.add_point()
                        names = ("completed", "measured", "best", *self.kept)
                        run.save_checkpoint({name: getattr(self, name) for name in names})
                        saved = self.completed
        except KeyboardInterrupt:
            kept = f"{saved} of {total} rounds are saved in {run.folder}; --resume continues"
            raise KeyboardInterrupt(kept if saved else "nothing is saved yet") from None
        return run.finish(self.best if self.ends_with_best else self.policy(), self.measured)


def hyperparameters_of(run: Run, kind: type[A]) -> A:
    """Return the hyperparameters of a run's learner.

    Raises:
        InputError: if one is unknown or has a wrong type.
    """
    try:
        return msgspec.convert(run.learner.hyperparameters, kind)
    except msgspec.ValidationError as error:
        expected = f"some of {', '.join(kind.__struct_fields__)}"
        raise InputError(f"{run.name}.hyperparameters", expected, error) from None
