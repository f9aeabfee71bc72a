"""A separate process that loads corrupted documents and plays the scenarios that load.

``python corrupted_documents.py FIRST COUNT`` prints the outcomes of COUNT seeds from FIRST on as JSON,
with the memory used in bytes. It fails with a traceback if a document takes longer than ``SECONDS``.
"""

from __future__ import annotations

import faulthandler
import json
import random
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path
from subprocess import run
from typing import Any

import numpy as np
from mutations import Document, good_documents, mutated

from flockesc_env import FlockEscapeEnv, FlockScenario, LineEscapeEnv, LineScenario, _core
from flockesc_env.common.errors import ScenarioError

SECONDS = 2
MOST_WORK = 2_000
"""Most agents of a scenario that is played; larger ones are only loaded."""


def load(document: Document) -> FlockScenario | LineScenario | None:
    """Return a scenario, or ``None`` if it raises ``ScenarioError``; other errors pass through."""
    model, language, text = document
    try:
        return model.from_json(text) if language == "json" else model.from_toml(text)
    except ScenarioError as error:
        str(error)
        return None


def check_in_core(document: Document) -> None:
    """Pass the text to the core unchanged."""
    check = _core.check_flock_scenario if document[0] is FlockScenario else _core.check_line_scenario
    with suppress(ScenarioError, UnicodeEncodeError):  # the core accepts no lone surrogates
        check(document[2])


def play(scenario: FlockScenario | LineScenario) -> str:
    """Reset and step a few times."""
    try:
        env: Any = (
            FlockEscapeEnv(scenario, max_range=50.0)
            if isinstance(scenario, FlockScenario)
            else LineEscapeEnv(scenario)
        )
    except ScenarioError as error:
        if "predator" not in error.field:
            raise
        return "no environment"
    env.reset(seed=1)
    for _ in range(3):
        _, _, terminated, truncated, _ = env.step(np.array([0.25]))
        if terminated or truncated:
            break
    return "played"


def peak() -> int:
    """Return the peak memory of this process in bytes."""
    # Not getrusage, whose figure starts with that of the parent process.
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) * 1024


def outcome_of(first: int, count: int) -> dict[str, Any]:
    """Run this file in a new process, with warnings as errors, and return its output."""
    command = [sys.executable, "-W", "error", __file__, str(first), str(count)]
    done = run(command, capture_output=True, text=True, cwd=Path(__file__).parent, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    outcome: dict[str, Any] = json.loads(done.stdout)
    assert not done.stderr, done.stderr
    return outcome


def check(outcome: dict[str, Any], count: int) -> None:
    """Fail unless every document loaded or was refused, with little memory."""
    assert set(outcome["became"]) <= {"refused", "played", "too large to play", "no environment"}
    assert sum(outcome["became"].values()) == count
    assert outcome["became"]["played"] > count / 20
    assert outcome["most"] < 16 * 2**20
    assert outcome["peak"] < 2**30


def main(first: int, count: int) -> None:
    """Load the documents of some seeds."""
    good = good_documents()
    for document in good:
        assert load(document) is not None
    became: Counter[str] = Counter()
    most = 0
    for seed in range(first, first + count):
        rng = random.Random(seed)  # noqa: S311
        model, language, text = rng.choice(good)
        document = model, language, mutated(text, rng)
        faulthandler.dump_traceback_later(SECONDS, exit=True)
        before = peak()
        try:
            check_in_core(document)
            scenario = load(document)
            most = max(most, peak() - before)
            if scenario is None:
                became["refused"] += 1
            elif scenario.num_agents > MOST_WORK:
                became["too large to play"] += 1
            else:
                became[play(scenario)] += 1
        except BaseException as error:
            became[f"{type(error).__name__}"] += 1
            print(seed, language, f"{type(error).__name__}: {error!s:.300}", file=sys.stderr)
        faulthandler.cancel_dump_traceback_later()
    print(json.dumps({"became": became, "most": most, "peak": peak()}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
