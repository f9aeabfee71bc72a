"""Record the run of an environment's tests: versions, number of tests, date and number of commits.

Usage: ENVIRONMENT/bin/python compat/record.py ENVIRONMENT JUNIT_FILE
"""

from __future__ import annotations

import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import distributions
from pathlib import Path

RECORD = Path("results/scoreboard/compat.json")
PACKAGES = (
    *("numpy", "gymnasium", "pettingzoo", "stable-baselines3", "rl_zoo3", "supersuit", "torchrl"),
    *("benchmarl", "ray", "torch"),
)


def main(environment: str, junit: str) -> None:
    """Replace the entry of an environment."""
    (suite,) = ET.parse(junit).getroot().iter("testsuite")  # noqa: S314, pytest wrote it
    installed = {each.metadata["Name"].lower().replace("_", "-"): each.version for each in distributions()}
    versions = [
        f"{name} {installed[key]}" for name in PACKAGES if (key := name.replace("_", "-")) in installed
    ]
    entries = json.loads(RECORD.read_text()) if RECORD.is_file() else {}
    entries[environment] = {
        "versions": ", ".join([f"Python {sys.version.split()[0]}", *versions]),
        "tests": int(suite.get("tests", "0")) - int(suite.get("skipped", "0")),
        "failures": int(suite.get("failures", "0")) + int(suite.get("errors", "0")),
        "date": suite.get("timestamp", "")[:10],
        "commits": int(subprocess.check_output(["git", "rev-list", "--count", "HEAD"])),  # noqa: S607
    }
    RECORD.parent.mkdir(parents=True, exist_ok=True)
    RECORD.write_text(json.dumps(dict(sorted(entries.items())), indent=1) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
