"""Replays of the committed policy files, rules and fixed ranges of a setting, compared bit for bit."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import polars as pl
from training.config import Setting
from training.presets import presets

from flockesc_env import ArgumentError
from flockesc_env.common.files import write_text
from flockesc_env.episodes import splits
from studies.findings.held_out import Played, PolicyFile, choose_range, play_all, rules_of, write_rules
from studies.findings.results import EPISODES_FILE, GRID_FILE, POLICIES, STUDY_FILE, Study, load_studies
from studies.measurements import Runner
from studies.study import document

_SHOWN = 3
"""Flocks that the line of a difference names."""

_KEYS = ("policy", "training_seed", "seed")


@dataclasses.dataclass(frozen=True)
class Difference:
    """Values that a replay does not reproduce: of a policy file, a rule or the fixed ranges."""

    what: str
    found: str


@dataclasses.dataclass(frozen=True)
class Replay:
    """The replay of one setting: numbers of files, rules, flocks and files that differ, and differences."""

    setting: str
    files: int
    rules: int
    flocks: int
    differences: tuple[Difference, ...]
    differing_files: int

    def lines(self) -> list[str]:
        """Return the result and every difference, one line each."""
        same = self.files - self.differing_files
        first = f"{self.setting}: {same} of {self.files} files reproduce on {self.flocks} flocks"
        if not self.differences:
            first += f"; so do {self.rules} rules and the fixed ranges"
        return [first, *(f"  {one.what}: {one.found}" for one in self.differences)]


def replay(
    study: Study,
    runner: Runner,
    *,
    flocks: int | None = None,
    files: Sequence[Path] | None = None,
    write: bool = False,
) -> Replay:
    """Play everything that a setting reports again, without training, and compare it with the results.

    Compared bit for bit: the episodes of fixed ranges, rules and policy files, and, with all flocks, the
    means of fixed ranges and the choice of the best one on tuning flocks. ``write`` replaces the results by
    those of the replay; it needs all flocks and files, which are the default.
    """
    known = presets()
    if study.setting not in known:
        raise ArgumentError("setting", f"one of {', '.join(known)}", repr(study.setting))
    setting: Setting = known[study.setting].setting
    if write and not (flocks is None and files is None):
        raise ArgumentError("write", "all flocks and files", "some of them")
    held_out = splits.first_seeds(splits.HELD_OUT, study.held_out_flocks if flocks is None else flocks)
    contents = [_read(file) for file in (policy_files(study) if files is None else files)]
    best = study.best_fixed_range
    differences = []
    if flocks is None:
        best = choose_range(setting, splits.first_seeds(splits.TUNING, study.tuning_flocks), runner)
        if best != study.best_fixed_range:
            found = f"{best:g} instead of {study.best_fixed_range:g}"
            differences.append(Difference("choice of the best fixed range", found))
    played = play_all(study.setting, setting, best, contents, held_out, runner)
    episodes = _differences(study, played, held_out, every_file=files is None)
    differences += episodes
    if flocks is None and not played.grid.equals(study.grid.select(played.grid.columns)):
        differences.append(Difference(GRID_FILE, "other means or intervals of fixed ranges"))
    rules = rules_of(study.setting, setting)
    if write:
        _write(study, played, best)
        write_rules(rules, setting, runner, study.folder)
    trained = {f"{learner}-{seed}" for learner, seed, _ in contents}
    differing = len(trained & {one.what for one in episodes})
    return Replay(study.setting, len(contents), len(rules), len(held_out), tuple(differences), differing)


def find_studies(names: Sequence[str], results: Path) -> list[Study]:
    """Return the studies with these names, in their order; without names, all of the folder."""
    studies = {study.setting: study for study in load_studies(results)}
    for name in names:
        if name not in studies:
            raise ArgumentError("settings", f"any of {', '.join(studies)}", repr(name))
    return [studies[name] for name in names or studies]


def policy_files(study: Study) -> list[Path]:
    """Return the policy files of a setting, in the order of learners and training seeds."""
    order = list(study.learners)
    files = [file for file in (study.folder / POLICIES).glob("*.npz") if _origin(file)[0] in order]
    return sorted(files, key=lambda file: (order.index(_origin(file)[0]), _origin(file)[1]))


def _origin(file: Path) -> tuple[str, int]:
    learner, _, seed = file.stem.rpartition("-")
    return learner, int(seed)


def _read(file: Path) -> PolicyFile:
    return *_origin(file), file.read_bytes()


def _differences(study: Study, played: Played, flocks: range, *, every_file: bool) -> list[Difference]:
    """Return the policies whose episodes differ from the results, in the order of the replay."""
    known = study.episodes.filter(pl.col("seed").is_in(flocks)).select(*_KEYS, recorded="objective")
    joined = played.episodes.join(known, on=_KEYS, how="left", nulls_equal=True, maintain_order="left")
    found = []
    for rows in joined.partition_by("policy", "training_seed", maintain_order=True):
        what = _file_name(rows)
        # A missing value differs from any other.
        other = rows.filter(pl.col("objective").ne_missing(pl.col("recorded")))
        if other["recorded"].has_nulls():
            found.append(Difference(what, f"no episodes in {EPISODES_FILE}"))
        elif len(other):
            largest = (other["objective"] - other["recorded"]).abs().to_numpy().max()
            named = ", ".join(map(str, other["seed"][:_SHOWN])) + (", .." if len(other) > _SHOWN else "")
            text = f"{len(other)} of {len(rows)} flocks differ ({named}), by up to {largest:.2g}{study.unit}"
            found.append(Difference(what, text))
    if every_file:
        trained = study.episodes.filter(pl.col("training_seed").is_not_null())
        files = played.episodes.select("policy", "training_seed").unique()
        missing = trained.join(files, on=("policy", "training_seed"), how="anti")
        runs = missing.partition_by("policy", "training_seed", maintain_order=True)
        found += [Difference(_file_name(rows), "no policy file") for rows in runs]
    return found


def _file_name(rows: pl.DataFrame) -> str:
    """Return the name of the file, or of the rule, that some episodes belong to."""
    name, seed = rows["policy"][0], rows["training_seed"][0]
    return str(name) if seed is None else f"{name}-{seed}"


def _write(study: Study, played: Played, best: float) -> None:
    """Write the results of a replay, and the choice of the best fixed range."""
    played.write(study.folder)
    path = study.folder / STUDY_FILE
    if study.best_fixed_range != best:
        write_text(path, document(json.loads(path.read_text("utf-8")) | {"best_fixed_range": best}))
