"""Data sets of a task's episodes: ``record_episodes`` (Parquet, Croissant metadata) and ``create_minari``."""

from __future__ import annotations

import dataclasses
import json
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from gymnasium.envs.registration import EnvSpec

from flockesc_env._core import __version__
from flockesc_env.benchmark.croissant import AUTHORS, croissant
from flockesc_env.benchmark.fitting import fitted
from flockesc_env.benchmark.results import is_file
from flockesc_env.benchmark.scoring import LoadedPolicy
from flockesc_env.benchmark.seeds import refuse_held_out
from flockesc_env.benchmark.tasks import VERSION, Task, task_of
from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.extras import require
from flockesc_env.envs.gymnasium import FlockEscapeEnv
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.envs.vector import AgentVectorEnv
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.options import UNOBSERVED, EnvOptions
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

if TYPE_CHECKING:
    import polars as pl

_FLOCKS_IN_MEMORY: Final = 10  # the rows of all agents of a flock take up to some ten MB

_COLUMNS: Final = {
    "policy": "name of the policy",
    "seed": "seed of the episode; env.reset(seed=seed) starts the same flock or line",
    "step": "index of the action in the episode",
    "agent": "index of the agent in the flock",
    "observation": "observation before the action; the table policies has the names of its entries",
    "action": "action from -1 to 1, mapped linearly to the ranges from min_range to max_range",
    "range": "interaction range that the action sets, in m for a flock",
    "reward": "reward of the action",
    "terminated": "whether the episode terminates with the action",
    "truncated": "whether the episode is truncated after the action",
    "steps": "number of actions of the episode",
    "last_observation": "observation after the last action, of all agents one after another",
    "options": "options of the environment as JSON, for flockesc_env.benchmark.episodes.environment",
    "sha256": "checksum of the policy file; empty without a file",
    "entries": "names of the entries of an observation",
}


def environment(task: str, **options: Any) -> Any:
    """Return the environment in which the episodes of a task are recorded, with the scenario of its training.

    Args:
        task: name of the task.
        **options: options of the environment.

    Returns:
        ``FlockEscapeEnv``, ``LineEscapeEnv`` or, if a policy sets one range per agent, ``AgentVectorEnv``
        with one flock.
    """
    chosen = task_of(task)
    if isinstance(chosen.scenario, LineScenario):
        return LineEscapeEnv(chosen.scenario, **options)
    if chosen.per_agent:
        return AgentVectorEnv(scenario=chosen.scenario, autoreset_mode="Disabled", **options)
    return FlockEscapeEnv(chosen.scenario, **options)


def record_episodes(
    policies: Sequence[LoadedPolicy],
    task: Task,
    seeds: Sequence[int],
    output: Path,
    report: Callable[[str], None] = lambda _: None,
) -> None:
    """Record episodes of policies in the scenario of a task's training.

    The folder gets ``NAME.parquet`` per policy, with its actions; ``episodes.parquet``; ``policies.parquet``;
    and ``croissant.json``, which describes them. A policy plays with the task's options and, where they
    differ, its own. The environment takes each action as a float32. All rewards are the change of the
    objective.

    Args:
        policies: the policies; see ``LoadedPolicy.of``.
        task: the task.
        seeds: seeds of the flocks or lines, the same for every policy.
        output: folder of the data set, new or empty. It gets its files once all of them are complete.
        report: called with the text of every policy before it plays.

    Raises:
        ArgumentError: if a policy does not fit the task, names of policies agree, a seed is held out, or the
            folder is not empty.
        MissingExtraError: if polars is not installed.
    """
    require("analysis", ["polars"])
    import polars as pl

    refuse_held_out(seeds)
    check_empty(output)
    chosen = {policy_name(policy): _fitted(policy, task) for policy in policies}
    if len(chosen) < len(policies) or not chosen.keys().isdisjoint({"episodes", "policies"}):
        expected = "different names of policies, not episodes or policies"
        raise ArgumentError("policies", expected, ", ".join(map(policy_name, policies)))
    with _new_or_empty(output), TemporaryDirectory(prefix=".episodes-", dir=output) as scratch:
        folder = Path(scratch, "data")
        folder.mkdir()
        ends, facts = [], []
        for policy, (name, entry) in zip(policies, chosen.items(), strict=True):
            report(policy.spec)
            observed = environment(task.name, **entry.options).policy_spec
            env = environment(task.name, **_normalized(entry.options))
            parts = []
            for start in range(0, len(seeds), _FLOCKS_IN_MEMORY):
                few = seeds[start : start + _FLOCKS_IN_MEMORY]
                played = [_play(name, entry, observed, env, task, seed) for seed in few]
                parts.append(Path(scratch, f"{name}-{start}.parquet"))
                pl.concat(rows for rows, _ in played).write_parquet(parts[-1])
                ends += [end for _, end in played]
            pl.scan_parquet(parts).sink_parquet(folder / f"{name}.parquet")
            facts.append((name, json.dumps(entry.options), policy.sha256, list(observed.layout.names)))
        pl.concat(ends).write_parquet(folder / "episodes.parquet")
        columns = ["policy", "options", "sha256", "entries"]
        pl.DataFrame(facts, columns, orient="row").write_parquet(folder / "policies.parquet")
        document = croissant(
            folder,
            f"flockesc-{task.name}",
            f"Episodes of the task {task.name} of the benchmark flockesc_env {VERSION}, sha256 of the task"
            f" {task.sha256}. {task.asks}",
            {
                **{name: f"actions of {name}" for name in chosen},
                "episodes": "a row per episode",
                "policies": "a row per policy",
            },
            {**_COLUMNS, "objective": f"{task.spec.with_unit(task.spec.symbol)}: {task.spec.definition}"},
        )
        (folder / "croissant.json").write_text(json.dumps(document, indent=1) + "\n", "utf-8")
        for file in folder.iterdir():
            file.rename(output / file.name)


def check_empty(output: Path) -> None:
    """Check that a folder does not exist or is empty."""
    exists = output.exists() or output.is_symlink()
    if exists and not (output.is_dir() and not any(output.iterdir())):
        raise ArgumentError("output", "a new or empty folder", repr(str(output)))


@contextmanager
def _new_or_empty(output: Path) -> Iterator[None]:
    """Make a folder unless it exists. If the block raises an error, a folder that is new is removed."""
    is_new = not output.exists()
    output.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        if is_new:
            output.rmdir()
        raise


def policy_name(policy: LoadedPolicy) -> str:
    """Return the name of a policy in a data set: the file's or else its own, in letters, digits, _ and -."""
    name = Path(policy.spec).stem if is_file(policy.spec) else policy.entry.name
    return re.sub(r"[^A-Za-z0-9_]+", "-", name)


def minari_ids(task: Task, names: Iterable[str]) -> list[str]:
    """Return the identifiers of the Minari data sets of some policies, which can be created.

    Raises:
        ArgumentError: if policies of the task set one range per agent, which Minari cannot express, or a data
            set exists.
        MissingExtraError: if minari is not installed.
    """
    if task.per_agent:
        raise ArgumentError("minari", "a task with one range per flock or line", task.name)
    require("minari", ["minari", "h5py", "PIL"])
    import minari

    ids = [f"flockesc/{task.name}/{name}-v0" for name in names]
    for known in sorted(minari.list_local_datasets().keys() & set(ids)):
        raise ArgumentError("minari", "new data sets; minari delete removes old ones", known)
    return ids


def create_minari(task: Task, folder: Path) -> list[str]:
    """Copy the data set of ``record_episodes`` in a folder to Minari, and return one identifier per policy.

    Raises:
        ArgumentError, MissingExtraError: see ``minari_ids``.
    """
    require("analysis", ["polars"])
    import polars as pl

    facts, ends = (pl.read_parquet(folder / f"{name}.parquet") for name in ("policies", "episodes"))
    ids = minari_ids(task, facts["policy"])
    import minari
    from minari.data_collector import EpisodeBuffer

    model = "Line" if isinstance(task.scenario, LineScenario) else "Flock"
    for name, dataset, options in zip(facts["policy"], ids, facts["options"], strict=True):
        rows = pl.read_parquet(folder / f"{name}.parquet").partition_by("seed", maintain_order=True)
        buffers = [
            EpisodeBuffer(
                seed=episode["seed"][0],
                observations=np.vstack([episode["observation"].to_numpy(), last]),
                actions=episode["action"].to_numpy()[:, np.newaxis],
                rewards=episode["reward"].to_numpy(),
                terminations=episode["terminated"].to_numpy(),
                truncations=episode["truncated"].to_numpy(),
            )
            for episode, last in zip(rows, ends.filter(policy=name)["last_observation"], strict=True)
        ]
        arguments = {"task": task.name, **_normalized(json.loads(options))}
        with warnings.catch_warnings():  # about optional facts, such as an address
            warnings.filterwarnings("ignore", "`.*` is set to None", UserWarning)
            minari.create_dataset_from_buffers(
                dataset,
                buffers,
                env=EnvSpec(f"flockesc/{model}Escape-v0", f"{__name__}:environment", kwargs=arguments),
                algorithm_name=name,
                author=AUTHORS,
                description=f"Episodes of {name} on the task {task.name}, benchmark flockesc_env {VERSION}",
                requirements=[f"flockesc-env=={__version__}"],
            )
    return ids


def _normalized(options: dict[str, Any]) -> dict[str, Any]:
    """Return options of the environment that takes the recorded actions."""
    return {**options, "action_mode": "normalized"}


def _fitted(policy: LoadedPolicy, task: Task) -> NamedPolicy:
    """Return a policy with the options of the environment in which it plays."""
    try:
        entry = fitted(policy.entry, task)
    except ArgumentError as error:
        raise ArgumentError(f"{policy.spec}: {error.field}", error.expected, error.given) from None
    own = {name: value for name, value in entry.options.items() if name not in UNOBSERVED}
    if isinstance(task.scenario, FlockScenario):  # agents that see less than the task allows stay such agents
        own = {"predator_sensing_range": EnvOptions.predator_sensing_range, **own}
    return dataclasses.replace(entry, options={**task.options, **own})


def _play(
    name: str, entry: NamedPolicy, spec: PolicySpec, env: Any, task: Task, seed: int
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Play an episode; return the rows of its actions, and its row in the table of episodes.

    Args:
        name: name of the policy in the data set.
        entry: the policy.
        spec: shapes and meaning of the policy's observations and actions.
        env: the environment, with normalized actions.
        task: the task.
        seed: seed of the flock or line.
    """
    import polars as pl

    observation, _ = env.reset(seed=seed)
    reset_policy(entry.policy, np.ones(spec.rows, bool))
    to_actions = env.policy_spec.actions
    steps: list[tuple[Any, ...]] = []
    is_over = False
    while not is_over:
        seen = np.atleast_2d(observation)
        chosen = spec.actions.to_ranges(entry.policy.act(seen, spec), spec.rows)
        action = to_actions.from_ranges(chosen).astype(np.float32)
        observation, *results, info = env.step(action if task.per_agent else action[0])
        ends = [np.atleast_1d(result) for result in results]  # reward, terminated, truncated
        is_over = bool((ends[1] | ends[2]).all())
        ranges = to_actions.to_ranges(action, spec.rows).astype(np.float32)
        steps.append((seen, action[:, 0], ranges, *ends))
    rows: dict[str, Any] = {"step": np.arange(len(steps), dtype=np.int32).repeat(spec.rows)}
    if task.per_agent:
        rows["agent"] = np.tile(np.arange(spec.rows, dtype=np.int32), len(steps))
    names = ("observation", "action", "range", "reward", "terminated", "truncated")
    rows |= zip(names, map(np.concatenate, zip(*steps, strict=True)), strict=True)
    end = {
        "steps": [len(steps)],
        "objective": [float(np.atleast_1d(info[task.spec.column])[0])],
        "last_observation": pl.Series([np.ravel(observation).tolist()], dtype=pl.List(pl.Float32)),
    }
    keys = pl.lit(name).alias("policy"), pl.lit(seed, pl.Int64).alias("seed")
    return pl.DataFrame(rows).select(*keys, pl.all()), pl.DataFrame(end).select(*keys, pl.all())
