"""Every argument of every public callable: bad values are refused by name, equal values have equal outcomes.

A refused value leaves no trace: the environment goes on like one that was never asked.
"""

import copy
import dataclasses
import inspect
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import argument_table as table
import numpy as np
import pytest
from argument_table import text
from envs import ADAPTERS, play, start
from pettingzoo import ParallelEnv
from same import plain, same, spoil

import flockesc_env as fe
from flockesc_env import flockesc_v1, models, policies, sb3, scenario, watch
from flockesc_env.envs import vector
from flockesc_env.policies import RandomRange, bind
from flockesc_env.render import video
from flockesc_env.sb3 import environments

NOT_CALLED = {
    # Only this package, or stable-baselines3, constructs these.
    *("models.Trajectory", "models.LineTrajectory", "models.RecordedRun", "models.ScanResult"),
    *("models.SweepResult", "models.FlockSweepResult", "models.LineSweepResult"),
    *("policies.Episodes", "policies.LineEpisodes", "policies.PolicySpec"),
    *("sb3.RangePolicy", "sb3.ScorerPolicy"),
    # These are in the tests of policies.
    *("policies.RowMemory", "policies.BasePolicy", "policies.as_policy"),
    "compare",  # takes any number of policies: a row below
    "policies.torch_network",
}
MODULES = (scenario, models, policies, sb3, watch, flockesc_v1, vector, environments)
SEED = table.integer(3, 0)
FLOCKS = table.Kind(
    1,
    [-1, 64, 2**64, 1.0, [0, 64], [[0]], np.array(0.0), np.zeros(2, np.bool)],
    [[1], np.array([1]), np.int64(1)],
    accepts=(type(None),),
)


@dataclasses.dataclass(frozen=True)
class Row:
    """A callable: ``call(**arguments)``, or with a ``subject``, ``call(subject(), **arguments)``.

    ``after`` converts the subject, or without one the result, to a value that can be compared.
    """

    call: Callable[..., Any]
    arguments: Mapping[str, table.Kind]
    subject: Callable[[], Any] | None = None
    after: Callable[[Any], Any] = lambda result: result
    passed: Mapping[str, table.Kind] = dataclasses.field(default_factory=dict)
    """Keywords that are passed on, and keys of ``options``."""

    @property
    def all_arguments(self) -> dict[str, table.Kind]:
        return {**self.arguments, **self.passed}


def _members(module: ModuleType) -> list[str]:
    names = getattr(module, "__all__", None) or [
        name for name, member in vars(module).items() if getattr(member, "__module__", "") == module.__name__
    ]
    return [name for name in names if not name.startswith("_")]


def _public() -> dict[str, Any]:
    """Return all public functions and classes, except protocols and errors."""
    found = {name: getattr(fe, name) for name in _members(fe)}
    for module in MODULES:
        short = module.__name__.removeprefix("flockesc_env.")
        names = {f"{short}.{name}": getattr(module, name) for name in _members(module)}
        found |= {name: member for name, member in names.items() if member not in found.values()}
    return {
        name: member
        for name, member in found.items()
        if inspect.isroutine(member)
        or (
            isinstance(member, type)
            and not issubclass(member, Exception)
            and not getattr(member, "_is_protocol", False)
        )
    }


def played(env: Any) -> list[Any]:
    return [start(env, 3), go_on(env)]


def go_on(env: Any) -> list[Any]:
    return play(env, np.random.default_rng(0), 12)


AFTER: dict[Any, Callable[[Any], Any]] = {
    fe.load_policy: lambda made: made.parameters,
    bind: lambda _: None,
    models.Flock: lambda flock: flock.get_state(),
    RandomRange: lambda made: made._rng.bit_generator.state,
    fe.NetworkPolicy: lambda made: made.parameters,
    policies.SB3Policy: lambda _: None,
    sb3.FlockEvalCallback: lambda made: [made.eval_freq, made.num_flocks, made.best_model_save_path],
    **dict.fromkeys((fe.parallel_env, flockesc_v1.env, flockesc_v1.raw_env, sb3.vec_env), played),
}


def row_of(call: Any) -> Row:
    """Return a row whose arguments follow from the signature."""
    own, passed = table.kinds(call)
    if call is fe.simulate:  # either interaction_range or policy
        passed |= {name: own.pop(name) for name in ("policy", "per_agent")}
    if call in table.SLOT_OF:  # a scenario checks its parts
        slot = table.SLOT_OF[call]
        return Row(lambda **given: table.FLOCK.replace(**{slot: table.SLOTS[slot][0](call(**given))}), own)
    is_plain = not isinstance(call, type) or dataclasses.is_dataclass(call)
    after = played if hasattr(call, "step") else Row.after if is_plain else vars
    return Row(call, own, after=AFTER.get(call, after), passed=passed)


def state(good: bytes) -> table.Kind:
    half, last = len(good) // 2, len(good) - 1
    near = [b"", good[:half], good[:last], good + b"0", good + good[half:]]
    near += [good[:at] + bytes([good[at] ^ 1]) + good[at + 1 :] for at in (0, half, last)]
    return table.Kind(good, near, [bytearray(good), memoryview(good)])


def optional(**arguments: table.Kind) -> dict[str, table.Kind]:
    return {
        name: dataclasses.replace(kind, accepts=(*kind.accepts, type(None)))
        for name, kind in arguments.items()
    }


def method(name: str, env: Any, **given: Any) -> Any:
    return getattr(env, name)(**given)


def reset(name: str, env: Any, seed: Any = None, options: Any = None, **entries: Any) -> Any:
    return getattr(env, name)(seed=seed, options={**options, **entries} if entries else options)


def method_rows(name: str) -> dict[str, Row]:
    """Return the rows of the methods of an environment."""

    def subject() -> Any:
        env = ADAPTERS[name].make()
        played(env)
        return env

    env = subject()
    has_slots, is_dict = hasattr(env, "num_envs"), isinstance(env, ParallelEnv)
    flocks = {"flocks": FLOCKS} if has_slots else {}
    calls: dict[str, dict[str, table.Kind]] = {
        "get_state": flocks,
        "set_state": {"state": state(env.get_state(1) if has_slots else env.get_state()), **flocks},
    }
    if is_dict:
        good = {agent: np.full(env.action_space(agent).shape, 0.25) for agent in env.possible_agents}
        ends = (*good,)[:: len(good) - 1]
        bad = [{**good, agent: each} for agent in ends for each in table.unreadable(good[agent])]
        calls["step"] = {"actions": table.part(good, *bad)}
        hunters = {"predator_actions": table.floats(np.full((1, 2), 0.5))} if env.scenario.num_learned else {}
        calls["step_array"] = {"actions": table.floats(np.full((5, 1), 0.25)), **hunters}
    else:
        shape = (env.num_envs, 1) if has_slots else env.action_space.shape
        calls["step"] = {"actions" if has_slots else "action": table.floats(np.full(shape, 0.25))}
    if hasattr(env, "step_async"):
        calls["seed"] = optional(seed=SEED)
    rows = {call: Row(partial(method, call), arguments, subject, go_on) for call, arguments in calls.items()}
    if not hasattr(env, "step_async"):
        count, dimension = env.scenario.num_agents, getattr(env.scenario, "dimension", 1)
        points = table.floats(np.arange(float(count * dimension)).reshape(count, dimension))
        hunter = table.floats(np.arange(float(dimension)).reshape(1, dimension))
        entries = {"initial_positions": points, "initial_velocities": points}
        entries |= {"predator_positions": hunter, "predator_velocities": hunter}
        if isinstance(env, fe.LineEscapeEnv):
            entries = {"initial_state": table.floats(np.arange(count) / 32)}
        # PettingZoo requires that unknown options are ignored.
        given = optional(seed=SEED, options=table.part({}, accepts=(dict,) if is_dict else ()))
        for call in ("reset", "reset_array") if is_dict else ("reset",):
            rows[call] = Row(partial(reset, call), given, subject, go_on, optional(**entries, episode=SEED))
    return {f"{name}: {call}": row for call, row in rows.items()}


def flock_rows() -> dict[str, Row]:
    """Return the rows of the methods and of the settable properties of a flock that a script steps."""
    made = models.Flock(table.FLOCK.with_learned_predators(), seed=3)
    ranges = table.floats(table.PER_AGENT, is_signed=False, or_number=True)
    actions = optional(predator_actions=table.floats(np.full((1, 2), 0.5)))
    calls = {
        "step": {"ranges": ranges, "num_steps": table.integer(2), **actions},
        "set_state": {"state": state(made.get_state())},
    }
    rows = {call: Row(partial(method, call), arguments) for call, arguments in calls.items()}
    kinds = {"positions": table.floats(table.POINTS), "velocities": table.EXCEPTIONS["Flock.velocities"]}
    for name, kind in kinds.items():
        rows[name] = Row(lambda flock, **given: setattr(flock, *next(iter(given.items()))), {name: kind})
    after = models.Flock.get_state
    return {
        f"Flock: {call}": dataclasses.replace(row, subject=made.copy, after=after)
        for call, row in rows.items()
    }


WITH_METHODS = (
    *("gymnasium", "predator", "line", "vector", "a slot per agent", "parallel", "parallel with predators"),
    *("stable-baselines3", "stable-baselines3, a slot per agent"),
)
COMPARE, COMPARED = table.kinds(fe.compare)
CALLABLES = {name: row_of(call) for name, call in _public().items() if name not in NOT_CALLED} | {
    "rollout of lines": Row(
        lambda **given: fe.rollout(table.LINE, fe.FixedRange(0.25), [0, 1], **given),
        {},
        passed=table.kinds(fe.LineOptions)[0],
    ),
    "compare": Row(
        lambda **given: fe.compare(table.FLOCK, fe.FixedRange(0.25), **given),
        {name: kind for name, kind in COMPARE.items() if name not in {"scenario", "policies"}},
        after=lambda made: [*made.values.values()],
        passed={name: kind for name, kind in COMPARED.items() if name not in COMPARE},
    ),
    "from_json": Row(fe.FlockScenario.from_json, {"document": text(table.FLOCK.to_json())}),
    "from_toml": Row(fe.FlockScenario.from_toml, {"document": text(table.FLOCK.to_toml())}),
    "best_range": row_of(fe.sweep(table.FLOCK, [0.0, 5.0], range(3)).best_range),
    "write_video": row_of(video.write_video),
}
ROWS = CALLABLES | {key: row for name in WITH_METHODS for key, row in method_rows(name).items()}
ROWS |= flock_rows()
rows = pytest.mark.parametrize("row", ROWS.values(), ids=ROWS)


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    fe.save_policy(table.NAMED, "policy.npz")
    fe.save_run(table.RUN, "run.npz")


def called(row: Row, subject: Any, **changes: Any) -> Any:
    given = {name: kind.good for name, kind in row.arguments.items()} | changes
    return row.call(**given) if subject is None else row.call(subject, **given)


def complaint(row: Row, subject: Any, name: str, value: Any) -> str | None:
    try:
        called(row, subject, **{name: value})
    except fe.FlockescError as error:
        is_named = any(known in error.field for known in (name, *table.ALIASES.get(name, ())))
        is_told = str(error) == f"{error.field}: expected {error.expected}, got {error.given}"
        return None if is_named and is_told and len(str(error)) < 1500 else f"{error!r:.200}"
    except BaseException as error:  # a panic is no Exception
        return f"{type(error).__name__} {error!s:.200}"
    return "accepted"


@rows
def test_refused(row: Row) -> None:
    """Every bad value of every argument; then the subject goes on like one that was never asked."""
    subject, twin = (row.subject(), row.subject()) if row.subject else (None, None)
    complaints = {
        (name, number, type(value).__name__): complaint(row, subject, name, value)
        for name, kind in row.all_arguments.items()
        for number, value in enumerate(kind.bad())
    }
    assert not {case: text for case, text in complaints.items() if text}
    if row.subject:
        same(row.after(subject), row.after(twin))


@rows
def test_taken(row: Row) -> None:
    """Every form of a good value that means the same has the same outcome to the bit."""
    if row.subject is None:  # options that are passed on mean the same everywhere
        expected = row.after(called(row, None))
        for name, kind in row.arguments.items():
            for value in (kind.good, *kind.alike):
                same(row.after(called(row, None, **{name: value})), expected)
        return
    for name, kind in row.all_arguments.items():
        twin = row.subject()
        result, end = called(row, twin, **{name: kind.good}), row.after(twin)
        for value in (kind.good, *kind.alike):
            subject = row.subject()
            same(called(row, subject, **{name: value}), result)
            same(row.after(subject), end)


KEPT = {"sb3.FlockEvalCallback"}
"""Records of what they are given."""
COPIED = {name: row for name, row in CALLABLES.items() if row.after is not played and name not in KEPT}


@pytest.mark.parametrize("row", COPIED.values(), ids=COPIED)
def test_changes_by_the_caller_change_nothing(row: Row) -> None:
    """Arguments are copied, and results belong to the caller."""
    given = {name: kind.good for name, kind in row.arguments.items()}
    taken = copy.deepcopy(given)
    made = row.call(**taken)
    before = plain(copy.deepcopy(row.after(made)))
    spoil(taken)
    assert plain(row.after(made)) == before
    spoil(row.after(made))
    assert plain(row.after(row.call(**copy.deepcopy(given)))) == before
