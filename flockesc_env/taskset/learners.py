"""Learners of a task: the algorithm and its hyperparameters, from ``learners/TASK.toml``."""

import tomllib
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Final

import msgspec

from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.episodes.spaces import PolicySpec

OWN_ALGORITHMS: Final = ("search", "gradient", "imitation", "rule")
"""Algorithms of ``python -m training`` that are not of stable-baselines3 or sb3-contrib."""

_LINEAR: Final = "lin_"
"""Start of a text that stands for a number that falls to 0 during training, as in rl_zoo3."""


class Learner(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A learner: a table of the file.

    Attributes:
        algorithm: class of stable-baselines3 or sb3-contrib, such as ``"PPO"``; ``"search"`` (CMA-ES),
            ``"gradient"`` (JAX) or ``"imitation"``; ``"rule"``, a search for the best rule and its numbers.
        seeds: number of training seeds on the scoreboard.
        note: remark for readers; may be empty.
        options: options of the environment that replace the task's, such as ``reward``.
        hyperparameters: arguments of the algorithm. ``"lin_1e-3"`` falls from 1e-3 to 0.
        policy: policy of stable-baselines3: a name such as ``"MlpPolicy"``, or ``module:class``.
        first_range: range in m near which the untrained policy is, of ``RangePolicy`` and ``"gradient"``;
            ``None``: the best fixed range.
        norm_obs: whether ``VecNormalize`` standardizes the observations.
        num_flocks: number of flocks, or lines, that stable-baselines3 steps together.
        samples: number of actions of a training run; 0: that of the task.
        num_steps: model steps of an episode of training, if that decides the objective; 0: the scenario's.
        num_evaluations: number of evaluations on tuning flocks, beside that of the untrained model.
    """

    algorithm: str
    seeds: int = 5
    note: str = ""
    options: dict[str, Any] = {}
    hyperparameters: dict[str, Any] = {}
    policy: str = "MlpPolicy"
    first_range: float | None = None
    norm_obs: bool = False
    num_flocks: int = 4
    samples: int = 0
    num_steps: int = 0
    num_evaluations: int = 8

    def arguments(self, spec: PolicySpec, best_fixed_range: float) -> dict[str, Any]:
        """Return the keyword arguments of the class of stable-baselines3; see ``Task.hyperparameters``."""
        require("sb3", ["stable_baselines3"])
        found = {key: _value(value) for key, value in self.hyperparameters.items()}
        if self.policy.startswith("flockesc_env"):
            known: dict[str, Any] = {"spec": spec}
            if self.policy.endswith("RangePolicy"):
                first = best_fixed_range if self.first_range is None else self.first_range
                known["first_range"] = min(first, spec.actions.max_range)
            found["policy_kwargs"] = known | found.get("policy_kwargs", {})
        return {"policy": _value(self.policy), **found}


def learners_of(task: str, actor: str) -> dict[str, Learner]:
    """Return the learners of a task, whose ranges an actor sets, by name; see ``Task.learners``.

    The files every-agent.toml and every-flock.toml have learners of all such tasks. The fields of a table in
    the task's own file replace those of the table of the same name.
    """
    common, own = _read(f"every-{actor}"), _read(task)
    merged = {name: common.get(name, {}) | own.get(name, {}) for name in {**common, **own}}
    return read_learners(merged, f"{task}.toml")


def read_learners(tables: dict[str, Any], field: str) -> dict[str, Learner]:
    """Return the learners of a file's tables; an ``InputError`` names the table and the field."""
    try:
        return msgspec.convert(tables, dict[str, Learner])
    except msgspec.ValidationError as error:
        expected = f"tables with {', '.join(Learner.__struct_fields__)}"
        raise InputError(field, expected, error) from None


@cache
def _read(name: str) -> dict[str, Any]:
    file = Path(__file__).parent / "learners" / f"{name}.toml"
    return tomllib.loads(file.read_text("utf-8")) if file.is_file() else {}


def _value(value: Any) -> Any:
    """Return a value with schedules and classes of torch instead of their names."""
    if isinstance(value, dict):
        return {key: _value(entry) for key, entry in value.items()}
    if isinstance(value, str) and value.startswith(_LINEAR):
        from stable_baselines3.common.utils import LinearSchedule

        return LinearSchedule(float(value.removeprefix(_LINEAR)), 0.0, 1.0)
    return resolve_name(value) if isinstance(value, str) and ":" in value else value
