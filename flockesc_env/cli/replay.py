"""The command ``flockesc replay``: run recorded runs again and compare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, several
from flockesc_env.cli.output import note, show, show_json
from flockesc_env.common.errors import FlockescError, InputError
from flockesc_env.models import records


def run(
    files: Annotated[
        Positional[tuple[Path, ...]],
        several("recorded runs (.npz) that flockesc simulate --output wrote", "FILE .."),
    ],
    *,
    json: Json = False,
) -> Exit:
    """Run recorded runs again and compare every number with the record.

    Prints "matches" if all bits are equal, otherwise the attributes that differ.

    The exit code is 1 if a run differs, and 2 if a file is not a recorded run.

    Example: flockesc replay run.npz
    """
    if not files:
        raise InputError("files", "at least one file", "none")
    reports = []
    for path in files:
        report = _report(path)
        reports.append(report)
        if not json:
            show(f"{path}: {report['outcome']}", *(f"  {line}" for line in report["differences"]))
        if report["recorded_with"] not in (None, records.versions()):
            before, now = _listed(report["recorded_with"]), _listed(records.versions())
            note(f"{path}: recorded with {before}; now {now}")
    if json:
        show_json({"command": "replay", "files": reports, "versions": records.versions()})
    outcomes = {report["outcome"] for report in reports}
    if "refused" in outcomes:
        return Exit.REFUSED
    return Exit.FAILED if "differs" in outcomes else Exit.DONE


def _report(path: Path) -> dict[str, Any]:
    report: dict[str, Any] = {"file": str(path), "outcome": "refused", "differences": []}
    report |= {"error": None, "recorded_with": None}
    try:
        record = records.load_run(path)
        found = records.run_differences(record.trajectory, records.replay_run(record.trajectory))
    except (FlockescError, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error).removeprefix(f"{path}: ")
        note(f"error: {path}: {reason}")
        return {**report, "error": reason}
    outcome = "differs" if found else "matches"
    return {**report, "outcome": outcome, "differences": found, "recorded_with": record.versions}


def _listed(versions: dict[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items())
