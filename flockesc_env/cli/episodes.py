"""The command ``flockesc episodes``: record a data set of episodes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import several
from flockesc_env.cli.output import check_folder, note, show, table
from flockesc_env.cli.policies import EXPECTED, policy_of
from flockesc_env.cli.tasks import TaskName
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.tasks.episodes import record_episodes
from flockesc_env.tasks.scoring import LoadedPolicy
from flockesc_env.tasks.task import tasks


def run(
    policies: Annotated[
        Positional[tuple[str, ...]],
        several(f"rule (the task's shortcut), {EXPECTED}", "POLICY .."),
    ],
    *,
    task: TaskName,
    flocks: Annotated[int, arg(help="number of flocks, or lines, that every policy plays")] = 100,
    output: Annotated[Path, arg(help="folder of the data set, new or empty")],
) -> Exit:
    """Record episodes of policies on a task, for offline reinforcement learning.

    The folder gets Parquet files.

    The flocks are training flocks, never those that score policies.

    For policies of several strengths, give random, rule and policy files.

    A policy from a file gets the file's name, for example medium or best.

    Example: flockesc episodes random rule --task one-range --output data
    """
    require("analysis", ["polars"])
    import polars as pl

    if not policies:
        raise InputError("policies", "at least one policy", "none")
    chosen = tasks[task]
    check_folder(output)
    specs = [chosen.shortcut.policy if spec == "rule" else spec for spec in policies]
    found = [LoadedPolicy.of(spec, policy_of) for spec in specs]
    record_episodes(found, chosen, training_seeds(0, 0, flocks), output, lambda spec: note(f"playing {spec}"))
    note(f"saved: {output}")
    episodes = pl.read_parquet(output / "episodes.parquet", columns=["policy", "objective"])
    rows = [
        [name, chosen.spec.text(mean), f"{(output / f'{name}.parquet').stat().st_size / 1e6:.1f}"]
        for name, mean in episodes.group_by("policy", maintain_order=True).mean().iter_rows()
    ]
    show(*table(["policy", chosen.spec.symbol, "MB"], rows))
    return Exit.DONE
