"""A finished training run continued with a larger budget, in a new folder."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from flockesc_env import ArgumentError, load_policy
from flockesc_env.benchmark.seeds import training_seeds
from training.arguments import ExtendArgs
from training.config import Args, PPOArgs, SB3Args, SearchArgs
from training.outputs import CHECKPOINT, load_checkpoint, save_checkpoint
from training.record import CONFIG_FILE, POLICY_FILE, RunRecord
from training.train import train
from training.versions import versions


def extend(given: ExtendArgs) -> Path:
    """Continue a finished run, or an unfinished extension, and return the path of the new policy file.

    The policy is the one of a run that had the larger budget from the start, bit for bit, unless a parameter
    follows a schedule over the whole run (``scheduled``). Such a parameter follows the schedule of the larger
    budget from the end of the finished run on, and the record of the new run holds the number
    of generations or rounds before (``continued_at``).

    Raises:
        ArgumentError: if the run cannot be continued, or the new folder holds another one or a finished one.
    """
    record = _finished_record(given.run)
    budget = record.args.budget
    before: int = getattr(record.args, budget)
    if given.total <= before:
        raise ArgumentError("total", f"more than the {before} {budget} of {given.run}", given.total)
    output = given.output or given.run.with_name(f"{given.run.name}-{given.total}")
    changes: dict[str, Any] = {"run": output, budget: given.total, "progress": given.progress}
    args = dataclasses.replace(record.args, **changes)
    _check(args, given.run)
    if not (output / CONFIG_FILE).exists():
        output.mkdir(parents=True, exist_ok=True)
        times = record.continued_at + ((before,) if scheduled(args) else ())
        longer = RunRecord(args, continued_at=times)
        save_checkpoint(longer, load_checkpoint(record))
        longer.write()
    return train(args)


def scheduled(args: Args) -> str:
    """Return the field that makes a parameter follow a schedule over the whole run, or an empty string."""
    if isinstance(args, SearchArgs):
        return "final_flocks" if args.final_flocks != args.flocks else ""
    return "anneal" if isinstance(args, PPOArgs) and args.anneal else ""


def _finished_record(run: Path) -> RunRecord:
    for file, expected in (
        (CONFIG_FILE, "the folder of a run"),
        (POLICY_FILE, "a finished run; the command train continues an unfinished one"),
        (CHECKPOINT, f"a run with its {CHECKPOINT}"),
    ):
        if not (run / file).is_file():
            raise ArgumentError("run", expected, run)
    record, installed = RunRecord.read(run), versions()
    old = {name: version for name, version in record.versions.items() if installed.get(name) != version}
    if old:
        raise ArgumentError("run", f"a run with the installed versions of {', '.join(old)}", run)
    return record


def _check(args: Args, run: Path) -> None:
    if isinstance(args, SearchArgs) and args.restarts > 1:
        raise ArgumentError("run", "a search without restarts, which divide the whole budget", run)
    if isinstance(args, SB3Args):
        training_seeds(args.seed, 0, args.num_flocks * args.num_episodes)  # raises if there are too few seeds
    if load_policy(run / POLICY_FILE).scenario != args.model:
        raise ArgumentError("run", f"a run whose scenario {args.scenario} has not changed", run)
