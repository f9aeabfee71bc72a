"""Files in the folder of a run, and the record that repeats or continues it."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flockesc_env.common.files import atomic_write
from training.config import KINDS, Args, make_args
from training.versions import versions

CONFIG_FILE = "config.json"
POLICY_FILE = "policy.npz"
CURVE_FILE = "curve.parquet"
RUN_FILE = "run.json"


@dataclass(frozen=True)
class RunRecord:
    """Record of a run, which suffices to repeat or continue it.

    Attributes:
        args: arguments of the run.
        versions: versions of the packages that results depend on.
        continued_at: budgets after which a finished run was continued, if its schedules changed there
            (``training.extend``).
    """

    args: Args
    versions: dict[str, str] = field(default_factory=versions)
    continued_at: tuple[int, ...] = ()

    def write(self, run: Path) -> None:
        """Write the record into the run's folder."""
        args = {**dataclasses.asdict(self.args), "run": run.name}
        document: dict[str, Any] = {
            "learner": KINDS[type(self.args)],
            "args": args,
            "versions": self.versions,
        }
        if self.continued_at:
            document["continued_at"] = self.continued_at
        with atomic_write(run / CONFIG_FILE) as file:
            file.write(json.dumps(document, indent=2).encode() + b"\n")

    @classmethod
    def read(cls, run: Path) -> RunRecord:
        """Read the record of a run.

        Raises:
            FileNotFoundError: if the folder holds no run.
        """
        document = json.loads((run / CONFIG_FILE).read_text())
        args = make_args(document["learner"], {**document["args"], "run": run})
        return cls(args, document["versions"], tuple(document.get("continued_at", ())))
