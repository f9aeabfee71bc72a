"""Versions of the packages that the results of training depend on."""

from flockesc_env.models import records


def versions() -> dict[str, str]:
    """Return the installed versions of Python and the packages that results depend on."""
    return records.versions("cmaes", "gymnasium", "pettingzoo", "sb3-contrib", "stable-baselines3", "torch")
