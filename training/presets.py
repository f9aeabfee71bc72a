"""TOML presets of training runs: a setting and its learners."""

from __future__ import annotations

import dataclasses
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from training.config import Args, ImitationArgs, SB3Args, Setting, make_args, tuples

PRESETS = Path(__file__).parent / "configs"


@dataclass(frozen=True)
class Learner:
    """A learner of a preset.

    Attributes:
        args: arguments of its runs; folder and seed are those of the first run.
        seeds: number of training seeds in the reported comparison.
        note: remark for readers of the results; may be empty.
    """

    args: Args
    seeds: int
    note: str = ""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments that the runs of all seeds share."""
        per_run = {"run", "seed", "progress"}
        return {name: value for name, value in dataclasses.asdict(self.args).items() if name not in per_run}


@dataclass(frozen=True)
class Preset:
    """A preset: one file of ``training/configs``.

    Attributes:
        title: title in tables and on the page of results.
        setting: the task.
        learners: the learners by name.
    """

    title: str
    setting: Setting
    learners: dict[str, Learner]


def presets() -> dict[str, Preset]:
    """Return the presets of ``training/configs`` by name."""
    return {
        file.stem: _preset(tomllib.loads(file.read_text("utf-8")), file.stem)
        for file in sorted(PRESETS.glob("*.toml"))
    }


def train_presets() -> dict[str, Args]:
    """Return the arguments of every learner of every preset by its name, ``<preset>-<learner>``."""
    return {
        f"{name}-{learner}": entry.args
        for name, chosen in presets().items()
        for learner, entry in chosen.learners.items()
    }


def train_descriptions() -> dict[str, str]:
    """Return a one-line description of every entry of ``train_presets``."""
    return {
        f"{name}-{learner}": "; ".join(filter(None, (chosen.title, _method(entry.args), entry.note)))
        for name, chosen in presets().items()
        for learner, entry in chosen.learners.items()
    }


def _method(args: Args) -> str:
    """Return a description of a learner's method, for example ``PPO with reward running_minimum``."""
    match args:
        case SB3Args():
            return f"{args.kind.upper()}, reward {args.reward}"
        case ImitationArgs():
            return f"imitation of values, teacher {args.teacher}"
    return "CMA-ES"


def _preset(document: dict[str, Any], name: str) -> Preset:
    setting = document.get("setting", {})
    learners = {}
    for learner, values in document["learners"].items():
        fields = {**setting, "run": Path("runs") / f"{name}-{learner}", **values}
        seeds, note, kind = fields.pop("seeds", 0), fields.pop("note", ""), fields.pop("kind")
        learners[learner] = Learner(make_args(kind, fields), seeds, note)
    return Preset(document["title"], Setting(**tuples(setting)), learners)
