"""Command line: ``python -m training train | evaluate | compare``."""

from typing import Annotated

import tyro

from training.compare import CompareArgs, compare
from training.config import train_presets
from training.evaluate import EvaluateArgs, evaluate
from training.train import train

Preset = tyro.extras.subcommand_type_from_defaults(train_presets(), prefix_names=False)

app = tyro.extras.SubcommandApp()


@app.command(name="train")
def _train(args: Annotated[Preset, tyro.conf.arg(name="")]) -> None:  # type: ignore[valid-type]
    """Train a range policy, starting from a preset; an unfinished run is continued."""
    print("Policy:", train(args))


@app.command(name="evaluate")
def _evaluate(args: Annotated[EvaluateArgs, tyro.conf.arg(name="")]) -> None:
    """Evaluate one policy on held-out flocks."""
    evaluate(args)


@app.command(name="compare")
def _compare(args: Annotated[CompareArgs, tyro.conf.arg(name="")]) -> None:
    """Compare policies with the best fixed range on the same held-out flocks."""
    compare(args)


if __name__ == "__main__":
    app.cli(description="Train range policies and compare them with the grid search over fixed ranges.")
