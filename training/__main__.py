"""Entry point of ``python -m training``: the commands train, evaluate and compare."""

import sys
from typing import Annotated

import tyro

from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit
from flockesc_env.cli.output import show
from flockesc_env.common.extras import require
from training.arguments import CompareArgs, EvaluateArgs
from training.presets import train_descriptions, train_presets

Preset = tyro.extras.subcommand_type_from_defaults(train_presets(), train_descriptions(), prefix_names=False)

_MODULES = ("cmaes", "matplotlib", "polars", "sb3_contrib", "stable_baselines3", "torch")
_NO_PREFIX = tyro.conf.arg(name="")


def _train(args: Annotated[Preset, _NO_PREFIX]) -> Exit:  # type: ignore[valid-type]
    """Train a range policy from a preset, or continue an unfinished run."""
    require("train", _MODULES)
    from training.train import train

    show(f"Policy: {train(args)}")
    return Exit.DONE


def _evaluate(args: Annotated[EvaluateArgs, _NO_PREFIX]) -> Exit:
    """Evaluate a policy on held-out flocks."""
    require("train", _MODULES)
    from training.evaluate import evaluate

    evaluate(args)
    return Exit.DONE


def _compare(args: Annotated[CompareArgs, _NO_PREFIX]) -> Exit:
    """Compare policies with the best fixed range on the same held-out flocks."""
    require("train", _MODULES)
    from training.compare import compare

    compare(args)
    return Exit.DONE


TRAINING = Application(
    "python -m training",
    "Train range policies and compare them with the grid search over fixed ranges.",
    {"train": _train, "evaluate": _evaluate, "compare": _compare},
)

if __name__ == "__main__":
    sys.exit(TRAINING.main())
