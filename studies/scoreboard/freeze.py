"""The tasks of the benchmark with everything that normalizes scores: writes the file that is then frozen."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import tomli_w

from flockesc_env import AlignedHeadings, FlockScenario, preset
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.episodes.options import PROFILE_RANGES
from flockesc_env.jobs import Arrays, Job
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.tasks.seeds import TUNING, first_seeds
from flockesc_env.tasks.statistics import means
from flockesc_env.tasks.task import FLOCKS, VERSION, Scenario
from studies.findings.held_out import FLOCK_GRID, LINE_GRID
from studies.findings.names import CLAIRVOYANT
from studies.findings.playing import play_job
from studies.findings.references import clairvoyant, free_headings, informed_greedy, is_bounded
from studies.findings.results import EPISODES_FILE, REFERENCES_FILE
from studies.findings.starts import max_angle
from studies.measurements import Runner, chunks
from training.config import Setting

RESULTS = Path("results/findings")
"""Measurements of the study of learned ranges, which has the references of two tasks."""

_SIMULATED_FLOCKS = 60
"""Held-out flocks of a clairvoyant schedule in ``aligned-head-on``; each takes 6 seconds."""

_ALIGNED = AlignedHeadings((-1.0, -1.0), max_angle(0.96))

SCENARIOS: dict[str, Scenario] = {
    "paper-flock": preset("paper-flock"),
    "flock-100": FlockScenario(num_agents=100),
    "flock-1000": FlockScenario(num_agents=1000),
    "intercept": preset("intercept"),
    "two-predators": preset("two-predators"),
    "pursuit": preset("pursuit"),
    "aligned-head-on": FlockScenario(initial_headings=_ALIGNED),
    "aligned-pursuit": preset("pursuit").replace(initial_headings=_ALIGNED),
    "paper-line": preset("paper-line"),
}
"""In the aligned ones, agents fly toward the predator; the expected initial polarization is 0.96."""

_VISIBLE, _LOCAL = {"predator_sensing_range": "None"}, {"predator_sensing_range": "predator_range"}


@dataclass(frozen=True, kw_only=True)
class Definition:
    """What a person decides about a task; the rest is measured."""

    asks: str
    worlds: tuple[str, ...] = ("paper-flock",)
    trained_on: str = ""
    per_agent: bool = True
    objective: str = "mean"
    samples: int = 3_240_000
    options: dict[str, Any] = field(default_factory=dict)
    shortcut: str = ""
    says: str = ""
    controls: Sequence[tuple[str, str]] = ()
    """Pairs of policies; ``best`` is the best fixed range."""


SHARED = {**_VISIBLE, "max_range": 40.0, "steps_per_action": 4}
VISIBLE = {**_VISIBLE, "max_range": 20.0, "steps_per_action": 4}
LOCAL = {**_LOCAL, "max_range": 40.0, "steps_per_action": 4}

DEFINITIONS = {
    "shared": Definition(
        asks="One range for the flock: when should all agents listen, and how far?",
        per_agent=False,
        samples=300_000,
        options=SHARED,
        shortcut="listen-while-fleeing",
        says="All listen while the flock heads away from the predator, otherwise nobody does.",
    ),
    "per-agent-visible": Definition(
        asks="One range per agent, predator always seen: whom should an agent follow?",
        options=VISIBLE,
        shortcut="stubborn-leaders",
        says="An agent stops listening once it heads past the predator.",
    ),
    "per-agent-local": Definition(
        asks="One range per agent, predator seen within 30 m: what can be done before it comes?",
        options=LOCAL,
        shortcut="stubborn-witnesses",
        says="Agents fly out of the flock, then listen once with a long range.",
    ),
    "per-agent-visible-profile": Definition(
        asks="An agent knows what each of 8 ranges would bring: is there more to learn than to compare them?",
        options={
            **_VISIBLE,
            "max_range": 100.0,
            "steps_per_action": 2,
            "profile_ranges": list(PROFILE_RANGES),
            "extra_entries": ["escape_direction", "closest_approach"],
        },
        shortcut="turn-away",
        says="An agent takes the range whose heard heading is nearest to its escape direction.",
    ),
    "steering-predator": Definition(
        asks="The predator turns toward the nearest agent: does a policy still split the flock in time?",
        worlds=("pursuit",),
        options=VISIBLE,
        shortcut="stubborn-leaders",
        says="An agent stops listening once it heads past the predator.",
    ),
    "line": Definition(
        asks="One range for the agents on a line: which of them should agree, and in which order?",
        worlds=("paper-line",),
        per_agent=False,
        objective="escape_distance",
        samples=300_000,
        options={"max_range": 1.0, "steps_per_action": 1},
        shortcut="random",
        says="Random ranges; no rule for the line is known.",
    ),
    "held-out-worlds": Definition(
        asks="Trained against one predator that flies straight on: does a policy hold against others?",
        worlds=("intercept", "two-predators"),
        trained_on="paper-flock",
        options=VISIBLE,
        shortcut="stubborn-leaders",
        says="An agent stops listening once it heads past the predator.",
    ),
    "held-out-sizes": Definition(
        asks="Trained with 300 agents: does a policy hold for 100 and for 1,000?",
        worlds=("flock-100", "flock-1000"),
        trained_on="paper-flock",
        options=VISIBLE,
        shortcut="stubborn-leaders",
        says="An agent stops listening once it heads past the predator.",
    ),
    "warned-flock": Definition(
        asks="The flock flies toward the predator: how far should warnings go, if the nearest agent counts?",
        worlds=("aligned-head-on",),
        per_agent=False,
        objective="minimum",
        samples=300_000,
        options=SHARED,
        shortcut="listen-while-fleeing",
        says="All listen while the flock heads away from the predator, otherwise nobody does.",
        controls=(("best", "fixed:0"), ("best", "fixed:150")),
    ),
    "warned-agents": Definition(
        asks="The flock flies toward a pursuer that agents see within 30 m: who should pass the warning on?",
        worlds=("aligned-pursuit",),
        options=LOCAL,
        shortcut="stubborn-witnesses",
        says="Agents fly out of the flock, then listen once with a long range.",
        controls=(("best", "fixed:0"), ("best", "fixed:150")),
    ),
    "warned-nearest": Definition(
        asks="Only the nearest agent counts, and agents see the predator within 30 m: is a warning in time?",
        objective="minimum",
        options={**LOCAL, "max_range": 60.0},
        shortcut="listen-while-threatened",
        says="An agent listens while its closest approach to a predator that it sees is short.",
        controls=(("listen-while-threatened", "best"),),
    ),
}


def freeze(path: Path, runner: Runner) -> None:
    """Measure what normalizes the scores of every task, and write the file of the tasks."""
    named = {
        name: replace(entry, trained_on=entry.trained_on or entry.worlds[0])
        for name, entry in DEFINITIONS.items()
    }
    document = {
        "version": VERSION,
        "scenarios": {name: _plain(scenario) for name, scenario in SCENARIOS.items()},
        "tasks": {name: _task(entry, runner) for name, entry in named.items()},
    }
    write_text(path, tomli_w.dumps(document))


def _plain(scenario: Scenario) -> dict[str, Any]:
    fields: dict[str, Any] = json.loads(scenario.to_json(), object_hook=_without_none)
    return fields


def _without_none(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: "None" if value is None else value for name, value in fields.items()}


def _task(entry: Definition, runner: Runner) -> dict[str, Any]:
    worlds = [_world(entry, name, runner) for name in entry.worlds]
    shares = []
    for name, world in zip(entry.worlds, worlds, strict=True):
        reached = _play(entry, entry.shortcut, name, FLOCKS, runner).mean()
        shares.append((reached - world["zero"]) / (world["one"] - world["zero"]))
    options = {**entry.options, **({} if entry.worlds == ("paper-line",) else {"objective": entry.objective})}
    return {
        "asks": entry.asks,
        "per_agent": entry.per_agent,
        "objective": entry.objective,
        "trained_on": entry.trained_on,
        "samples": entry.samples,
        "options": options,
        "worlds": worlds,
        "shortcuts": [{"policy": entry.shortcut, "says": entry.says, "score": float(np.mean(shares))}],
        "controls": [_control(entry, pair, worlds[0], runner) for pair in entry.controls],
    }


def _world(entry: Definition, name: str, runner: Runner) -> dict[str, Any]:
    is_line = name == "paper-line"
    grid = LINE_GRID if is_line else FLOCK_GRID
    column = _column(entry)
    tuning = first_seeds(TUNING, 200 if name == "flock-1000" else 1000)  # large flocks are slow
    jobs = {"": seed_jobs(OUTCOMES, SCENARIOS[name], tuple(map(float, grid)), tuning)}
    tuned = runner.groups(jobs, f"Fixed ranges in {name}")[""][column]
    best = float(grid[int(tuned.mean(axis=1).argmax())])
    fixed = _play(entry, f"fixed:{best:.12g}", name, FLOCKS, runner)
    reached = _reference(entry, name, runner)
    same_flocks = fixed[: len(reached)]
    (gain,) = means((reached - same_flocks)[np.newaxis, np.newaxis])
    return {
        "scenario": name,
        "best_fixed_range": best,
        "zero": float(fixed.mean()),
        "one": float(reached.mean() + (fixed.mean() - same_flocks.mean())),
        "one_error": (gain.high - gain.mean) * math.sqrt(1 - len(reached) / len(fixed)),
        "reference": _kind(entry, name),
    }


def _column(entry: Definition) -> str:
    return {"mean": "min_mean_distance", "minimum": "min_min_distance"}.get(entry.objective, entry.objective)


def _play(
    entry: Definition, policy: str, world: str, flocks: range, runner: Runner, strength: float | None = None
) -> FloatArray:
    """Return the objective of every flock, without the escape force if ``strength`` is 0."""
    scenario = SCENARIOS[world]
    if strength is not None:
        scenario = scenario.replace(repulsion_strength=strength)
    jobs = {part: play_job(policy, scenario, _column(entry), part) for part in chunks(flocks, 250)}
    return np.concatenate([found["objective"] for found in runner.each(jobs, policy).values()])


def _control(
    entry: Definition, pair: tuple[str, str], world: dict[str, Any], runner: Runner
) -> dict[str, Any]:
    policy, baseline = (f"fixed:{world['best_fixed_range']:g}" if name == "best" else name for name in pair)
    gains = []
    for strength in (None, 0.0):
        reached, other = (
            _play(entry, name, entry.worlds[0], FLOCKS, runner, strength) for name in (policy, baseline)
        )
        found = mean(reached - other)
        gains.append([found.mean, found.low, found.high])
    return {"policy": policy, "baseline": baseline, "gain": gains[0], "gain_without_force": gains[1]}


def _kind(entry: Definition, world: str) -> str:
    """Return the reference of a world: a bound where there is one for what the task's actions set."""
    scenario = SCENARIOS[world]
    if not isinstance(scenario, FlockScenario):
        return "hindsight"
    if not entry.per_agent:
        return "clairvoyant"
    return "free headings" if is_bounded(scenario) else "informed greedy"


def _reference(entry: Definition, world: str, runner: Runner) -> FloatArray:
    """Return the objective of the reference on the first held-out flocks, all of them if it is fast."""
    kind = _kind(entry, world)
    if kind == "hindsight":
        return _hindsight()
    if (kind, world) == ("clairvoyant", "paper-flock"):
        known = pl.read_parquet(RESULTS / "shared" / REFERENCES_FILE).filter(reference=CLAIRVOYANT)
        return known.sort("seed")["objective"].to_numpy()
    flocks = FLOCKS[:_SIMULATED_FLOCKS] if kind == "clairvoyant" else FLOCKS
    parts = chunks(flocks, 5 if kind == "clairvoyant" else 100)
    arguments = (kind, SCENARIOS[world].to_json(), entry.objective, entry.options["max_range"])
    jobs = {part: Job(f"{__name__}:reference", (*arguments, part), 10.0) for part in parts}
    found = runner.each(jobs, f"{kind} in {world}")
    return np.concatenate([values["objective"] for values in found.values()])


def reference(kind: str, document: str, objective: str, max_range: float, flocks: range) -> Arrays:
    """Return the objective of a reference on every flock."""
    play = {"free headings": free_headings, "informed greedy": informed_greedy, "clairvoyant": clairvoyant}[
        kind
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.toml"
        path.write_text(FlockScenario.from_json(document).to_toml())
        setting: Any = Setting(scenario=str(path), objective=objective, max_range=max_range)  # type: ignore[arg-type]
        return play(setting, flocks)


def _hindsight() -> FloatArray:
    """Return the largest escape distance on every line, of all fixed ranges and policies of the study."""
    episodes = pl.read_parquet(RESULTS / "line" / EPISODES_FILE)
    best = episodes.filter(pl.col("seed").is_in(FLOCKS)).group_by("seed").agg(pl.col("objective").max())
    values: FloatArray = best.sort("seed")["objective"].to_numpy()
    return values
