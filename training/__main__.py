"""Entry point of ``python -m training``: the commands train, extend, evaluate, compare and tune."""

import sys
from typing import Annotated

import tyro

from flockesc_env.cli.output import prepare_terminal
from training.arguments import CompareArgs, EvaluateArgs, ExtendArgs, TuneArgs
from training.presets import train_descriptions, train_presets

Preset = tyro.extras.subcommand_type_from_defaults(train_presets(), train_descriptions(), prefix_names=False)

app = tyro.extras.SubcommandApp()


@app.command(name="train")
def _train(args: Annotated[Preset, tyro.conf.arg(name="")]) -> None:  # type: ignore[valid-type]
    """Train a range policy from a preset, or continue an unfinished run."""
    from training.train import train

    print("Policy:", train(args))


@app.command(name="extend")
def _extend(args: Annotated[ExtendArgs, tyro.conf.arg(name="")]) -> None:
    """Continue a finished run with a larger budget, in a new folder."""
    from training.extend import extend, scheduled
    from training.record import RunRecord

    policy = extend(args)
    print("Policy:", policy)
    record = RunRecord.read(policy.parent)
    if record.continued_at:
        field, times = scheduled(record.args), ", ".join(map(str, record.continued_at))
        print(f"It differs from the policy of one long run: the schedule of {field} changed at {times}.")


@app.command(name="evaluate")
def _evaluate(args: Annotated[EvaluateArgs, tyro.conf.arg(name="")]) -> None:
    """Evaluate a policy on held-out flocks."""
    from training.evaluate import evaluate

    evaluate(args)


@app.command(name="compare")
def _compare(args: Annotated[CompareArgs, tyro.conf.arg(name="")]) -> None:
    """Compare policies with the best fixed range on the same held-out flocks."""
    from training.compare import compare

    compare(args)


@app.command(name="tune")
def _tune(args: Annotated[TuneArgs, tyro.conf.arg(name="")]) -> None:
    """Tune the hyperparameters of a learner on tuning flocks with Optuna."""
    from training.tune import tune

    found = tune(args)
    print("Best:", found.best_value, found.best_params)


def main() -> int:
    """Run a command and return its exit code: 0, 2 for invalid input, 130 after Ctrl-C."""
    prepare_terminal()
    try:
        app.cli(
            prog="python -m training",
            description="Train range policies and compare them with the grid search over fixed ranges.",
        )
    except KeyboardInterrupt as stop:
        kept = [str(argument) for argument in stop.args] or ["run the same command again to continue"]
        print(": ".join(["training: interrupted", *kept]), file=sys.stderr)
        return 130
    except ModuleNotFoundError as error:
        command = 'pip install "flockesc-env[train]"'
        print(f"training: error: {error.name} is not installed; run `{command}`", file=sys.stderr)
        return 2
    except (OSError, RuntimeError, ValueError) as error:
        print(f"training: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    if code := main():
        sys.exit(code)
