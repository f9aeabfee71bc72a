"""Read and check the files of ``results/findings``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from flockesc_env.common.errors import RecordError
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, Objective, ObjectiveSpec

STUDY_FILE = "study.json"
EPISODES_FILE = "episodes.parquet"
GRID_FILE = "grid.parquet"
REFERENCES_FILE = "references.parquet"
RULES_FILE = "rules.parquet"
POLICIES = "policies"
FIGURES = "figures"
BEST_FIXED = "best fixed range"
ORACLE = "hindsight oracle"

_COLUMNS = {
    "episodes": ("policy", "training_seed", "seed", "objective"),
    "runs": ("learner", "training_seed", "minutes", "episodes", "samples_per_second", "environment_share"),
    "curves": ("learner", "training_seed", "episodes", "seconds", "objective"),
    "grid": ("interaction_range", "mean", "low", "high"),
    "ablation": ("removed", "seed", "objective"),
    "transfer": ("world", "policy", "seed", "objective"),
    "references": ("reference", "seed", "objective"),
    "rules": ("rule", "seed", "objective"),
}
_OPTIONAL = ("ablation", "transfer", "references", "rules")


@dataclass(frozen=True)
class LearnerInfo:
    """How a learner was run: "search", "ppo", "tqc" or "imitation", its arguments, and a remark, if any."""

    kind: str
    arguments: dict[str, Any]
    note: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """One folder of ``results/findings``; the folder has the name of the setting.

    The best fixed range was chosen on the tuning flocks, and every policy is reported on the held-out flocks.
    ``explained`` and ``explained_seed`` are the headline policy when ``ablation`` and ``transfer`` were
    measured. The tables have the columns of ``_COLUMNS``: objectives of episodes and of fixed ranges on
    held-out flocks, of rules and learning curves on tuning flocks. ``training_seed`` is null where nothing
    was trained. A table that was not measured is None.
    """

    folder: Path
    setting: str
    title: str
    command: str
    objective: Objective
    is_line: bool
    tuning_flocks: int
    held_out_flocks: int
    best_fixed_range: float
    learners: dict[str, LearnerInfo]
    versions: dict[str, str]
    machine: str
    explained: str | None = None
    explained_seed: int | None = None
    episodes: pl.DataFrame
    runs: pl.DataFrame
    curves: pl.DataFrame
    grid: pl.DataFrame
    ablation: pl.DataFrame | None
    transfer: pl.DataFrame | None
    references: pl.DataFrame | None
    rules: pl.DataFrame | None

    def file(self, learner: str | None = None, seed: int | None = None) -> Path:
        """Return the file of a policy; None: the best learner and training seed on tuning flocks."""
        name = f"{learner or self.best_learner}-{self.best_seed if seed is None else seed}"
        return self.folder / POLICIES / f"{name}.npz"

    @property
    def spec(self) -> ObjectiveSpec:
        """The objective of the setting."""
        return LINE_OBJECTIVES["escape_distance"] if self.is_line else FLOCK_OBJECTIVES[self.objective]

    @property
    def unit(self) -> str:
        """The unit of the objective, with a space before it."""
        return f" {self.spec.unit}".rstrip()

    @property
    def policies(self) -> list[str]:
        """Names of all policies, in the order of the file."""
        return self.episodes["policy"].unique(maintain_order=True).to_list()

    @property
    def trained(self) -> list[str]:
        """Names of the policies that were trained here."""
        return [name for name in self.policies if name in self.learners]

    @property
    def flocks(self) -> list[int]:
        """Seeds of the held-out flocks, in rising order."""
        return self.episodes["seed"].unique().sort().to_list()

    @property
    def best_learner(self) -> str:
        """The learner whose policies have the largest objective on tuning flocks, mean over seeds.

        A search keeps its best checkpoint, other learners their last.
        """
        means = self._kept.group_by("learner").agg(pl.col("objective").mean())
        return str(means.sort("objective", "learner")["learner"][-1])

    @property
    def best_seed(self) -> int:
        """The training seed of ``best_learner`` whose policy is best on tuning flocks."""
        runs = self._kept.filter(learner=self.best_learner)
        return int(runs.sort("objective", "training_seed")["training_seed"][-1])

    @property
    def tuned(self) -> dict[tuple[str, int], float]:
        """Objective on tuning flocks of the policy that was kept, by learner and training seed."""
        return {(name, seed): value for name, seed, value in self._kept.iter_rows()}

    @property
    def _kept(self) -> pl.DataFrame:
        runs = self.curves.sort("episodes").group_by("learner", "training_seed")
        kept = runs.agg(pl.col("objective").last().alias("last"), pl.col("objective").max().alias("best"))
        searches = [name for name, learner in self.learners.items() if learner.kind == "search"]
        value = pl.when(pl.col("learner").is_in(searches)).then("best").otherwise("last")
        return kept.select("learner", "training_seed", value.alias("objective"))

    @property
    def best_of_grid(self) -> tuple[float, float]:
        """The fixed range that is best on the held-out flocks themselves, and its mean objective there."""
        best = self.grid.sort("mean", descending=True).row(0, named=True)
        return best["interaction_range"], best["mean"]

    def values(self, policy: str) -> FloatArray:
        """Return the objective, shape (training seeds, flocks); one row where nothing was trained."""
        rows = self.episodes.filter(policy=policy).sort("training_seed", "seed")
        return rows["objective"].to_numpy().reshape(-1, self.held_out_flocks)

    def training_seeds(self, learner: str) -> list[int]:
        """Return the training seeds of a learner, in the order of the rows of ``values``."""
        return self.episodes.filter(policy=learner)["training_seed"].unique().sort().to_list()

    @property
    def reference_names(self) -> list[str]:
        """Names of the references, in the order of the file."""
        if self.references is None:
            return []
        return self.references["reference"].unique(maintain_order=True).to_list()

    def reference(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return the objective of a reference and of the best fixed range on its flocks, shape (flocks,)."""
        assert self.references is not None  # noqa: S101, it has a name
        fixed = self.episodes.filter(policy=BEST_FIXED).select("seed", fixed="objective")
        rows = self.references.filter(reference=name).join(fixed, on="seed").sort("seed")
        return rows["objective"].to_numpy(), rows["fixed"].to_numpy()


def load_study(folder: Path) -> Study:
    """Read the results of one setting; a RecordError names a file that is missing or holds something else."""
    document = _document(folder / STUDY_FILE)
    tables = {name: _table(folder / f"{name}.parquet", columns) for name, columns in _COLUMNS.items()}
    try:
        learners = {name: LearnerInfo(**fields) for name, fields in document.pop("learners").items()}
        study = Study(folder=folder, learners=learners, **document, **tables)  # type: ignore[arg-type]
    except (KeyError, TypeError) as error:
        raise RecordError(str(folder / STUDY_FILE), "a study's fields", repr(error)) from None
    if study.setting != folder.name:
        raise RecordError(f"{folder / STUDY_FILE}: setting", repr(folder.name), repr(study.setting))
    _check_episodes(study, folder / EPISODES_FILE)
    _check_references(study, folder / REFERENCES_FILE)
    _check_learners(study)
    if study.explained is not None and study.explained not in study.learners:
        raise RecordError(f"{folder / STUDY_FILE}: explained", "a learner", repr(study.explained))
    if study.ablation is not None:
        _check_pairs(study.ablation, folder / "ablation.parquet", "removed", "nothing")
    for _, world in [] if study.transfer is None else study.transfer.group_by("world"):
        _check_pairs(world, folder / "transfer.parquet", "policy", "learned")
    return study


def load_studies(results: Path) -> list[Study]:
    """Read all settings of a folder, in the order of their names."""
    found = sorted(file.parent for file in results.glob(f"*/{STUDY_FILE}"))
    if not found:
        raise RecordError(str(results), f"folders with {STUDY_FILE}", "none")
    return [load_study(folder) for folder in found]


def _document(path: Path) -> dict[str, Any]:
    try:
        document: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise RecordError(str(path), "a study", repr(error)) from None
    return document


def _table(path: Path, columns: tuple[str, ...]) -> pl.DataFrame | None:
    if path.stem in _OPTIONAL and not path.is_file():
        return None
    try:
        table = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RecordError(str(path), "a table", repr(error)) from None
    if set(columns) - set(table.columns):
        raise RecordError(str(path), f"columns {', '.join(columns)}", ", ".join(table.columns))
    return table


def _check_episodes(study: Study, path: Path) -> None:
    """Check that every training seed of every policy has every flock once: differences are paired."""
    if BEST_FIXED not in study.policies:
        raise RecordError(f"{path}: policy", repr(BEST_FIXED), ", ".join(study.policies))
    _check_finite(study.episodes, f"{path}: objective")
    flocks = study.flocks
    if len(flocks) != study.held_out_flocks or len(flocks) < 2:
        raise RecordError(f"{path}: flock", f"{study.held_out_flocks} flocks, at least 2", len(flocks))
    for (name, seed), rows in study.episodes.group_by("policy", "training_seed"):
        _check_flocks(rows, flocks, f"{path}: {name}, training seed {seed}", "every flock once")


def _check_references(study: Study, path: Path) -> None:
    for (name,), rows in () if study.references is None else study.references.group_by("reference"):
        flocks = rows["seed"]
        if flocks.is_duplicated().any() or len(flocks) < 2 or set(flocks) - set(study.flocks):
            raise RecordError(f"{path}: {name}", "held-out flocks, each once, at least 2", "others")
        _check_finite(rows, f"{path}: {name}")


def _check_learners(study: Study) -> None:
    """Check that every learner has episodes, runs and curves."""
    expected = set(study.learners)
    for name, column in (("episodes", "policy"), ("runs", "learner"), ("curves", "learner")):
        missing = expected - set(getattr(study, name)[column].to_list())
        if missing or not expected:
            given = f"none for {', '.join(sorted(missing))}" if expected else "no learner"
            raise RecordError(f"{study.folder / name}.parquet", "rows of every learner", given)


def _check_pairs(table: pl.DataFrame, path: Path, column: str, reference: str) -> None:
    """Check that every entry of a table has the flocks of its reference, each once."""
    flocks = table.filter(pl.col(column) == reference)["seed"].sort().to_list()
    for (name,), rows in table.group_by(column):
        _check_flocks(rows, flocks, f"{path}: {name}", f"the flocks of {reference!r}, each once")


def _check_flocks(rows: pl.DataFrame, flocks: list[int], field: str, expected: str) -> None:
    if rows["seed"].sort().to_list() != flocks:
        raise RecordError(field, expected, f"{len(rows)} rows")


def _check_finite(rows: pl.DataFrame, field: str) -> None:
    if not np.isfinite(rows["objective"].cast(pl.Float64).fill_null(np.nan).to_numpy()).all():
        raise RecordError(field, "finite numbers", "others too")
