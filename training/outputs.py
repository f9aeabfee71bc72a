"""Files of a training run: the last checkpoint and, at the end, policy, learning curve and speed."""

from __future__ import annotations

import json
import pickle
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import polars as pl

from flockesc_env import NamedPolicy, save_policy
from flockesc_env.common.array_files import write_table
from flockesc_env.common.errors import RecordError
from flockesc_env.common.files import check_writable, read_sealed, write_sealed, write_text
from flockesc_env.policies.files import Stored
from training.config import Args
from training.evaluation import objective, policy_spec
from training.record import CONFIG_FILE, CURVE_FILE, POLICY_FILE, RUN_FILE, RunRecord
from training.seeds import TUNING, first_seeds

CHECKPOINT = "checkpoint.pickle"
CURVE_FLOCKS = 200
"""Tuning flocks on which learning curves are measured."""


@dataclass
class Measured:
    """Measurements of a run so far.

    Attributes:
        episodes: number of finished episodes.
        samples: number of chosen actions, one per agent or one per flock.
        seconds: processor time of the training loop, without measurements and checkpoints.
        environment_seconds: the part of ``seconds`` spent in the environment; ``None`` if not measured.
        curve: a row per checkpoint.
    """

    episodes: int = 0
    samples: int = 0
    seconds: float = 0.0
    environment_seconds: float | None = None
    curve: list[dict[str, float]] = field(default_factory=list)

    def add_point(self, args: Args, policy: Stored) -> None:
        """Add the policy's mean objective on tuning flocks to the learning curve."""
        value = objective(args, policy, first_seeds(TUNING, CURVE_FLOCKS)).mean()
        self.curve.append({"episodes": self.episodes, "seconds": self.seconds, "objective": float(value)})


def begin(args: Args) -> None:
    """Make the run's folder with its record, or check that it holds an unfinished run of these arguments.

    Raises:
        ArgumentError: if the scenario lacks what the objective requires.
        FileExistsError: if it holds a finished run, or an unfinished one with other arguments.
        OSError: if files cannot be written there.
        RecordError: if its record is lost or damaged, and a checkpoint of other arguments remains.
    """
    args.spec.check_defined_in(args.model)
    if (args.run / POLICY_FILE).exists():
        raise FileExistsError(f"run: expected a folder without a finished run, got {args.run}")
    args.run.mkdir(parents=True, exist_ok=True)
    check_writable(args.run / CHECKPOINT)
    record = RunRecord(args)
    if (args.run / CONFIG_FILE).exists():
        found = RunRecord.read(args.run)
        if (found.args, found.versions) != (record.args, record.versions):
            raise FileExistsError(f"run: expected the arguments and versions of {args.run}, got others")
    else:
        read_checkpoint(args.run, record)  # raises if the record of another run was lost
        record.write(args.run)


def save_checkpoint(state: Any, run: Path) -> None:
    """Write the state that the rest of a run needs; it belongs to the record in the run's folder."""
    write_sealed(run / CHECKPOINT, RunRecord.read(run).to_json(), pickle.dumps(state))


def load_checkpoint(run: Path) -> Any:
    """Return the last checkpoint of a run, or ``None`` without a checkpoint.

    Raises:
        RecordError: if it is damaged or belongs to another record than the one in the folder.
    """
    content = read_checkpoint(run, RunRecord.read(run))
    return None if content is None else pickle.loads(content)  # noqa: S301, of our own making


def read_checkpoint(run: Path, record: RunRecord) -> bytes | None:
    """Return the bytes of the checkpoint in a folder, or ``None`` without a checkpoint.

    Raises:
        RecordError: if it is damaged or belongs to another record.
    """
    path = run / CHECKPOINT
    if not path.is_file():
        return None
    content = read_sealed(path, record.to_json())
    if content is None:
        expected = "a checkpoint of a run with these arguments and versions"
        found = "a damaged one, or another run's; delete the folder to start the run from the beginning"
        raise RecordError(str(path), expected, found)
    return content


def finish(args: Args, policy: Stored, measured: Measured) -> Path:
    """Write curve, speed and policy, and return the policy's file. The checkpoint stays, for ``extend``."""
    write_table(pl.DataFrame(measured.curve), args.run / CURVE_FILE)
    inside = measured.environment_seconds
    speed = {
        "minutes": measured.seconds / 60,
        "episodes": measured.episodes,
        "samples": measured.samples,
        "samples_per_second": measured.samples / measured.seconds,
        "environment_share": None if inside is None else inside / measured.seconds,
    }
    write_text(args.run / RUN_FILE, json.dumps(speed, indent=2) + "\n")
    per_agent, options = policy_spec(args).per_agent, args.env_options()
    entry = NamedPolicy(args.run.name, policy, per_agent=per_agent, options=options, scenario=args.model)
    # The policy comes last: its file marks the run as finished.
    save_policy(entry, args.run / POLICY_FILE)
    return args.run / POLICY_FILE
