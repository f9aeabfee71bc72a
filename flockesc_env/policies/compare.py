"""``compare``: policies and their baseline on the same flocks; needs the extra ``analysis``."""

from collections.abc import Callable, Iterable, Mapping
from itertools import count
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_vector
from flockesc_env.common.errors import InputError, errors_at
from flockesc_env.common.extras import require
from flockesc_env.common.progress import progress_bar
from flockesc_env.episodes.batch import Columns
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.models.sweep import FlockSweepResult, sweep
from flockesc_env.policies.base import AnyPolicy, Side
from flockesc_env.policies.comparison import LOADS, ORACLE, Comparison, complete_range
from flockesc_env.policies.registry import (
    DEFAULT_FLOCK,
    NAMES,
    PREDATORS,
    as_flock_policy,
    as_predator_policy,
)
from flockesc_env.policies.rollout import flock_batch, play
from flockesc_env.policies.rules import FixedRange
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.policies.setup import Setup, flocks_of, opponent_of, refuse, setup
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.scenario.presets import Scenario, as_model


def compare(
    scenario: Any,
    *policies: AnyPolicy,
    num_flocks: int = 200,
    num_tuning: int = 200,
    objective: str | None = None,
    ranges: ArrayLike | None = None,
    num_threads: int | None = None,
    env: Any = None,
    side: Side = "flock",
    flock_policy: AnyPolicy = None,
    **options: Any,
) -> Comparison:
    """Play policies and the best fixed range on the same flocks, or lines, of any scenario.

    The best fixed range is chosen on tuning flocks, with seeds from 1,000,000 on. Results come from held-out
    flocks, with seeds from 2,000,000 on. ``task.compare`` compares on a task.

    With ``side="predator"``, policies of predators hunt the same flocks instead: the smaller the objective,
    the better. The baseline is the best of ``"fly-straight"``, ``"pursue"`` and ``"pursue-centroid"``.

    Args:
        scenario: the model's parameters, or a preset's name; ``None``: that of ``env`` or the first policy.
            With ``side="predator"``, predators become ``Learned`` if none is.
        *policies: one or more policies of ``side`` that can play in the scenario with the options, their
            names, paths of policy files, or models of stable-baselines3.
        num_flocks: number of held-out flocks.
        num_tuning: number of tuning flocks.
        objective: an objective that the scenario defines; ``None``: that of the first policy's options.
        ranges: fixed ranges among which the best one is chosen; ``None``: ``scenario.search_ranges``.
        num_threads: number of threads; ``None``: one per core.
        env: an environment in which models of stable-baselines3 play, as in ``rollout``.
        side: whose policies are compared.
        flock_policy: sets the ranges that ``side="predator"`` hunts; ``None``: that of the training of the
            first policy, or else ``"fixed:10"``.
        **options: options of ``rollout`` for all policies, also ``per_agent`` and ``predator_policy``. No
            fixed range exceeds a ``max_range`` that is given.

    Examples:
        >>> found = compare("paper-flock", "stubborn-leaders", num_flocks=3, num_tuning=3)
        >>> print(f"{found.rows['stubborn-leaders'].objective.mean:.2f} m")
        87.70 m
    """
    require("analysis", ["scipy"])
    if not policies:
        raise InputError("policies", "at least one policy", "none")
    held_out = HELD_OUT[: as_count(num_flocks, "num_flocks", most=len(HELD_OUT))]
    tuning = TUNING[: as_count(num_tuning, "num_tuning", most=len(TUNING))]
    hunts = as_choice(side, "side", get_args(Side)) == "predator"
    other = {"ranges": ranges, "env": env, "predator_policy": options.get("predator_policy")}
    refuse(other if hunts else {"flock_policy": flock_policy}, f"None beside side={side!r}")
    read: Any = as_predator_policy if hunts else as_flock_policy
    first = read(policies[0])
    if env is not None:
        options.setdefault("predator_policy", flocks_of(env).predator_policy)
        scenario = flocks_of(env).scenario if scenario is None else scenario
    model: Any = first.scenario or FlockScenario()
    model = model if scenario is None else as_model(scenario)
    if hunts:
        if isinstance(model, LineScenario):
            raise InputError("scenario", "a flock, which predators can hunt", "a line")
        model = model if model.num_learned else model.with_learned_predators()
        if flock_policy is None:
            flock = opponent_of(first, as_flock_policy) or as_flock_policy(DEFAULT_FLOCK)
            options = {**(first.options or {}), **options}
        else:
            flock = as_flock_policy(flock_policy, "flock_policy")
    elif env is None and options.get("predator_policy") is None and getattr(model, "num_learned", False):
        options["predator_policy"] = opponent_of(first, as_predator_policy)
    if objective is not None:
        as_choice(objective, "objective", model.objectives)

    def prepare(policy: Any) -> Setup:
        if env is not None and isinstance(policy, SB3Policy):
            return setup(policy, model, env=env, num_threads=num_threads, **options)
        player, given = (flock, options | {"predator_policy": policy}) if hunts else (policy, options)
        # A trained policy may have learned another objective; a rule observes this one.
        if objective is not None and player.scenario is None and model.model == "flock":
            given = given | {"objective": objective}
        entry = setup(player, model, num_threads=num_threads, **given)
        if hunts:
            flock_batch(entry, 1)  # refuses predators that cannot act in the scenario
        return entry

    entries = prepared(policies, prepare, read)
    lead = next(iter(entries.values()))
    spec = next(iter(model.objectives.values()))
    spec = model.objectives[objective or getattr(lead.options, "objective", spec.name)]
    if not spec.is_defined_in(model):
        raise InputError("scenario", f"{spec.requires}, which the objective {spec.name} requires", "none")
    name = scenario if isinstance(scenario, str) else f"a {model.model} of {model.num_agents} agents"
    if hunts:
        built_in = prepared(PREDATORS, prepare, read)
        reached = {each: play(entry, tuning)[spec.name].mean() for each, entry in built_in.items()}
        best = min(reached, key=lambda each: reached[each])
        played = _played({f"best built-in predator ({best})": built_in[best], **entries}, spec, held_out)
        return Comparison(name, spec, held_out, model.range_unit, played, flock.name)
    grid = _grid(model, ranges, lead.options.max_range if "max_range" in options else np.inf)
    search, _ = _search(lead, grid, tuning)
    return judged(entries, spec, grid, search.best_range(spec.name), held_out, scenario=name, tuning=search)


def prepared(
    policies: Iterable[Any], prepare: Callable[[Any], Setup], read: Callable[[Any], Any] = as_flock_policy
) -> dict[str, Setup]:
    """Return how policies play, by name; errors begin with the name. Equal names get numbers."""
    entries: dict[str, Setup] = {}
    for policy in map(read, policies):
        name = policy.name
        with errors_at(f"{name}: "):
            entry = prepare(policy)
        if name in entries:
            is_built_in = name in (*NAMES, *PREDATORS) or name.startswith("fixed:")
            if is_built_in and entry.options == entries[name].options:
                continue
            name = next(each for each in (f"{name} ({number})" for number in count(2)) if each not in entries)
        entries[name] = entry
    return entries


def judged(
    entries: Mapping[str, Setup],
    spec: ObjectiveSpec,
    grid: FloatArray,
    best: float,
    seeds: range,
    **facts: Any,
) -> Comparison:
    """Play policies and fixed ranges in the scenario of the first policy; ``facts`` are of ``Comparison``."""
    first = next(iter(entries.values()))
    ranges = np.union1d(grid, best)
    search, columns = _search(first, ranges, seeds)
    unit = {"m": " m", "": ""}.get(first.scenario.range_unit, f" {first.scenario.range_unit}")
    name, at = f"best fixed range ({best:g}{unit})", ranges.searchsorted(best)
    every, last = np.arange(len(seeds)), columns[spec.name].argmax(axis=0)
    played = {name: _kept(columns, spec, (at, every)), ORACLE: _kept(columns, spec, (last, every))}
    played |= _played(entries, spec, seeds)
    facts |= {"range_unit": first.scenario.range_unit, "best_range": best}
    return Comparison(spec=spec, seeds=seeds, search=search, played=played, **facts)


def _played(entries: Mapping[str, Setup], spec: ObjectiveSpec, seeds: range) -> dict[str, Columns]:
    played = {}
    for name, entry in entries.items():
        with progress_bar(f"Policy {name}", len(seeds)) as report:
            played[name] = _kept(play(entry, seeds, progress=report), spec, slice(None))
    return played


def _kept(columns: Mapping[str, Any], spec: ObjectiveSpec, at: Any) -> Columns:
    loads = {name: columns[name][at] for name in LOADS if name in columns}
    return {"objective": columns[spec.name][at], **loads}


def _grid(scenario: Scenario, ranges: ArrayLike | None, longest: float) -> FloatArray:
    """Return the fixed ranges of a search, ascending and at most ``longest``."""
    if ranges is not None:
        given = np.unique(as_vector(ranges, "ranges", least=0.0))
        if given[-1] > longest:
            raise InputError("ranges", f"at most max_range = {longest:g}", f"{given[-1]:g}")
        return given
    grid = np.array(scenario.search_ranges)
    if scenario.range_unit == "neighbors":
        grid = np.union1d(np.arange(11.0), grid)
    return grid[grid <= min(longest, complete_range(scenario))]


def _search(entry: Setup, ranges: FloatArray, seeds: range) -> tuple[Any, Mapping[str, Any]]:
    """Return the grid search in a scenario, and columns of shape (ranges, seeds).

    Flocks are played, because only an episode has a predator policy and the number of agents heard.
    """
    scenario, hunter, threads = entry.scenario, entry.predator_policy, entry.num_threads
    with progress_bar("Fixed ranges", ranges.size * len(seeds)) as report:
        if isinstance(scenario, LineScenario):
            lines = sweep(scenario, ranges, seeds, num_threads=threads, progress=report)
            return lines, vars(lines)
        # One action per episode is fastest, but a predator policy acts as often as the flock.
        options: Any = {"steps_per_action": scenario.num_steps} if hunter is None else {}
        runs = []
        for place, rho in enumerate(ranges.tolist()):
            fixed = setup(FixedRange(rho), scenario, predator_policy=hunter, num_threads=threads, **options)
            runs.append(play(fixed, seeds))
            report((place + 1) * len(seeds), 0)
    columns: Any = {name: np.stack([run[name] for run in runs]) for name in runs[0]}
    shown = {name: columns[name] for name in (*scenario.objectives, "num_components")}
    return FlockSweepResult(scenario, ranges, np.array(seeds, np.uint64), **shown), columns
