"""Evaluation of one policy on held-out flocks: objectives with intervals, and a table per flock."""

from __future__ import annotations

import polars as pl

from flockesc_env.common import stats
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import check_writable
from training import seeds
from training.arguments import EvaluateArgs
from training.evaluation import run_policy
from training.policies import named_policy, scenario_of


def evaluate(args: EvaluateArgs) -> pl.DataFrame:
    """Run a policy on held-out flocks, print both objectives, write and return the table.

    Raises:
        ValueError: if an argument is out of bounds or the policy is unknown.
    """
    if args.output is not None:
        args.output.parent.mkdir(parents=True, exist_ok=True)
        check_writable(args.output)
    entry = named_policy(args.policy)
    flocks = seeds.first_seeds(seeds.HELD_OUT, args.flocks)
    episodes = run_policy(entry, flocks, scenario=scenario_of([entry]), num_threads=args.num_threads)
    record = pl.DataFrame(
        {
            "seed": episodes.seeds,
            "min_mean_distance": episodes.min_mean_distance,
            "min_min_distance": episodes.min_min_distance,
            "num_components": episodes.num_components,
        }
    )
    print(f"{entry.name} on {args.flocks} held-out flocks, mean and 95 % bootstrap interval:")
    print(f"  J_mean {stats.mean(episodes.min_mean_distance)} m")
    print(f"  J_min  {stats.mean(episodes.min_min_distance)} m")
    if args.output is not None:
        write_table(record, args.output)
    return record
