"""Files of a training run: the last checkpoint and, at the end, policy, learning curve and speed."""

from __future__ import annotations

import json
import pickle
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import polars as pl

from flockesc_env import ArgumentError, NamedPolicy, save_policy
from flockesc_env.common.array_files import write_table
from flockesc_env.common.errors import RecordError
from flockesc_env.common.files import check_writable, read_sealed, write_sealed, write_text
from flockesc_env.policies.files import Stored
from training.config import Args
from training.record import CONFIG_FILE, CURVE_FILE, POLICY_FILE, RUN_FILE, RunRecord

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
        curve: a row per checkpoint: episodes, seconds and mean objective.
    """

    episodes: int = 0
    samples: int = 0
    seconds: float = 0.0
    environment_seconds: float | None = None
    curve: list[dict[str, float]] = field(default_factory=list)


def begin(args: Args) -> RunRecord:
    """Make the run's folder with its record, or return that of an unfinished run of these arguments.

    Raises:
        ArgumentError: if the scenario lacks what the objective requires, or if the folder holds a finished
            run, or an unfinished one with other arguments.
        OSError: if files cannot be written there.
        RecordError: if its record is lost or damaged, and a checkpoint of other arguments remains.
    """
    args.spec.check_defined_in(args.model)
    if (args.run / POLICY_FILE).exists():
        raise ArgumentError("run", "a folder without a finished run", args.run)
    args.run.mkdir(parents=True, exist_ok=True)
    check_writable(args.run / CHECKPOINT)
    record = RunRecord(args)
    if (args.run / CONFIG_FILE).exists():
        found = RunRecord.read(args.run)
        if (found.args, found.versions) != (args, record.versions):
            raise ArgumentError("run", f"the arguments and versions of {args.run}", "others")
        return found
    load_checkpoint(record)  # raises if the record of another run was lost
    record.write()
    return record


def save_checkpoint(record: RunRecord, state: Any) -> None:
    """Write the state that the rest of a run needs."""
    write_sealed(record.args.run / CHECKPOINT, record.to_json(), pickle.dumps(state))


def load_checkpoint(record: RunRecord) -> Any:
    """Return the last checkpoint of a run, or ``None`` without a checkpoint.

    Raises:
        RecordError: if it is damaged or belongs to another record.
    """
    path = record.args.run / CHECKPOINT
    if not path.is_file():
        return None
    content = read_sealed(path, record.to_json())
    if content is None:
        expected = "a checkpoint of a run with these arguments and versions"
        found = "a damaged one, or another run's; delete the folder to start the run from the beginning"
        raise RecordError(str(path), expected, found)
    return pickle.loads(content)  # noqa: S301, of our own making


def finish(args: Args, policy: Stored, measured: Measured) -> Path:
    """Write curve, speed and policy, and return the policy's file."""
    write_table(pl.DataFrame(measured.curve), args.run / CURVE_FILE)
    inside, seconds = measured.environment_seconds, measured.seconds
    speed = {
        "minutes": seconds / 60,
        "episodes": measured.episodes,
        "samples": measured.samples,
        "samples_per_second": measured.samples / seconds,
        "environment_share": None if inside is None else inside / seconds,
    }
    write_text(args.run / RUN_FILE, json.dumps(speed, indent=2) + "\n")
    per_agent, options = args.per_agent and not args.is_line, args.env_options()
    entry = NamedPolicy(args.run.name, policy, per_agent=per_agent, options=options, scenario=args.model)
    # The policy comes last: its file marks the run as finished.
    save_policy(entry, args.run / POLICY_FILE)
    return args.run / POLICY_FILE
