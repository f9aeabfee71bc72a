"""Policies of command-line arguments: built-in ones, policy files and a user's own ``module:function``."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies.files import SUFFIX, find_policy
from flockesc_env.policies.registry import NAMES, NamedPolicy

EXPECTED = f"{', '.join(NAMES)}, a policy file or module:function"


def policy_of(spec: str, argument: str = "policies") -> NamedPolicy:
    """Return the policy of an argument.

    Args:
        spec: as for ``find_policy``, or ``module:function``: a function without arguments that returns a
            ``NamedPolicy``. The module may lie in the current folder.
        argument: name of the argument, for the error message.

    Raises:
        ArgumentError: if ``spec`` is none of these.
        RecordError: if the file is damaged or is not a policy.
    """
    module, is_code, function = spec.partition(":")
    if not is_code or module == "fixed" or spec.endswith(SUFFIX):
        return find_policy(spec, argument)
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # the script `flockesc` does not search there
    try:
        policy = getattr(importlib.import_module(module), function)()
    except (Exception, SystemExit) as error:  # the user's own code
        raise ArgumentError(argument, f"one of {EXPECTED}", f"{spec!r} ({error!r})") from error
    if not isinstance(policy, NamedPolicy):
        raise ArgumentError(argument, f"a NamedPolicy from {spec}", type(policy).__name__)
    return policy
