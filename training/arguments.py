"""Arguments of the commands that do not train; kept apart so that the command line starts fast."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tyro.conf import Positional


@dataclass(frozen=True, kw_only=True)
class EvaluateArgs:
    """Arguments of ``evaluate``.

    Attributes:
        policy: a built-in policy (see ``flockesc simulate --help``), a policy's
            file, the folder of a run, or module:function.
        flocks: number of held-out flocks.
        output: Parquet file for the record per flock; default: none is written.
        num_threads: threads of the engine; default: one per core.
    """

    policy: str
    flocks: int = 200
    output: Path | None = None
    num_threads: int | None = None


@dataclass(frozen=True, kw_only=True)
class CompareArgs:
    """Arguments of ``compare``.

    Attributes:
        policies: built-in policies (see ``flockesc simulate --help``), files of
            policies, folders of runs, and module:function.
        output: folder of the table, the records and the figures.
        objective: the distance that is compared.
        flocks: held-out flocks that results are reported on.
        tuning_flocks: other flocks, on which the best fixed range is chosen.
        max_range: largest range of the grid in m.
        grid_size: number of ranges in the grid, 0 and ``max_range`` included.
        num_threads: threads of the engine; default: one per core.
    """

    policies: tuple[str, ...]
    output: Path = Path("runs/comparison")
    objective: Literal["mean", "minimum"] = "mean"
    flocks: int = 200
    tuning_flocks: int = 400
    max_range: float = 150.0
    grid_size: int = 101
    num_threads: int | None = None


@dataclass(frozen=True, kw_only=True)
class TuneArgs:
    """Arguments of ``tune``.

    Attributes:
        run: name of a learner's preset, as ``train`` takes it.
        trials: how many sets of hyperparameters are tried, those of earlier calls included.
        share: of the preset's generations or episodes that a trial trains for.
        flocks: tuning flocks on which a trial is judged.
        output: folder of the study (``<run>.journal``) and its table (``<run>.csv``).
        runs: folder of the trials' training runs.
        storage: URL of a database that Optuna knows, for workers without a shared disk; default: the journal.
        backend: where trials run: serial, processes[:N], ray[:ADDRESS] or slurm[:KEY=VALUE,..].
    """

    run: Positional[str]
    trials: int = 20
    share: float = 0.5
    flocks: int = 200
    output: Path = Path("results/learned/tuning")
    runs: Path = Path("runs/tuning")
    storage: str | None = None
    backend: str = "processes"
