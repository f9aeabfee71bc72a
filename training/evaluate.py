"""Evaluation of one policy on held-out flocks: objectives with intervals, and a table per flock."""

from __future__ import annotations

import polars as pl

from flockesc_env.common import stats
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import check_writable
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.tasks import seeds
from training.arguments import EvaluateArgs
from training.evaluation import run_policy
from training.policies import named_policy, scenario_of


def evaluate(args: EvaluateArgs) -> pl.DataFrame:
    """Run a policy on held-out flocks, print all objectives, write and return the table.

    Raises:
        ArgumentError: if an argument is out of bounds or the policy is unknown.
    """
    if args.output is not None:
        args.output.parent.mkdir(parents=True, exist_ok=True)
        check_writable(args.output)
    entry = named_policy(args.policy, args.task)
    flocks = seeds.first_seeds(seeds.HELD_OUT, args.flocks)
    scenario = scenario_of([entry])
    episodes = run_policy(entry, flocks, scenario=scenario, num_threads=args.num_threads)
    specs = [spec for spec in FLOCK_OBJECTIVES.values() if spec.is_defined_in(scenario)]
    names = ("seeds", *(spec.column for spec in specs), "num_components")
    record = pl.DataFrame({name: getattr(episodes, name) for name in names}).rename({"seeds": "seed"})
    print(f"{entry.name} on {args.flocks} held-out flocks, mean and 95 % bootstrap interval:")
    for spec in specs:
        estimate = stats.mean(record[spec.column].to_numpy())
        print(f"  {spec.symbol:<10} {estimate:.{spec.digits}f} {spec.unit}".rstrip())
    if args.output is not None:
        write_table(record, args.output)
    return record
