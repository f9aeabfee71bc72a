"""Policies by name and in files (npz): ``load_policy``, ``as_policy``, ``bind``, ``save_policy``."""

import json
import math
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, cast, get_args

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.array_files import read_document, write_document
from flockesc_env.common.checks import as_choice, as_flag, as_path, as_text, parse_number
from flockesc_env.common.errors import InputError, shown, shown_name
from flockesc_env.common.files import suffix_of
from flockesc_env.episodes.predators import PredatorPolicySpec, reset_policy
from flockesc_env.episodes.spaces import PolicySpec, policy_spec
from flockesc_env.models.records import versions
from flockesc_env.policies import rules
from flockesc_env.policies.base import BasePolicy, Observations, Policy
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.network import Architecture, NetworkPolicy, PredatorNetwork
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.scenario.document import from_fields
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import PROFILE_RANGES, UNOBSERVED, to_plain
from flockesc_env.scenario.presets import MODELS, Scenario

SUFFIX = ".npz"
POLICY_FILE = "policy.npz"
"""Name of the policy file in the folder of a training run."""

_SENSING = "predator_sensing_range"  # infinity is null in the file
_PREDATOR = "predator"  # in the file instead of the model, if the policy controls predators
_HEADER = {"name", "model", "scenario", "per_agent", "options", "architecture"}

Rule = (
    rules.FixedRange
    | rules.StubbornLeaders
    | rules.ListenWhileFleeing
    | rules.BestNextHeading
    | StubbornWitnesses
    | ListenWhileThreatened
    | WinStayLoseShift
)
Stored = NetworkPolicy | Rule
"""Policies that can be saved: their parameters are an array."""

_RULES: dict[str, type[Rule]] = {rule.__name__: rule for rule in get_args(Rule)}

_VISIBLE: dict[str, Any] = {"predator_sensing_range": math.inf}
_LOCAL: dict[str, Any] = {"predator_sensing_range": 30.0}
_PROFILE: dict[str, Any] = {**_VISIBLE, "profile_ranges": PROFILE_RANGES}
_ESCAPE: dict[str, Any] = {"extra_entries": ("escape_direction",)}
_APPROACH: dict[str, Any] = {"extra_entries": ("closest_approach",)}

_shift = partial(WinStayLoseShift, 10.0, 50.0, 0.85, 0.1)

_BUILT_IN: Final[dict[str, tuple[Callable[[], BasePolicy], dict[str, Any]]]] = {
    "random": (lambda: rules.RandomRange(0), {}),
    "stubborn-leaders": (rules.StubbornLeaders, _VISIBLE),
    "stubborn-leaders-local": (rules.StubbornLeaders, _LOCAL),
    "stubborn-witnesses": (StubbornWitnesses, {**_LOCAL, "steps_per_action": 1}),
    "listen-while-fleeing": (rules.ListenWhileFleeing, _VISIBLE),
    "listen-while-threatened": (ListenWhileThreatened, {**_LOCAL, **_APPROACH, "max_range": 150.0}),
    "win-stay-lose-shift": (WinStayLoseShift, {**_VISIBLE, **_APPROACH}),
    "win-stay-lose-shift-escape": (lambda: _shift(criterion="escape_direction"), {**_VISIBLE, **_ESCAPE}),
    "win-stay-lose-shift-estimate": (lambda: _shift(criterion="estimated_escape_direction"), _VISIBLE),
    "win-stay-lose-shift-clockless": (lambda: _shift(criterion="estimated_encounter"), _VISIBLE),
    "turn-away": (lambda: rules.BestCandidate("escape_cosine"), {**_PROFILE, **_ESCAPE}),
    "keep-distance": (lambda: rules.BestCandidate("closest_approach"), {**_PROFILE, **_APPROACH}),
    "head-away": (rules.BestNextHeading, {**_PROFILE, **_ESCAPE}),
}
"""Constructor and options of each policy; those without options play with any."""

PREDATORS: Final[dict[str, Callable[[], BasePolicy]]] = {
    "fly-straight": rules.FlyStraight,
    "pursue": rules.Pursue,
    "pursue-centroid": partial(rules.Pursue, "centroid"),
}
"""Constructors of the built-in policies of predators by name."""

DEFAULT_FLOCK: Final = "fixed:10"
"""The policy of a flock against which predators play by default."""

NAMES = ("fixed:RHO", *_BUILT_IN)
"""Names of the built-in policies, which docs/policies.md describes. ``fixed:10`` is a fixed range of 10 m."""

TRAINED: Final = Path(__file__).parent / "trained"
"""Files of the trained policies of this package, ``TASK/LEARNER.npz``."""

EXPECTED: Final = f"{', '.join(NAMES)}, TASK/LEARNER of a trained policy, or a policy file (.npz)"
"""What ``load_policy`` takes."""


def load_policy(policy: str | os.PathLike[str]) -> BasePolicy:
    """Return a built-in rule, a trained policy of this package, or the policy in a file.

    The policy knows its options: ``parallel_env(policy.scenario, **policy.options)`` is its environment.

    Args:
        policy: one of ``NAMES``, for example ``"stubborn-leaders"``; a task and a learner of the scoreboard,
            for example ``"per-agent-visible/search"``; the path of a file that ``save_policy`` wrote; or the
            folder of a training run. Untrusted files are safe: no code in them is executed.

    Raises:
        InputError: if the file is damaged or not a policy, or its network cannot act in its scenario.
    """
    return find_policy(policy, "policy")


def find_policy(policy: Any, argument: str) -> BasePolicy:
    """Return ``load_policy``; errors name the argument."""
    spec = policy if isinstance(policy, str) else os.fspath(as_path(policy, argument))
    if spec.startswith("fixed:"):
        with suppress(ValueError):  # not a finite number >= 0
            return rules.FixedRange(parse_number(spec.removeprefix("fixed:"), float)).with_options(name=spec)
        if suffix_of(spec) != SUFFIX:
            expected = "fixed:RHO with a finite number RHO >= 0, such as fixed:10"
            raise InputError(argument, expected, shown(spec))
    if spec in PREDATORS:
        return PREDATORS[spec]()
    if spec in _BUILT_IN:
        make, options = _BUILT_IN[spec]
        rule = make()
        rule.name, rule.options = spec, {**options} or None
        return rule
    file = policy_file(spec)
    if file is None:
        raise InputError(argument, EXPECTED, shown_name(spec, [*NAMES, *trained()]))
    found = parse_policy(file.read_bytes(), Path(spec))
    return found.with_options(name=spec) if spec in trained() else found


def policy_file(spec: str) -> Path | None:
    """Return the file of a trained policy of this package, of a training run, or at a path, or ``None``."""
    if spec in _BUILT_IN:  # also if a training run has this name
        return None
    if spec in trained():
        return TRAINED / f"{spec}{SUFFIX}"
    path = Path(spec, POLICY_FILE) if Path(spec, POLICY_FILE).is_file() else Path(spec)
    return path if suffix_of(path) == SUFFIX and path.is_file() else None


@cache
def trained() -> tuple[str, ...]:
    """Return the names of the trained policies of this package, ``TASK/LEARNER``, in order.

    Each is that of the first training seed; ``scoreboard`` has all of them and their scores.
    """
    return tuple(sorted(f"{file.parent.name}/{file.stem}" for file in TRAINED.glob(f"*/*{SUFFIX}")))


class GivenPolicy(BasePolicy):
    """A user's object with a method ``act`` and, maybe, attributes of ``BasePolicy``."""

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.name = type(policy).__name__
        self.side = getattr(policy, "side", None)
        own = {name: getattr(policy, name, None) for name in ("name", "per_agent", "scenario")}
        options = getattr(policy, "options", None) or {}
        vars(self).update(vars(self.with_options(**own, **options)))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the actions of the user's object."""
        return self.policy.act(observations, spec)

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Call the object's method ``reset`` if it has one."""
        reset_policy(self.policy, rows)


def as_policy(value: Any, argument: str = "policy") -> BasePolicy:
    """Return a policy, given as a policy, its name or path, or a model of stable-baselines3."""
    if isinstance(value, BasePolicy):
        return value
    if isinstance(value, str | os.PathLike):
        return find_policy(value, argument)
    if not isinstance(value, type):
        if callable(getattr(value, "act", None)):
            return GivenPolicy(value)
        if callable(getattr(value, "predict", None)):
            return SB3Policy(value)
    expected = "an object with a method act, a model of stable-baselines3, a name, or the path of a file"
    if isinstance(value, int | float) and not isinstance(value, bool):
        expected = f"a policy, such as FixedRange({shown(value)}) or 'fixed:{shown(value)}'"
    raise InputError(argument, expected, shown(value))


def as_flock_policy(value: Any, argument: str = "policy") -> BasePolicy:
    """Return ``as_policy``; policies that are known to control predators are refused."""
    if (found := as_policy(value, argument)).side == "predator":
        expected = "a policy that sets ranges (predator_policy=.. takes policies of predators)"
        raise InputError(argument, expected, repr(found.name))
    return found


def as_predator_policy(value: Any) -> BasePolicy:
    """Return ``as_policy``; policies that are known to set the ranges of a flock are refused."""
    expected = (
        f"{', '.join(PREDATORS)}, a policy file (.npz), a predator's model or an object with a method act"
    )
    if isinstance(value, str | os.PathLike):
        spec = os.fspath(as_path(value, "predator_policy"))
        if spec not in PREDATORS and policy_file(spec) is None:
            raise InputError("predator_policy", expected, shown_name(spec, PREDATORS))
    elif not callable(getattr(value, "act", getattr(value, "predict", None))):
        raise InputError("predator_policy", expected, shown(value))
    if (found := as_policy(value, "predator_policy")).side == "flock":
        raise InputError("predator_policy", expected, f"{shown(value)}, which sets ranges of a flock")
    return found


def bind(policy: Any, env: Any) -> Callable[[Any], Any]:
    """Return a function ``act(obs)`` that returns the policy's action for ``env.step``.

    Observations can be those of the Gymnasium environments, the vector environments (Gymnasium and SB3,
    stacked) and the PettingZoo parallel environment (a dict per agent). The memory of a flock's rows is reset
    when the ``time`` of all their observations is 0. In the parallel environment the policy gets a row per
    agent of the flock, zeros for caught agents. Only the agents in ``env.agents`` get an action. Predators
    that are agents fly straight on.

    Args:
        policy: a policy, its name or path, or a model of stable-baselines3.
        env: an environment of this package. Wrappers may change neither observations nor actions, except for
            ``ClipAction``.

    Raises:
        InputError: if a wrapper changes a space of ``env`` or normalizes its observations, or the environment
            lacks the options that the policy knows.
    """
    return as_policy(policy).bind(env)


def save_policy(policy: BasePolicy | Any, path: str | Path) -> None:
    """Write a policy with its scenario and options to an npz file; an existing file is replaced atomically.

    Args:
        policy: a ``NetworkPolicy``, ``PredatorNetwork``, ``FixedRange`` or rule with numbers, whose method
            ``with_options`` gave it a view, a scenario and options; or a model of stable-baselines3, which is
            written as its ``SB3Policy.network``.
        path: path of the file.
    """
    file_path = as_path(path)
    if callable(getattr(policy, "predict", None)) and not hasattr(policy, "act"):
        policy = SB3Policy(policy)
    if isinstance(policy, SB3Policy):
        policy = policy.network().with_options(name=policy.name)
    scenario, per_agent = getattr(policy, "scenario", None), getattr(policy, "per_agent", None)
    if not isinstance(policy, Stored) or scenario is None or per_agent is None:
        kinds = f"a NetworkPolicy, {', '.join(_RULES)}"
        ways = "policy.with_options(per_agent=.., scenario=.., **options) adds them"
        raise InputError("policy", f"{kinds} with its view and scenario ({ways})", shown(policy))
    options = policy.options or asdict(scenario.env_options(policy.all_options(scenario)))
    kept = {name: value for name, value in options.items() if policy.options or name not in UNOBSERVED}
    header = {
        "name": policy.name,
        "model": _PREDATOR if isinstance(policy, PredatorNetwork) else scenario.model,
        "scenario": json.loads(scenario.to_json()),
        "per_agent": per_agent,
        "options": to_plain(kept),
        **({"opponent": policy.opponent} if policy.opponent else {}),
        "architecture": (
            asdict(policy.architecture) if isinstance(policy, NetworkPolicy) else type(policy).__name__
        ),
        **({"criterion": policy.criterion} if isinstance(policy, WinStayLoseShift) else {}),
        "versions": versions(),
    }
    write_document(file_path, header, {"parameters": policy.parameters})


def parse_policy(raw: bytes, path: Path) -> BasePolicy:
    """Return the policy in the bytes of a policy file; see ``load_policy``. Errors name ``path``."""
    header, arrays = read_document(path, "a policy", "parameters", raw)
    try:
        return _stored_policy(header, arrays["parameters"])
    except InputError as error:
        raise InputError(f"{path}: {error.field}", error.expected, error.given) from None
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(str(path), "a policy", repr(error)) from None


def _stored_policy(header: dict[str, Any], parameters: Any) -> BasePolicy:
    if not header.keys() >= _HEADER:
        raise InputError("header", ", ".join(sorted(_HEADER)), ", ".join(header) or "none")
    name, per_agent = as_text(header["name"], "name"), as_flag(header["per_agent"], "per_agent")
    options = dict(header["options"])
    if options.get(_SENSING, 0.0) is None:
        options[_SENSING] = math.inf
    is_predator = header["model"] == _PREDATOR
    model = "flock" if is_predator else as_choice(header["model"], "model", MODELS)
    scenario = from_fields(MODELS[model], header["scenario"])
    chosen = {"criterion": header["criterion"]} if "criterion" in header else {}
    architecture: dict[str, Any] | str = header["architecture"]
    policy: Stored
    if isinstance(architecture, str):
        policy = _RULES[as_choice(architecture, "architecture", _RULES)](*parameters, **chosen)
    else:
        lists = {name: tuple(value) for name, value in architecture.items() if isinstance(value, list)}
        kind = PredatorNetwork if is_predator else NetworkPolicy
        policy = kind(Architecture(**{**architecture, **lists}), parameters)
        _check_inputs(policy, scenario, options, per_agent)
    known: Any = {"name": name, "per_agent": per_agent, "scenario": scenario}
    return policy.with_options(**known, opponent=header.get("opponent"), **options)


def _check_inputs(policy: NetworkPolicy, scenario: Scenario, options: Any, per_agent: bool) -> None:
    """Check that a network can act, for example that its inputs are observed.

    A line of n agents has the entries offset_0 to offset_(n - 1), which can take gigabytes. The network acts
    on a line of one agent instead, where each of these names stands for offset_0.
    """
    if isinstance(scenario, LineScenario):
        last = scenario.num_agents - 1
        scenario = scenario.replace(num_agents=1)
        inputs = tuple("offset_0" if _is_offset(name, last) else name for name in policy.architecture.inputs)
        policy = NetworkPolicy(replace(policy.architecture, inputs=inputs), policy.parameters)
    spec: Any = policy_spec(scenario, scenario.env_options(options), per_agent=per_agent)
    if isinstance(policy, PredatorNetwork):
        spec = PredatorPolicySpec.of(cast("FlockScenario", scenario))
    policy.act(np.zeros((1, len(spec.layout.names)), np.float32), spec)


def _is_offset(name: str, last: int) -> bool:
    """Return whether a name is one of offset_0 to offset_``last``."""
    found = re.fullmatch(r"offset_(0|[1-9]\d*)", name, re.ASCII)
    return found is not None and int(found[1]) <= last
