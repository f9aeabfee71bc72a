"""The memory of a batch."""

from __future__ import annotations

import os

from flockesc_env.common.errors import ArgumentError

# Measured with a million agents in 2-D after some steps, per coordinate.
_BYTES_PER_AGENT = 130
_GIB = 1 << 30


def check_memory(num_flocks: int, num_agents: int, dimension: int, observation_bytes: int) -> None:
    """Refuse a batch that is larger than the memory of the machine.

    Args:
        num_flocks: number of flocks.
        num_agents: number of agents per flock.
        dimension: D.
        observation_bytes: size of the observations of one flock.

    Raises:
        ArgumentError: if the batch does not fit.
    """
    if "SC_PHYS_PAGES" not in getattr(os, "sysconf_names", {}):
        return  # Windows
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    needed = num_flocks * (num_agents * dimension * _BYTES_PER_AGENT + observation_bytes)
    if needed > memory:
        expected = f"a batch that fits into the {memory / _GIB:.0f} GiB of this machine"
        given = f"{num_flocks:,} of {num_agents:,} agents, about {needed / _GIB:,.0f} GiB"
        raise ArgumentError("num_flocks", expected, given)
