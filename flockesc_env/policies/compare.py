"""``compare``: policies and their baseline on the same flocks; needs the extra ``analysis``."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast, get_args

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.array_files import origin, write_table
from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_vector
from flockesc_env.common.errors import InputError, errors_at
from flockesc_env.common.extras import data_frame, figure_style, require
from flockesc_env.common.files import write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.episodes.batch import Columns
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.models.sweep import FlockSweepResult, sweep
from flockesc_env.policies.base import AnyPolicy, Side
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
from flockesc_env.scenario.presets import PRESETS, Scenario, as_model

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

    from flockesc_env.common.stats import Estimate

_LOADS: Final = ("mean_range", "mean_heard")
ORACLE: Final = "hindsight oracle over fixed ranges"


@dataclass(frozen=True)
class ComparisonRow:
    """What a policy reaches: its objective, and its paired differences.

    Attributes:
        objective: mean objective.
        difference: mean paired difference to the baseline, the first row.
        to_rule: mean paired difference to the task's rule; ``None`` without a task.
        improvement: share of flocks with a better objective than under the baseline; ties count half.
        mean_range: mean range, as in ``Episodes``; ``None`` for a line.
        mean_heard: mean number of agents that an agent heard in a step; ``None`` for a line.
    """

    objective: "Estimate"
    difference: "Estimate"
    to_rule: "Estimate | None"
    improvement: "Estimate"
    mean_range: float | None = None
    mean_heard: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """The objectives of policies on the same flocks; see ``compare``. Printing it is the table.

    Attributes:
        scenario: name of the scenario.
        spec: the objective.
        seeds: seeds of the flocks.
        range_unit: unit of ``mean_range``.
        played: columns by policy: ``objective`` of every flock and, not for lines, ``mean_range`` and
            ``mean_heard`` as in ``Episodes``. The baseline is first: the best fixed range, or the best
            built-in predator.
        flock_policy: name of the flock's policy if predators are compared; ``None`` otherwise.
        best_range: the best fixed range; this and the next three are ``None`` for predators.
        search: the grid search over fixed ranges on these flocks.
        heard: mean number of agents heard in every run of ``search``; ``None`` for lines.
        tuning: the grid search that chose the best fixed range; ``None`` for a task, which knows it.
        task: name of the task; ``None`` without a task.
        rule: name of the task's rule, the best policy without training; ``None`` without a task.
    """

    scenario: str
    spec: ObjectiveSpec
    seeds: range
    range_unit: str
    played: Mapping[str, Columns]
    flock_policy: str | None = None
    best_range: Any = None
    search: Any = None
    heard: FloatArray | None = None
    tuning: Any = None
    task: str | None = None
    rule: str | None = None

    @property
    def values(self) -> dict[str, FloatArray]:
        """The objective of every flock, shape (flocks,), by policy."""
        return {name: columns["objective"] for name, columns in self.played.items()}

    @property
    def rows(self) -> dict[str, ComparisonRow]:
        """The rows of the table with 95 % intervals over flocks, by policy."""
        from flockesc_env.common import stats  # optional and slow to import

        first, rule = next(iter(self.values.values())), self.values.get(self.rule or "")
        sign = 1 if self.flock_policy is None else -1
        return {
            name: ComparisonRow(
                stats.mean(values),
                stats.mean(values - first),
                None if rule is None else stats.mean(values - rule),
                stats.improvement(sign * values, sign * first),
                *(float(self.played[name][load].mean()) for load in _LOADS if load in self.played[name]),
            )
            for name, values in self.values.items()
        }

    def table(self) -> "pl.DataFrame":
        """Return a polars DataFrame with one row per policy and flock: policy, seed, ``played``."""
        seeds, names = np.array(self.seeds, np.uint64), [*self.played]
        columns = {"policy": np.repeat(names, len(seeds)), "seed": np.tile(seeds, len(names))}
        for name in self.played[names[0]]:
            columns[name] = np.concatenate([each[name] for each in self.played.values()])
        return data_frame(columns)

    def write(self, folder: Path) -> None:
        """Write table.md and episodes.parquet (``table``) to a folder, which is made."""
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "table.md", f"{self}\n")
        found = origin(self.search.scenario.to_json(), self.search.seeds)
        write_table(self.table(), folder / "episodes.parquet", found)

    @figure_style()
    def plot(self, against: str = "range") -> "Figure":
        """Return a Matplotlib figure: the objective against the fixed range, and a line per policy.

        ``against="heard"``: against the mean number of agents heard, with a point per policy. Bands and bars
        are 95 % intervals. A dashed line marks the best fixed range.
        """
        if self.search is None:
            raise InputError("plot", "a comparison of ranges (table() has the objectives)", "predators")
        as_choice(against, "against", ["range"] if self.heard is None else ["range", "heard"])
        from matplotlib.figure import Figure  # optional and slow to import

        figure = Figure(figsize=(8.3, 4.2), layout="constrained")
        axes, has_bands, is_range = figure.subplots(), len(self.seeds) > 1, against == "range"
        unit = f" ({self.range_unit})" if self.range_unit else ""
        axes.set_xlabel(f"interaction range{unit}" if is_range else "agents heard per agent and step")
        places = self.search.interaction_ranges
        best = places.searchsorted(self.best_range)
        places = places if is_range else cast("FloatArray", self.heard).mean(axis=1)
        if has_bands:
            axes.fill_between(places, *self.search.mean_with_interval(self.spec.name)[1:], color="0.88", lw=0)
        axes.plot(places, self.spec.values(self.search).mean(axis=1), color="0.25", label="one fixed range")
        for place, (name, row) in enumerate(self.rows.items()):
            color, (center, low, high) = f"C{place % 10}", vars(row.objective).values()
            label = f"{self.spec.number(center)} {name}"
            if place == 0:
                axes.axvline(places[best], color="0.25", ls="--", lw=1, label=label)
            elif is_range and name != ORACLE:
                axes.axhline(center, color=color, label=label)
                if has_bands:
                    axes.axhspan(low, high, color=color, alpha=0.15, lw=0)
            elif name != ORACLE:
                bars = [[center - low], [high - center]] if has_bands else None
                axes.errorbar(cast("float", row.mean_heard), center, bars, fmt="o", color=color, label=label)
        axes.set_ylabel(self.spec.with_unit(self.spec.symbol))
        title = f"{len(self.seeds)} held-out {self.spec.model}s, 95 % intervals"
        axes.set_title(title, loc="left", fontsize="medium")
        axes.margins(x=0 if is_range else None)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside right upper", fontsize="small", frameon=False)
        figure.draw_without_rendering()  # creates the labels of ticks in this style
        return figure

    def __str__(self) -> str:
        spec, rule, many = self.spec, self.rule, f"{self.spec.model}s"
        task = f" of the task {self.task}" if self.task else ""
        where = f"{self.scenario} against {self.flock_policy}: the smaller, the better"
        best, what = ("built-in", "predator") if self.flock_policy else ("fixed", "range")
        chosen = "other seeds" if self.tuning is None else f"{len(self.tuning.seeds)} tuning {many}"
        lines = [
            f"{spec.with_unit(spec.symbol)}{task} on {len(self.seeds)} held-out {many}"
            f" in {where if self.flock_policy else self.scenario}; 95 % intervals: t, Wilson for shares.",
            f"Differences to the best {best} {what} are paired. The {what} was chosen on {chosen}.",
        ]
        if self.tuning is not None and (
            self.tuning.interaction_ranges.max() == self.best_range < _complete(self.search.scenario)
        ):
            lines.append("It is the largest range of the grid: longer ones may be better (ranges=..).")
        head = ["policy", "objective", f"minus best {best}", *([f"minus {rule}"] if rule else [])]
        head.append("probability of improvement")
        if next(iter(self.rows.values())).mean_heard is not None:
            head += [f"mean range ({self.range_unit})", "agents heard"]
        lines += ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
        for place, (name, row) in enumerate(self.rows.items()):
            cells = [name, f"{row.objective:.{spec.digits}f}"]
            cells.append(f"{row.difference:.{spec.digits}f}" if place else "-")
            if row.to_rule is not None:
                cells.append(f"{row.to_rule:.{spec.digits}f}" if name != rule else "-")
            cells.append(f"{row.improvement:.2f}" if place else "-")
            cells += [f"{load:.1f}" for load in (row.mean_range, row.mean_heard) if load is not None]
            lines.append(f"| {' | '.join(cells)} |")
        return "\n".join(lines)

    __repr__ = __str__


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
        *policies: policies of ``side``, their names, paths of policy files, or models of stable-baselines3.
        num_flocks: number of held-out flocks.
        num_tuning: number of tuning flocks.
        objective: an objective of the scenario; ``None``: that of the first policy's options.
        ranges: fixed ranges among which the best one is chosen; ``None``: ``scenario.search_ranges``.
        num_threads: number of threads; ``None``: one per core.
        env: an environment in which models of stable-baselines3 play, as in ``rollout``.
        side: whose policies are compared.
        flock_policy: sets the ranges that ``side="predator"`` hunts; ``None``: that of the training of the
            first policy, or else ``"fixed:10"``.
        **options: options of ``rollout`` for all policies, also ``per_agent`` and ``predator_policy``. No
            fixed range exceeds a ``max_range`` that is given.

    Raises:
        InputError: if there is no policy, one cannot play in the scenario with the options, or an argument
            is out of bounds or of the other side; if the scenario lacks what the objective requires.

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
    named = isinstance(scenario, str) and scenario in PRESETS
    name: Any = scenario if named else f"a {model.model} of {model.num_agents} agents"
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
    facts |= {"range_unit": first.scenario.range_unit, "best_range": best, "heard": columns.get("mean_heard")}
    return Comparison(spec=spec, seeds=seeds, search=search, played=played, **facts)


def _played(entries: Mapping[str, Setup], spec: ObjectiveSpec, seeds: range) -> dict[str, Columns]:
    played = {}
    for name, entry in entries.items():
        with progress_bar(f"Policy {name}", len(seeds)) as report:
            played[name] = _kept(play(entry, seeds, progress=report), spec, slice(None))
    return played


def _kept(columns: Mapping[str, Any], spec: ObjectiveSpec, at: Any) -> Columns:
    loads = {name: columns[name][at] for name in _LOADS if name in columns}
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
    return grid[grid <= min(longest, _complete(scenario))]


def _complete(scenario: Scenario) -> float:
    """Return the range with which agents hear all others in any state."""
    return {"neighbors": scenario.num_agents - 1.0, "": 1.0}.get(scenario.range_unit, np.inf)


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
