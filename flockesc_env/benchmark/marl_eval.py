"""``write_marl_eval``: results as the JSON document that the library marl-eval reads.

The format is that of Gorsane et al., "Towards a Standardised Performance Evaluation Protocol for Cooperative
MARL" (2022): environment, task, algorithm, run. A run has its evaluation after training only.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from flockesc_env.benchmark.results import Result
from flockesc_env.common.files import write_text

ENVIRONMENT: Final = "flockesc"
SUFFIX: Final = ".marl-eval.json"


def marl_eval(results: Iterable[Result]) -> dict[str, Any]:
    """Return the document of some results: the score of every run.

    Objectives are left out, because marl-eval needs the same metrics in all tasks.
    """
    found: dict[str, Any] = {}
    for result in results:
        training = result.training
        seeds = training.seeds if training else range(len(result.policies))
        runs = {}
        for seed, score in zip(seeds, result.scores(), strict=True):
            metrics = {"score": [float(score)]}
            steps = {"step_count": training.samples if training else 0, **metrics}
            runs[f"seed_{seed}"] = {"step_0": steps, "absolute_metrics": metrics}
        found.setdefault(result.task, {})[result.learner] = runs
    return {ENVIRONMENT: found}


def write_marl_eval(results: Iterable[Result], path: Path) -> None:
    """Write the document of some results beside a file, with the same name and another suffix."""
    write_text(path.with_suffix(SUFFIX), json.dumps(marl_eval(results), indent=1) + "\n")
