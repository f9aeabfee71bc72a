"""Files in the folder of a run, and the record that repeats or continues it."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flockesc_env.common.errors import RecordError
from flockesc_env.common.files import write_text
from training.config import TYPES, Args, tuples
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
    """

    args: Args
    versions: dict[str, str] = field(default_factory=versions)

    def to_json(self, name: str = "") -> str:
        """Return the record of a run of this name as JSON."""
        document: dict[str, Any] = {
            "learner": self.args.kind,
            "args": {**dataclasses.asdict(self.args), "run": name},
            "versions": self.versions,
        }
        return json.dumps(document, indent=2) + "\n"

    def write(self) -> None:
        """Write the record into the run's folder."""
        write_text(self.args.run / CONFIG_FILE, self.to_json(self.args.run.name))

    @classmethod
    def read(cls, run: Path) -> RunRecord:
        """Read the record of a run. Arguments of earlier versions that no longer exist are ignored.

        Raises:
            FileNotFoundError: if the folder holds no run.
            RecordError: if its record is damaged.
        """
        path = run / CONFIG_FILE
        try:
            document = json.loads(path.read_text("utf-8"))
            args_type = TYPES[document["learner"]]
            known = {field.name for field in dataclasses.fields(args_type)}
            given = {name: value for name, value in document["args"].items() if name in known}
            args = args_type(**tuples({**given, "run": run}))
            return cls(args, document["versions"])
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise RecordError(str(path), "the record of a run", repr(error)) from None
