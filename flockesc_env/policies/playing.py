"""Rollouts of policies: outcomes of many episodes of a flock or a line, or one recorded run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal, Self, cast

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_threads
from flockesc_env.common.extras import data_frame
from flockesc_env.common.progress import Progress
from flockesc_env.episodes.batch import Columns, FlockBatch, Step
from flockesc_env.episodes.predators import PredatorPolicy, PredatorPolicySpec, reset_policy
from flockesc_env.episodes.spaces import RangeActions, policy_spec
from flockesc_env.models.simulate import Displayed, IntArray, Trajectory, run_flock
from flockesc_env.models.sweep import FlockOutcomes
from flockesc_env.policies.base import Observations, Policy
from flockesc_env.policies.network import Architecture, NetworkPolicy, Parameters, choices
from flockesc_env.policies.setup import Setup
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import EnvOptions, LineOptions
from flockesc_env.scenario.presets import Scenario

if TYPE_CHECKING:
    import polars as pl


class _Rows(Displayed):
    """Results with one entry per seed in every field."""

    @classmethod
    def of(cls, seeds: Sequence[int], columns: Columns) -> Self:
        """Return the columns of ``play``."""
        names = [field.name for field in fields(cls) if field.name != "seeds"]  # type: ignore[arg-type]
        return cls(seeds=np.array(seeds, np.uint64), **{name: columns[name] for name in names})  # type: ignore[call-arg]

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame (extra ``analysis``) with one row per seed and a column per attribute."""
        columns = dict(vars(self))
        return data_frame({"seed": columns.pop("seeds"), **columns})


@dataclass(frozen=True, eq=False, repr=False)
class Episodes(FlockOutcomes, _Rows):
    """Results of ``rollout`` on flocks, one entry per seed.

    Inherits the attributes of ``FlockOutcomes``: the seeds and every objective, shape (seeds,).

    Attributes:
        num_components: number of connected components at the end, shape (seeds,).
        mean_return: undiscounted return, averaged over agents, shape (seeds,). The reward of a caught agent
            is 0.
    """

    num_components: IntArray
    mean_return: FloatArray

    def _summary(self) -> dict[str, object]:
        means = {name: float(getattr(self, name).mean()) for name in FlockScenario.objectives}
        return {"num_seeds": len(self.seeds), **means}


@dataclass(frozen=True, eq=False, repr=False)
class LineEpisodes(_Rows):
    """Results of ``rollout`` on lines, one entry per seed.

    Attributes:
        seeds: the seeds, shape (seeds,).
        escape_distance: escape distance at the end of the episode, shape (seeds,); d_ss if ``converged``.
        num_components: number of connected components at the end, shape (seeds,).
        steps: number of model steps, shape (seeds,).
        converged: whether the line reached its steady state, shape (seeds,).
    """

    seeds: NDArray[np.uint64]
    escape_distance: FloatArray
    num_components: IntArray
    steps: IntArray
    converged: NDArray[np.bool]

    def _summary(self) -> dict[str, object]:
        return {"num_seeds": len(self.seeds), "escape_distance": float(self.escape_distance.mean())}


def play(
    setup: Setup, seeds: Sequence[int], *, batch_size: int | None = None, progress: Progress | None = None
) -> Columns:
    """Run a policy on the flock or line of every seed, see ``rollout``; return outcomes of shape (seeds,)."""
    policy, model, options = setup.policy, setup.scenario, setup.options
    if type(policy) is NetworkPolicy and setup.predator_policy is None:
        network = policy.architecture, policy.parameters[np.newaxis]
        shared: Any = {"per_agent": setup.per_agent, "num_threads": setup.num_threads, "progress": progress}
        return rollout_networks(*network, seeds, model, options, **shared)
    if batch_size is None:
        batch_size = 256 if isinstance(model, LineScenario) else 64
    parts: list[Columns] = []
    for start in range(0, len(seeds), batch_size):
        chunk = seeds[start : start + batch_size]
        batch: FlockBatch | _LineBatch
        if isinstance(model, LineScenario):
            batch = _LineBatch(model, cast("LineOptions", options))
        else:
            batch = _flock_batch(setup, len(chunk), setup.predator_policy)
        total = np.zeros(len(chunk))
        for _, rewards in episode_steps(batch, policy, chunk):
            total += rewards.reshape(len(chunk), -1).mean(axis=1)
        if isinstance(batch, FlockBatch):
            outcomes = {**batch.core.metrics(), "num_components": batch.core.num_components()}
        else:
            outcomes = batch.outcomes()
        parts.append({**outcomes, "mean_return": total})
        if progress is not None:
            progress(start + len(chunk), len(seeds))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def rollout_networks(
    architecture: Architecture,
    parameters: Parameters,
    seeds: Sequence[int],
    model: Scenario,
    options: EnvOptions | LineOptions,
    *,
    per_agent: bool = False,
    num_threads: int | None,
    progress: Progress | None = None,
) -> Columns:
    """Run networks on the flock or line of every seed in the core, as ``rollout``.

    ``parameters`` has shape (1, architecture.size) for one network on all flocks, or (seeds,
    architecture.size) for one network per flock. ``Learned`` predators fly straight on. Results do not
    depend on the machine.

    Returns:
        The outcomes in ``Episodes`` or ``LineEpisodes`` and ``num_actions``, each of shape (seeds,).

    Raises:
        InputError: if the networks set values and the action mode is not ``"normalized"``, an input is not
            in the observation, or ``parameters`` has the wrong shape or an entry that is not finite.
    """
    report = None if progress is None else lambda done: progress(done, len(seeds))
    numbers = np.array(seeds, np.uint64)
    actions = RangeActions(options)
    _, ranges = choices(architecture, actions, options.candidates)
    network = architecture.to_core(), parameters, ranges
    if isinstance(model, FlockScenario):
        chosen = cast("EnvOptions", options)
        batch = FlockBatch(model, chosen, per_agent=per_agent, num_threads=num_threads)
        return batch.core.rollout(network, numbers, report)
    documents = model.to_json(), cast("LineOptions", options).to_core()
    return _core.rollout_line(documents, actions.core, network, numbers, as_threads(num_threads), report)


def _flock_batch(setup: Setup, num_flocks: int, predator_policy: PredatorPolicy | None) -> FlockBatch:
    return FlockBatch(
        cast("FlockScenario", setup.scenario),
        cast("EnvOptions", setup.options),
        num_flocks=num_flocks,
        per_agent=setup.per_agent,
        num_threads=setup.num_threads,
        predator_policy=predator_policy,
    )


def record_run(setup: Setup, seed: int, start: Mapping[str, Any], **recording: Any) -> Trajectory:
    """Run a policy on one flock and return the trajectory; ``start`` holds given initial states."""
    scenario = cast("FlockScenario", setup.scenario)
    recorder = None if setup.predator_policy is None else _Recorder(setup.predator_policy)
    steps = episode_steps(_flock_batch(setup, 1, recorder), setup.policy, [seed], [start])
    ranges = np.array([ranges for ranges, _ in steps])

    def per_step(actions: FloatArray) -> FloatArray:
        held = np.repeat(actions, setup.options.steps_per_action, axis=0)[: scenario.num_steps]
        rest = scenario.num_steps - len(held)  # after the last agent was caught
        return np.concatenate([held, np.repeat(held[-1:], rest, axis=0)])

    predator_actions = None if recorder is None else per_step(np.array(recorder.actions))
    arguments: Any = {**start, **recording, "seed": seed, "num_threads": setup.num_threads}
    return run_flock(scenario, per_step(ranges), predator_actions=predator_actions, **arguments)


class _Recorder:
    """Wraps a predator policy and records its actions."""

    def __init__(self, policy: PredatorPolicy) -> None:
        self.policy = policy
        self.actions: list[FloatArray] = []

    def reset(self, rows: NDArray[np.bool]) -> None:
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> FloatArray:
        actions = self.policy.act(observations, spec)
        self.actions.append(spec.plain(actions, len(observations)))
        return self.actions[-1]


def episode_steps(
    batch: FlockBatch | _LineBatch,
    policy: Policy,
    seeds: Sequence[int],
    options: Sequence[Mapping[str, Any] | None] = (None,),
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Run a policy in every slot of a batch, with a seed per slot, until all episodes have ended.

    Yields:
        Ranges in m and rewards after every action, both of shape (num_flocks * rows,).
    """
    observations, _ = batch.reset(range(len(seeds)), seeds, options)
    reset_policy(policy, np.ones(len(observations), bool))
    has_ended = False
    while not has_ended:
        actions = policy.act(observations, batch.policy_spec)
        observations, rewards, ended, ranges, _ = batch.step(actions, at_end="stay")
        has_ended = bool(ended.all())
        yield ranges, rewards


class _LineBatch:
    """Episodes of lines, stepped together like the flocks of a ``FlockBatch``."""

    def __init__(self, scenario: LineScenario, options: LineOptions) -> None:
        self.policy_spec = policy_spec(scenario, options)
        self._documents = scenario.to_json(), options.to_core()
        self._lines: list[_core.LineEpisode] = []

    def reset(self, _: Sequence[int], seeds: Sequence[int], __: Any) -> tuple[Observations, Columns]:
        self._lines = [_core.LineEpisode(*self._documents, seed) for seed in seeds]
        self._observations = np.stack([line.observe() for line in self._lines])
        return self._observations, {}

    def step(self, actions: NDArray[np.generic], *, at_end: Literal["stay"]) -> Step:  # noqa: ARG002
        ranges = self.policy_spec.actions.to_ranges(actions, len(self._lines))
        rewards = np.zeros(len(self._lines))
        for row, line in enumerate(self._lines):
            if not line.has_ended:
                self._observations[row], rewards[row], *_ = line.step(float(ranges[row]))
        return self._observations, rewards, self._column("has_ended"), ranges, {}

    def outcomes(self) -> Columns:
        columns = {name: self._column(name) for name in ("escape_distance", "steps", "num_components")}
        return {**columns, "converged": self._column("is_steady")}

    def _column(self, name: str) -> NDArray[Any]:
        return np.array([getattr(line, name) for line in self._lines])
