"""``Task`` and ``tasks``: the frozen tasks of the benchmark, which ``v1.toml`` defines."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal

import msgspec
import tomli_w

from flockesc_env.common.errors import ArgumentError, shown_name
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, ObjectiveSpec
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.tasks.seeds import HELD_OUT, first_seeds

VERSION: Final = "v1"
"""Version of the tasks. A change of a task gets another version; old ones stay."""

FLOCKS: Final = first_seeds(HELD_OUT, 1000)
"""Seeds of the flocks, or lines, that every policy is scored on."""

Scenario = FlockScenario | LineScenario
Reference = Literal["free headings", "clairvoyant", "informed greedy", "hindsight"]


class World(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A scenario in which a task's policies are scored, and the two objectives that normalize scores.

    Attributes:
        scenario: name of the scenario in the task. Only a preset's own scenario has the name of a preset.
        best_fixed_range: fixed range with the largest mean objective on tuning flocks, in m for a flock.
        zero: mean objective of the best fixed range on the held-out flocks; the score 0.
        one: ``zero`` plus the reference's mean gain over the best fixed range; the score 1. The gain is
            paired: both play the same held-out flocks, all of them or the first ones.
        one_error: half width of the 95 % interval of ``one``; 0 if the reference plays all flocks.
        reference: what reaches ``one``; docs/scoreboard.md describes the kinds.
    """

    scenario: str
    best_fixed_range: float
    zero: float
    one: float
    one_error: float
    reference: Reference

    def score(self, objective: Any) -> Any:
        """Return the normalized score of an objective or an array of them."""
        return (objective - self.zero) / (self.one - self.zero)


class Control(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An experiment that shows what a task is about: a gain with and without the escape force.

    Attributes:
        policy: the policy that hears the warning.
        baseline: the policy that it is compared with, on the same flocks.
        gain: mean paired difference of their objectives; mean, lower and upper end of the 95 % interval.
        gain_without_force: the same in flocks without the escape force, where nobody gives a warning.
    """

    policy: str
    baseline: str
    gain: tuple[float, float, float]
    gain_without_force: tuple[float, float, float]


class Shortcut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A simple policy without training and its score, so that nobody mistakes it for progress."""

    policy: str
    says: str
    score: float


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A task in the file: see ``Task``."""

    asks: str
    per_agent: bool
    objective: str
    trained_on: str
    samples: int
    worlds: tuple[World, ...]
    shortcuts: tuple[Shortcut, ...]
    controls: tuple[Control, ...] = ()
    options: dict[str, Any]


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: str
    scenarios: dict[str, dict[str, Any]]
    tasks: dict[str, _Entry]


@dataclass(frozen=True)
class Task:
    """A task of the benchmark.

    Attributes:
        name: name of the task.
        asks: the question that the task asks, in a sentence.
        per_agent: True: a policy sets one range per agent. False: one per flock, or per line.
        spec: the objective, which is the metric.
        scenario: the scenario in which policies are trained.
        options: options of the environment, which say what a policy may see; without the reward, which a
            trainer chooses.
        samples: number of actions, of one agent or of one flock, that a training run may take.
        worlds: scenarios in which policies are scored, with the normalization of scores, by name.
        scenarios: the scenarios of ``worlds``, by name.
        shortcuts: simple policies without training, and their scores.
        controls: experiments without the escape force, of tasks in which a warning decides.
        sha256: checksum of everything that defines the task.
    """

    name: str
    asks: str
    per_agent: bool
    spec: ObjectiveSpec
    scenario: Scenario
    options: Mapping[str, Any]
    samples: int
    worlds: Mapping[str, World]
    scenarios: Mapping[str, Scenario]
    shortcuts: tuple[Shortcut, ...]
    controls: tuple[Control, ...]
    sha256: str

    def score(self, objectives: Mapping[str, float]) -> float:
        """Return the normalized score of a policy: the mean over worlds.

        Args:
            objectives: mean objective in every world.
        """
        scores = [world.score(objectives[name]) for name, world in self.worlds.items()]
        return float(sum(scores) / len(scores))


@cache
def tasks() -> dict[str, Task]:
    """Return the tasks of the benchmark by name."""
    return read_tasks(files(__package__).joinpath(f"{VERSION}.toml").read_text("utf-8"))


def task_of(name: str) -> Task:
    """Return a task by its name.

    Raises:
        ArgumentError: if the name is unknown.
    """
    known = tasks()
    if name not in known:
        raise ArgumentError("task", f"one of {', '.join(known)}", shown_name(name, known))
    return known[name]


def read_tasks(text: str) -> dict[str, Task]:
    """Return the tasks of a file's text."""
    plain = tomllib.loads(text)
    file = msgspec.convert(plain, _File)
    scenarios = {name: _scenario(document) for name, document in file.scenarios.items()}
    found = {}
    for name, entry in file.tasks.items():
        used = {entry.trained_on, *(world.scenario for world in entry.worlds)}
        defining = {
            "version": file.version,
            "flocks": [FLOCKS.start, len(FLOCKS)],
            "scenarios": {at: file.scenarios[at] for at in used},
            name: plain["tasks"][name],
        }
        model = scenarios[entry.trained_on]
        specs = LINE_OBJECTIVES if isinstance(model, LineScenario) else FLOCK_OBJECTIVES
        found[name] = Task(
            name=name,
            asks=entry.asks,
            per_agent=entry.per_agent,
            spec=specs[entry.objective],
            scenario=model,
            options=_options(entry),
            samples=entry.samples,
            worlds={world.scenario: world for world in entry.worlds},
            scenarios={world.scenario: scenarios[world.scenario] for world in entry.worlds},
            shortcuts=entry.shortcuts,
            controls=entry.controls,
            sha256=hashlib.sha256(json.dumps(defining, sort_keys=True).encode()).hexdigest(),
        )
    return found


def _scenario(document: dict[str, Any]) -> Scenario:
    model = LineScenario if "predator_position" in document else FlockScenario
    return model.from_toml(tomli_w.dumps(document))


def _options(entry: _Entry) -> dict[str, Any]:
    """Return the options of the environment; TOML has no None."""
    return {name: None if value == "None" else value for name, value in entry.options.items()}
