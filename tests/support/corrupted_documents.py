"""A separate process that corrupts valid documents, loads them and plays the scenarios that load.

``python corrupted_documents.py FIRST COUNT`` prints the outcomes of COUNT seeds from FIRST on as JSON,
with the memory used in bytes. It fails with a traceback if a document takes longer than ``SECONDS``.
"""

from __future__ import annotations

import faulthandler
import json
import random
import re
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path
from subprocess import run
from typing import Any

import numpy as np
from option_table import embedded

from flockesc_env import PRESETS, FlockEscapeEnv, FlockScenario, LineEscapeEnv, LineScenario, _core
from flockesc_env.common.errors import ScenarioError

SECONDS = 2
MOST_WORK = 2_000
"""Most agents of a scenario that is played; larger ones are only loaded."""

Document = tuple[type[FlockScenario | LineScenario], str, str]
"""The model, the format ("json" or "toml") and the text."""

NUMBERS = (
    *("1e308", "-1e308", "-0", "0", "1e-320", "1e400", "-1", "0.5", "3", "7", "1e9", "100000000"),
    *("9223372036854775807", "18446744073709551616", "1" + 5000 * "0", "0x" + 5000 * "f", "NaN", "inf"),
    *("-Infinity", "null", "true", '"None"', '"1"', "[]", "{}", "[1.0]"),
)
TOKENS = (
    *("{", "}", "[", "]", ",", ":", "=", '"', "'", '"""', "#", "\\", "\\u", "\n", "\t", "\0", "\ufeff"),
    *("\ud800", "null", "NaN", "None", "1", "e", ".", "-", "[[predators]]", "[predators]", "1979-05-27"),
    *('"mass": 1,', "mass = 1\n", '"predators": [],', "é", "[" * 200, '{"a":' * 200, "[" * 100_000),
)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?|true|false|null")
WORD = re.compile(r"[a-z_]{3,}")


def good_documents() -> list[Document]:
    """Return every preset with all parameters, for D = 2 and 3, as JSON and as TOML."""
    scenarios: list[FlockScenario | LineScenario] = [preset.scenario for preset in PRESETS.values()]
    space = [
        flock.replace(dimension=3, predators=tuple(embedded(predator, 3) for predator in flock.predators))
        for flock in scenarios
        if isinstance(flock, FlockScenario)
        if flock.dimension == 2 and flock.neighbor_rule.kind != "voronoi"
    ]
    return [
        (type(scenario), language, text)
        for scenario in scenarios + space
        for language, text in (("json", scenario.to_json()), ("toml", scenario.to_toml()))
    ]


def mutated(text: str, rng: random.Random) -> str:
    """Return a text with one to three changes."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice((flip, splice, swap, swap, swap, nest, reshape))
        text = change(text, rng)
    return text


def flip(text: str, rng: random.Random) -> str:
    """Change a bit of a byte."""
    data = bytearray(text.encode("utf-8", "surrogatepass"))
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data.decode("utf-8", "replace")


def splice(text: str, rng: random.Random) -> str:
    """Delete, repeat or cut a part, or insert a token."""
    at, length = rng.randrange(len(text) + 1), rng.choice((1, 2, 5, 40, 400))
    part, rest = text[at : at + length], text[at + length :]
    middle = rng.choice(("", part * rng.choice((2, 3, 20)), rng.choice(TOKENS) + part))
    return text[:at] + middle + rng.choice((rest, rest, rest, ""))


def swap(text: str, rng: random.Random) -> str:
    pattern = rng.choice((NUMBER, NUMBER, re.compile(r"\d"), WORD))
    others = [*pattern.findall(text), *(NUMBERS if pattern is NUMBER else ("-1", "1e", "00", "."))]
    return replaced(text, rng, pattern, lambda _: rng.choice(others))


def nest(text: str, rng: random.Random) -> str:
    depth = rng.choice((1, 2, 100, 300, 3000))
    left, right = rng.choice((("[", "]"), ('{"metric":', "}"), ("{a=", "}")))
    return replaced(text, rng, NUMBER, lambda old: left * depth + old + right * depth)


def replaced(text: str, rng: random.Random, pattern: re.Pattern[str], new: Any) -> str:
    found = list(pattern.finditer(text))
    if not found:
        return text
    match = rng.choice(found)
    return text[: match.start()] + new(match.group()) + text[match.end() :]


def reshape(text: str, rng: random.Random) -> str:
    """Change a value somewhere in a JSON document."""
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError):
        return swap(text, rng)
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
            places.append((node, key))
            walk(node[key])

    walk(tree)
    if not places:
        return "[]"
    (into, key), (source, name) = rng.choice(places), rng.choice(places)
    into[key] = json.loads(json.dumps(source[name]))
    return json.dumps(tree)


def load(document: Document) -> FlockScenario | LineScenario | None:
    """Return a scenario, or ``None`` if it raises ``ScenarioError``; other errors pass through."""
    model, language, text = document
    check = _core.check_flock_scenario if model is FlockScenario else _core.check_line_scenario
    with suppress(ScenarioError, UnicodeEncodeError):  # the core accepts no lone surrogates
        check(text)
    try:
        return model.from_json(text) if language == "json" else model.from_toml(text)
    except ScenarioError as error:
        str(error)
        return None


def play(scenario: FlockScenario | LineScenario) -> str:
    """Reset and step a few times."""
    is_flock = isinstance(scenario, FlockScenario)
    try:
        env: Any = FlockEscapeEnv(scenario, max_range=50.0) if is_flock else LineEscapeEnv(scenario)
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
    # Not getrusage, whose figure starts with that of the parent process.
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) * 1024


def outcome_of(first: int, count: int) -> dict[str, Any]:
    """Run this file in a new process, with warnings as errors, and return its output."""
    command = [sys.executable, "-W", "error", __file__, str(first), str(count)]
    done = run(command, capture_output=True, text=True, cwd=Path(__file__).parent, check=False)  # noqa: S603
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    outcome: dict[str, Any] = json.loads(done.stdout)
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
    assert all(load(document) is not None for document in good)
    became: Counter[str] = Counter()
    most = 0
    for seed in range(first, first + count):
        rng = random.Random(seed)  # noqa: S311
        model, language, text = rng.choice(good)
        document = model, language, mutated(text, rng)
        faulthandler.dump_traceback_later(SECONDS, exit=True)
        before = peak()
        try:
            scenario = load(document)
            most = max(most, peak() - before)
            if scenario is None:
                became["refused"] += 1
            else:
                became["too large to play" if scenario.num_agents > MOST_WORK else play(scenario)] += 1
        except BaseException as error:
            became[f"{type(error).__name__}"] += 1
            print(seed, language, f"{type(error).__name__}: {error!s:.300}", file=sys.stderr)
        faulthandler.cancel_dump_traceback_later()
    print(json.dumps({"became": became, "most": most, "peak": peak()}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
