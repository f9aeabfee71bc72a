"""Policies of command-line arguments: built-in ones, policy files, ``module:function`` and models of SB3."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import suffix_of
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.files import SUFFIX
from flockesc_env.policies.registry import EXPECTED as NAMED
from flockesc_env.policies.registry import as_policy, load_policy
from flockesc_env.policies.sb3 import SB3Policy

if TYPE_CHECKING:
    from flockesc_env.tasks.task import Task

EXPECTED = f"{NAMED}, the folder of a training run or module:function"

MODEL_SUFFIX = ".zip"
_SB3 = ("stable_baselines3", "sb3_contrib")


def policy_of(spec: str, *, task: Task | None = None) -> BasePolicy:
    """Return the policy of an argument. Code in a model of stable-baselines3 is executed.

    Args:
        spec: as for ``load_policy``, or ``module:function``: a function without arguments that returns a
            policy. The module may lie in the current folder. With a task also a model that
            stable-baselines3 saved: its class and file, for example ``PPO:model.zip``.
        task: task in which models of stable-baselines3 were trained; a model does not contain its options.

    Raises:
        InputError: if ``spec`` is none of these; if the file is damaged or is not a policy.
        MissingExtraError: if ``spec`` is a model and stable-baselines3 is not installed.
    """
    if suffix_of(spec) == MODEL_SUFFIX:
        return _model_policy(spec, task)
    module, is_code, function = spec.partition(":")
    if not is_code or module == "fixed" or suffix_of(spec) == SUFFIX:
        return load_policy(spec)
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # the script `flockesc` does not search there
    try:
        policy = getattr(importlib.import_module(module), function)()
    except (Exception, SystemExit) as error:  # the user's own code
        raise InputError("policy", f"one of {EXPECTED}", f"{spec!r} ({error!r})") from error
    return as_policy(policy, spec)


def _model_policy(spec: str, task: Task | None) -> BasePolicy:
    if task is None:
        expected = "a policy file, or in commands with --task a model with the task of its training"
        raise InputError("policy", expected, repr(spec))
    require("sb3", ["stable_baselines3"])
    name, _, path = spec.rpartition(":")
    try:
        packages = [importlib.import_module(package) for package in _SB3 if importlib.util.find_spec(package)]
        (algorithm,) = {getattr(package, name) for package in packages if hasattr(package, name)}
        model = algorithm.load(path, device="cpu")
    except (Exception, SystemExit) as error:  # the class, its code and the file are the user's
        expected = "ALGORITHM:FILE.zip with a class of stable-baselines3 or sb3-contrib, as PPO:model.zip"
        raise InputError("policy", expected, f"{spec!r} ({error!r})") from error
    known = {"per_agent": task.per_agent, "scenario": task.scenario, **task.options}
    return SB3Policy(model).with_options(name=Path(path).stem, **known)
