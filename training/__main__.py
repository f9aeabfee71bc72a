"""Command line: ``python -m training --help``."""

from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from training.arguments import CompareArgs, EvaluateArgs, StudyArgs, TuneArgs
from training.config import train_presets

RESULTS, PAGE = Path("results/learned"), Path("docs/results.md")

Preset = tyro.extras.subcommand_type_from_defaults(train_presets(), prefix_names=False)

app = tyro.extras.SubcommandApp()


@app.command(name="train")
def _train(args: Annotated[Preset, tyro.conf.arg(name="")]) -> None:  # type: ignore[valid-type]
    """Train a range policy, starting from a preset; an unfinished run is continued."""
    from training.train import train

    print("Policy:", train(args))


@app.command(name="evaluate")
def _evaluate(args: Annotated[EvaluateArgs, tyro.conf.arg(name="")]) -> None:
    """Evaluate one policy on held-out flocks."""
    from training.evaluate import evaluate

    evaluate(args)


@app.command(name="compare")
def _compare(args: Annotated[CompareArgs, tyro.conf.arg(name="")]) -> None:
    """Compare policies with the best fixed range on the same held-out flocks."""
    from training.compare import compare

    compare(args)


@app.command(name="tune")
def _tune(args: Annotated[TuneArgs, tyro.conf.arg(name="")]) -> None:
    """Choose hyperparameters of a learner on tuning flocks, with Optuna."""
    from training.tune import tune

    found = tune(args)
    print("Best:", found.best_value, found.best_params)


@app.command(name="study")
def _study(args: Annotated[StudyArgs, tyro.conf.arg(name="")]) -> None:
    """Rerun one row of the comparison from nothing: training, evaluation, files for the page."""
    from studies.learned.study import study

    print("Results:", study(args))


@app.command(name="page")
def _page(results: Path = RESULTS, page: Path = PAGE) -> None:
    """Write the page of results and its figures from the studies' files; print the README's table.

    Args:
        results: folder of the studies.
        page: the page's file.
    """
    from studies.learned.page import write_page

    print(write_page(results, page))


@app.command(name="submit")
def _submit(
    setting: Positional[str],
    policy: Positional[str],
    name: Positional[str],
    results: Path = RESULTS,
    page: Path = PAGE,
) -> None:
    """Run your own policy on the held-out flocks of a setting, and add it to the page.

    Args:
        setting: name of the preset.
        policy: built-in policy, policy file, folder of a run, or module:function.
        name: what tables and figures call it.
        results: folder of the studies.
        page: the page's file.
    """
    from studies.learned.submit import submit

    submit(setting, policy, name, results, page)


if __name__ == "__main__":
    app.cli(description="Train range policies and compare them with the grid search over fixed ranges.")
