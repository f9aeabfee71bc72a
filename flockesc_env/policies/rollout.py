"""``rollout``: run a policy on many seeds. ``play``: the same for a ``Setup``."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, cast, overload

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_count, as_seeds, as_threads
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.episodes.batch import Columns, FlockBatch, Step
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.episodes.spaces import RangeActions, policy_spec
from flockesc_env.policies.base import AnyPolicy, Observations, Policy
from flockesc_env.policies.network import NetworkPolicy, Parameters, choices
from flockesc_env.policies.outcomes import RESULTS, Episodes, LineEpisodes
from flockesc_env.policies.setup import Setup, refuse, setup
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import EnvOptions, LineOptions


@overload
def rollout(
    scenario: FlockScenario, policy: AnyPolicy, seeds: int | Iterable[int], **options: Any
) -> Episodes: ...
@overload
def rollout(
    scenario: LineScenario, policy: AnyPolicy, seeds: int | Iterable[int], **options: Any
) -> LineEpisodes: ...
@overload
def rollout(*arguments: Any, **options: Any) -> Any: ...  # the type depends on the scenario of the policy
def rollout(
    scenario: Any = None,
    policy: AnyPolicy = None,
    seeds: int | Iterable[int] | None = None,
    *,
    per_agent: bool | None = None,
    batch_size: int | None = None,
    num_threads: int | None = None,
    predator_policy: AnyPolicy = None,
    progress: Progress | bool | None = None,
    env: Any = None,
    **options: Any,
) -> Episodes | LineEpisodes:
    """Run a policy on the flock or line of every seed, to the end of the episode.

    ``rollout(policy, seeds)`` uses the scenario of the policy, or the paper's flock if it has none.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs. It has a
            predator.
        policy: sets the ranges: a policy, its name or path (``load_policy``), or a model of
            stable-baselines3. It plays with the options that it knows; options of the call replace those of
            a rule, but not those of a trained policy.
        seeds: seeds of the flocks, or their number n for the seeds 0 to n - 1; ``env.reset(seed=k)`` starts
            the same flock.
        per_agent: True: the policy sets one range per agent. False: one per flock. ``None``: as the policy's
            attribute ``per_agent`` says, or the observation space of the model of an ``SB3Policy``.
        batch_size: number of episodes stepped together; ``None``: 64 flocks or 256 lines. Results depend on
            it if the policy is random and, by rounding, if torch computes it. The core plays a
            ``NetworkPolicy`` without batches.
        num_threads: number of threads for flocks; ``None``: one per core. Lines use one thread, except under
            a ``NetworkPolicy``.
        predator_policy: controls the ``Learned`` predators: a policy of predators, its name (``"pursue"``) or
            path, or a model of stable-baselines3. ``None``: they fly straight on.
        progress: ``True``: show a progress bar on stderr. A function: called with (finished episodes, all
            episodes) after every batch.
        env: flocks of ``sb3.vec_env`` with wrappers of your own, in which a model plays as it was trained: an
            own observation, ``VecFrameStack``, ``VecNormalize`` (its statistics stay). Outcomes come from the
            flocks. Scenario and options are those of ``env``, which then needs a reset.
        **options: see ``EnvOptions`` or, for a line, ``LineOptions``.

    Raises:
        InputError: if the policy cannot play in the scenario with the options.
        MemoryError: for the seeds and outcomes.

    Examples:
        >>> rollout("paper-flock", "stubborn-leaders", seeds=3).min_mean_distance.round(2)
        array([84.65, 87.7 , 91.85])
    """
    if seeds is None:
        scenario, policy, seeds = None, scenario, policy
    elif policy is None:
        scenario, policy = None, scenario
    checked = as_seeds(seeds)
    size = None if batch_size is None else as_count(batch_size, "batch_size")
    given: Any = {"per_agent": per_agent, "predator_policy": predator_policy, "num_threads": num_threads}
    entry = setup(policy, scenario, env=env, **given, **options)
    if env is not None:
        refuse({"batch_size": size}, "None beside env")
    with reporting(progress, "Rollout", len(checked)) as callback:
        columns = play(entry, checked, batch_size=size, progress=callback)
    return RESULTS[entry.scenario.model].of(checked, columns)


def play(
    entry: Setup, seeds: Sequence[int], *, batch_size: int | None = None, progress: Progress | None = None
) -> Columns:
    """Run a policy on the flock or line of every seed, see ``rollout``; return outcomes of shape (seeds,)."""
    policy, model = entry.policy, entry.scenario
    if entry.env is not None:
        return cast("Columns", entry.env.unwrapped.play_episodes(entry, seeds, progress))
    if type(policy) is NetworkPolicy and entry.predator_policy is None:
        return play_networks(entry, policy.parameters[np.newaxis], seeds, progress)
    if batch_size is None:
        batch_size = 256 if isinstance(model, LineScenario) else 64
    parts: list[Columns] = []
    for start in range(0, len(seeds), batch_size):
        chunk = seeds[start : start + batch_size]
        batch = _LineBatch(entry) if isinstance(model, LineScenario) else flock_batch(entry, len(chunk))
        total = np.zeros(len(chunk))
        for _, rewards in episode_steps(batch, policy, chunk):
            total += rewards.reshape(len(chunk), -1).mean(axis=1)
        parts.append({**batch.outcomes(), "mean_return": total})
        if progress is not None:
            progress(start + len(chunk), len(seeds))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def play_networks(
    entry: Setup, parameters: Parameters, seeds: Sequence[int], progress: Progress | None = None
) -> Columns:
    """Run networks with the architecture of ``entry.policy`` on every seed in the core, as ``play``.

    ``parameters`` has shape (1, architecture.size) for one network on all flocks, or (seeds,
    architecture.size) for one network per flock. ``Learned`` predators fly straight on. Results do not
    depend on the machine.

    Returns:
        The outcomes in ``Episodes`` or ``LineEpisodes`` and ``num_actions``, each of shape (seeds,).
    """
    report = None if progress is None else lambda done: progress(done, len(seeds))
    architecture = cast("NetworkPolicy", entry.policy).architecture
    numbers, actions = np.array(seeds, np.uint64), RangeActions(entry.options)
    _, ranges = choices(architecture, actions, tuple(entry.options.profile_ranges or ()))
    network = architecture.to_core(), parameters, ranges
    if isinstance(entry.scenario, FlockScenario):
        return flock_batch(entry, 1).core.rollout(network, numbers, report)
    documents = entry.scenario.to_json(), cast("LineOptions", entry.options).to_core()
    threads = as_threads(entry.num_threads)
    return _core.rollout_line(documents, actions.core, network, numbers, threads, report)


def flock_batch(entry: Setup, num_flocks: int) -> FlockBatch:
    """Return flocks in which a policy plays."""
    return FlockBatch(
        cast("FlockScenario", entry.scenario),
        cast("EnvOptions", entry.options),
        num_flocks=num_flocks,
        per_agent=entry.per_agent,
        num_threads=entry.num_threads,
        predator_policy=entry.predator_policy,
    )


def episode_steps(
    batch: "FlockBatch | _LineBatch",
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

    def __init__(self, entry: Setup) -> None:
        scenario, options = cast("LineScenario", entry.scenario), cast("LineOptions", entry.options)
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
            if not line.get("has_ended"):
                self._observations[row], rewards[row], *_ = line.step(float(ranges[row]))
        return self._observations, rewards, self._column("has_ended"), ranges, {}

    def outcomes(self) -> Columns:
        names = ("escape_distance", "steps", "num_components", "converged")
        return {name: self._column(name) for name in names}

    def _column(self, name: str) -> NDArray[Any]:
        return np.array([line.get(name) for line in self._lines])
