"""Versions of the packages that the results of training depend on."""

from importlib.metadata import version
from platform import python_version

_PACKAGES = (
    "cmaes",
    "flockesc-env",
    "gymnasium",
    "numpy",
    "pettingzoo",
    "sb3-contrib",
    "stable-baselines3",
    "torch",
)


def versions() -> dict[str, str]:
    """Return the installed versions of Python and the packages that results depend on."""
    return {"python": python_version(), **{name: version(name) for name in _PACKAGES}}
