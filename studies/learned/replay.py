"""Replays of the committed policy files, rules and fixed ranges of a setting, compared bit for bit."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from flockesc_env import ArgumentError
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, Cache
from studies.learned.held_out import Played, PolicyFile, choose_range, play_all, rules_of
from studies.learned.results import EPISODES_FILE, GRID_FILE, POLICIES, STUDY_FILE, Study, load_studies
from studies.learned.rules import write_rules
from training import seeds
from training.config import Setting
from training.presets import presets

_SHOWN = 3
"""Flocks that the line of a difference names."""

_KEYS = ("policy", "training_seed", "seed")


@dataclasses.dataclass(frozen=True)
class Difference:
    """Values that a replay does not reproduce.

    Attributes:
        what: a policy file, a rule, the fixed ranges or the best one of them.
        found: description of the difference.
    """

    what: str
    found: str


@dataclasses.dataclass(frozen=True)
class Replay:
    """The replay of one setting.

    Attributes:
        setting: name of the setting.
        files: number of policy files.
        rules: number of built-in rules.
        flocks: number of flocks.
        differences: in files, rules, fixed ranges and their best one.
        differing_files: number of files that do not reproduce their episodes.
    """

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
    folder: Path,
    cache: Cache,
    backend: Backend,
    *,
    flocks: int | None = None,
    files: Sequence[Path] | None = None,
    write: bool = False,
) -> Replay:
    """Play everything that a setting reports again, without training, and compare it with the results.

    Compared bit for bit: the episodes of fixed ranges, rules and policy files, and, with all flocks, the
    means of fixed ranges and the choice of the best one on tuning flocks.

    Args:
        study: the results of the setting.
        folder: their folder.
        cache: keeps the results of jobs; a job in it is not computed again.
        backend: where jobs run.
        flocks: number of held-out flocks; ``None``: all.
        files: some of the policy files; ``None``: all.
        write: whether to replace the results by those of the replay; needs all flocks and files.

    Raises:
        ArgumentError: if the setting is no preset, or ``write`` is given without all flocks and files.
        JobError: if jobs fail.
    """
    known = presets()
    if study.setting not in known:
        raise ArgumentError("setting", f"one of {', '.join(known)}", repr(study.setting))
    setting: Setting = known[study.setting].setting
    is_whole = flocks is None and files is None
    if write and not is_whole:
        raise ArgumentError("write", "all flocks and files", "some of them")
    held_out = seeds.first_seeds(seeds.HELD_OUT, study.held_out_flocks if flocks is None else flocks)
    chosen = policy_files(study, folder) if files is None else files
    contents = [_read(file) for file in chosen]
    best = study.best_fixed_range
    differences = []
    if flocks is None:
        tuning = seeds.first_seeds(seeds.TUNING, study.tuning_flocks)
        best = choose_range(setting, tuning, cache, backend)
        if best != study.best_fixed_range:
            found = f"{best:g} instead of {study.best_fixed_range:g}"
            differences.append(Difference("choice of the best fixed range", found))
    played = play_all(study.setting, setting, best, contents, held_out, cache, backend)
    episodes = _differences(study, played, held_out, every_file=files is None)
    differences += episodes
    if flocks is None and not played.grid.equals(study.grid.select(played.grid.columns)):
        differences.append(Difference(GRID_FILE, "other means or intervals of fixed ranges"))
    if write:
        _write(played, best, folder)
        write_rules(rules_of(study.setting, setting), setting, cache, backend, folder)
    rules = played.episodes.filter(pl.col("training_seed").is_null())["policy"].n_unique() - 2
    trained = {f"{learner}-{seed}" for learner, seed, _ in contents}
    differing = len(trained & {one.what for one in episodes})
    return Replay(study.setting, len(contents), rules, len(held_out), tuple(differences), differing)


def find_studies(names: Sequence[str], results: Path) -> list[Study]:
    """Return the studies with these names, in their order; without names, all of the folder.

    Raises:
        ArgumentError: if a name is unknown.
        RecordError: if the results are incomplete.
    """
    studies = {study.setting: study for study in load_studies(results)}
    for name in names:
        if name not in studies:
            raise ArgumentError("settings", f"any of {', '.join(studies)}", repr(name))
    return [studies[name] for name in names or studies]


def policy_files(study: Study, folder: Path) -> list[Path]:
    """Return the policy files of a setting, in the order of learners and training seeds."""
    order = list(study.learners)
    files = [file for file in (folder / POLICIES).glob("*.npz") if _origin(file)[0] in order]
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


def _write(played: Played, best: float, folder: Path) -> None:
    """Write the results of a replay, and the choice of the best fixed range."""
    played.write(folder)
    path = folder / STUDY_FILE
    document = json.loads(path.read_text())
    if document["best_fixed_range"] != best:
        document["best_fixed_range"] = best
        write_text(path, json.dumps(document, indent=1) + "\n")
