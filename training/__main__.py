"""Entry point of ``python -m training``: the commands train, learners and figures."""

import sys
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.application import Application
from flockesc_env.cli.flags import EXPECTED, policy_of
from flockesc_env.cli.output import Exit, check_output, show, table
from flockesc_env.common.extras import require
from flockesc_env.taskset import tasks
from flockesc_env.taskset.learners import OWN_ALGORITHMS

_MODULES = ("cmaes", "matplotlib", "polars", "sb3_contrib", "stable_baselines3", "tensorboard", "torch")
_Task = Annotated[Positional[str], arg(help="name of a task; flockesc tasks lists them", metavar="TASK")]


def _train(
    task: _Task,
    *,
    learner: Annotated[str, arg(help="a table of flockesc_env/taskset/learners/TASK.toml")],
    seed: Annotated[int, arg(help="seed of the learner and of its flocks")] = 0,
    run: Annotated[Path | None, arg(help="folder of the run; none: runs/TASK/LEARNER-SEED")] = None,
    resume: Annotated[bool, arg(help="continue the unfinished run in the folder")] = False,
    progress: Annotated[bool, arg(help="show a progress bar")] = True,
) -> Exit:
    """Train a policy on a task.

    The folder gets policy.npz, run.json with the learning curve and, from stable-baselines3,
    model.zip, best_model.zip, progress.csv and files for TensorBoard.

    Example: python -m training train per-agent-visible --learner ppo --seed 3
    """
    require("train", _MODULES)
    from training.run import Run
    from training.train import train

    folder = Path("runs") / task / f"{learner}-{seed}" if run is None else run
    show(f"Policy: {train(Run.of(task, learner, seed, folder, progress=progress), resume=resume)}")
    return Exit.DONE


def _learners(task: _Task) -> Exit:
    """List the learners of a task.

    Example: python -m training learners per-agent-visible
    """
    chosen = tasks[task]
    rows = []
    for name, one in chosen.learners.items():
        samples = "-" if one.algorithm in OWN_ALGORITHMS else f"{one.samples or chosen.samples:,}"
        rows.append([name, one.algorithm, str(one.seeds), samples, one.note])
    show(*table(["learner", "algorithm", "seeds", "samples", "note"], rows))
    return Exit.DONE


def _figures(
    policies: Annotated[Positional[tuple[str, ...]], arg(help=EXPECTED, metavar="POLICY ..")],
    *,
    task: Annotated[str, arg(help="name of a task; flockesc tasks lists them")],
    flocks: Annotated[int, arg(help="number of held-out flocks")] = 200,
    output: Annotated[Path, arg(help="folder of the table, figures and recorded runs")] = Path(
        "runs/comparison"
    ),
) -> Exit:
    """Draw policies beside the best fixed range on the same held-out flocks.

    It prints the table of ``flockesc compare``, and also records two runs.

    Example: python -m training figures runs/per-agent-visible/ppo-3 --task per-agent-visible
    """
    require("train", _MODULES)
    check_output(output)
    from training.figures import draw

    chosen = tasks[task]
    draw(chosen, [policy_of(spec, task=chosen) for spec in policies], output, flocks)
    return Exit.DONE


TRAINING = Application(
    "python -m training",
    "Train range policies and draw them beside the best fixed range.",
    {"train": _train, "learners": _learners, "figures": _figures},
)

if __name__ == "__main__":
    sys.exit(TRAINING.main())
